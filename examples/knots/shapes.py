"""Curves of the rod benchmarks as points at the nodes of rods."""

import numpy as np
from braid import braid
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq


def resampled(curve, spacing):
    """Return points (m, 3) of a fine curve (n, 3); `spacing` takes arc lengths (n,) to distances between nodes (n,)."""
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1)))
    density = 1 / spacing(s)
    number = np.append(0.0, np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(s)))
    at = np.interp(np.linspace(0, number[-1], round(number[-1]) + 1), number, s)
    return np.column_stack([np.interp(at, s, x) for x in curve.T])


def evenly(curve, count):
    """Return the nodes of `count` elements of one length along a fine curve (n, 3)."""
    length = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
    return resampled(curve, lambda s: length / count + 0 * s)


def straight(length, count):
    """Return the nodes of a straight rod along x of `count` elements."""
    return np.column_stack([np.linspace(0, length, count + 1), np.zeros((count + 1, 2))])


def knot(loose, turns, size=1.0, tail=8.0, clear=0.96):
    """Return the nodes of a `loose` knot of so many turns (lengths over the rod's radius), and the middle of its loop.

    Strands of its braid are drawn as if they touched (`clear` 1), along a circle that meets the tails. These are `tail`
    radii of the loop long, and become straight. Elements are `size` long where strands may touch, and at most a
    sixteenth of the radius of the loop elsewhere.
    """
    radius, bent, inner = 1 / loose.curvature, loose.half / loose.angle, braid(turns)
    scale = np.sqrt(2 / loose.parting)
    parted = inner.t[(inner.t > 0) & (np.hypot(*inner.w.T) > 3)][0]  # there strands are apart
    t = np.linspace(0, parted, 3001)
    w, a = clear * np.column_stack([np.interp(t, inner.t, each) for each in inner.w.T]), t * scale / bent
    middle = bent * np.column_stack([np.sin(a), 1 - np.cos(a), 0 * a])
    way = w[:, :1] * np.column_stack([-np.sin(a), np.cos(a), 0 * a]) + w[:, 1:] * [0, 0, 1]
    inside, outside = middle + way, middle - way  # to the right: into the loop, and into the tail
    begin, leave = (np.arctan2(*(strand[-1] - strand[-2])[1::-1]) for strand in (inside, outside))
    turn = np.linspace(begin, np.pi, 3001)

    def quarter(m):
        """Return places (n, 2) on half of a loop, an elastica of parameter m."""
        bend = np.sqrt((1 - m * np.sin(turn / 2) ** 2) / (1 - m * np.sin(begin / 2) ** 2)) / radius
        step = np.column_stack([np.cos(turn), np.sin(turn)]) / bend[:, None]
        return inside[-1, :2] + cumulative_trapezoid(step, turn, axis=0, initial=0)

    half = quarter(brentq(lambda m: quarter(m)[-1, 0], -20, 0.9999))
    half = np.column_stack([half, inside[-1, 2] * np.cos(np.linspace(0, np.pi / 2, len(half)))])
    s = np.linspace(0, tail * radius, 6001)
    angle, fades = leave * np.exp(-s / radius), np.exp(-s / radius)
    along = cumulative_trapezoid(np.column_stack([np.cos(angle), np.sin(angle)]), s, axis=0, initial=0)
    away = np.column_stack([outside[-1, :2] + along, outside[-1, 2] * fades])
    right, other = (
        np.concatenate([outside, away[1:]]),
        [-1, 1, -1],
    )  # the left half is the right one, turned over
    parts = (
        (right * other)[::-1],
        inside[1:],
        half[1:],
        (half * other)[-2::-1],
        (inside * other)[-2::-1],
        right[1:],
    )
    curve = np.concatenate(parts)
    step = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1)))
    middles = np.array([0, step[-1]]) + np.array([1, -1]) * (tail * radius + parted * scale)
    reach = parted * scale + 2 * np.sqrt(radius)

    def spacing(s):
        beyond = np.abs(s[:, None] - middles).min(axis=1) - reach
        return np.clip(size + 0.15 * beyond, size, radius / 16)

    nodes = resampled(curve, spacing)
    return nodes, len(nodes) // 2
