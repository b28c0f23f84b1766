"""The braid of a loose knot: two strands that wind around each other, between a loop and two tails.

Seen along the braid, half of the way from one strand to the other is h w(t) at the arc length s = l t, l^2 = 2 h / k,
where k is the curvature that the strands have less of each other far away. Bending alone resists:

    minimise  int |w''|^2 / 2 dt,   |w| >= 1,   w'' -> (1, 0) to the right and (-1, 0) to the left.

A knot of n turns winds by 2 n + 1 half turns. Sliding strands rub with mu B k^(3/2) h^(-1/2) `friction`. For one turn
`friction` is the 0.492 of Audoly et al. (2007); a further turn adds 2 pi / 12^(3/4), as for the long braids of Jawed et
al. (2015). So their theory counts half a turn too much where there are few.
"""

from functools import cache

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

RATE = 3**-0.25  # of the winding of a long braid, over t
PER_TURN = 2 * np.pi / 12**0.75  # what a turn of a long braid adds to `friction`
SOFTEST, FADING, HARD = 0.1, 0.2, 1e-5  # barrier that keeps strands apart: at first, ratio of steps, at last
ROUNDING = 1e-10  # of the energy


class Braid:
    """The solution for n turns: places t (N,), ways w (N, 2), half the length of the braid, and its friction.

    Far away w is (t - `half`)^2 / 2 along its first axis: strands seem to part at t = `half`.
    """

    def __init__(self, turns, count=801):
        length = np.pi * turns / RATE - 1.0
        self.t = np.linspace(-length - 4, length + 4, count)
        step, far = self.t[1] - self.t[0], np.maximum(np.abs(self.t) - length, 0)
        angle = (turns + 0.5) * np.pi * np.clip(self.t / length, -1, 1)
        w = (1.2 + 0.5 * far**2)[:, None] * np.column_stack([(-1) ** turns * np.sin(angle), np.cos(angle)])
        second = sp.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(count - 2, count)) / step**2
        self._bending = sp.kron(step * second.T @ second, sp.eye(2)).tocsc()
        self._pull = np.zeros((count, 2))
        self._pull[[0, 1, -2, -1], 0] = np.array([-1, 1, -1, 1]) / step
        barrier = SOFTEST
        while barrier > HARD:
            barrier = max(FADING * barrier, HARD)
            w = self._balanced(w, barrier * step)
        # The sum of contact forces: the fourth derivative of w times w, integrated by parts
        flat = w.ravel()
        self.w, self.friction = w, float(flat @ (self._bending @ flat) - np.sum(self._pull * w)) / 2**1.5
        self.half = float(self.t[-2] - (w[-1, 0] - w[-3, 0]) / (2 * step))

    def _balanced(self, w, barrier):
        """Return w (N, 2) where the energy with barrier terms is least: Newton's method, shortened to lower it."""
        for _ in range(300):
            r = _length(w)
            out, push = w / r[:, None], barrier / (r - 1)
            force = (self._bending @ w.ravel()).reshape(w.shape) - self._pull - push[:, None] * out
            along = np.einsum("ki,kj->kij", out, out)
            for turning in (1.0, 0.0):  # without the terms of turning the tangent is positive
                local = (push / (r - 1))[:, None, None] * along
                local -= turning * (push / r)[:, None, None] * (np.eye(2) - along)
                blocks = sp.bsr_matrix((local, np.arange(len(w)), np.arange(len(w) + 1)))
                change = spsolve((self._bending + blocks).tocsc(), -force.ravel()).reshape(w.shape)
                change = 0.5 * (change + change[::-1] * [-1, 1])  # half a turn about the second axis
                gain = -np.sum(force * change)
                if gain > 0:
                    break
            if gain < ROUNDING:
                return w
            share, energy = 1.0, self._energy(w, barrier)
            # Strands must not pass each other on the way
            while not (
                np.all(_length(w + share * change) - 1 > 0.02 * (r - 1))
                and np.all(_nearest(w, share * change) > 1)
                and self._energy(w + share * change, barrier) <= energy + ROUNDING
            ):
                share *= 0.6
                if share < 1e-9:
                    return w
            w = w + share * change
        return w

    def _energy(self, w, barrier):
        flat = w.ravel()
        return (
            0.5 * flat @ (self._bending @ flat)
            - np.sum(self._pull * w)
            - barrier * np.sum(np.log(_length(w) - 1))
        )


def _length(w):
    return np.hypot(*w.T)


def _nearest(w, change):
    """Return the least lengths (N,) on the straight ways from w to w + change."""
    at = np.clip(-np.sum(w * change, axis=1) / np.maximum(np.sum(change**2, axis=1), 1e-300), 0, 1)
    return _length(w + at[:, None] * change)


@cache
def braid(turns):
    """Return the braid of a knot of n turns."""
    return Braid(turns)
