"""Single solid yarns for verification: their space, their stiffness at rest, linear solutions."""

import numpy as np
import scipy.sparse as sp
from hexahedral_block import made_of
from scipy.sparse.linalg import splu

from knitstudy.mechanics.solids.spline_yarn.space import Space, yarn_space
from knitstudy.mechanics.solids.spline_yarn.span import span_groups

RADIUS, YOUNG, POISSON = 0.9, 1300.0, 0.4
SHEAR = YOUNG / (2 * (1 + POISSON))
AREA = np.pi * RADIUS**2
INERTIA = np.pi * RADIUS**4 / 4
LENGTH = 6.0
UNEVEN = np.array([0.0, 1.0, 1.4, 2.0, 3.3, 4.5, LENGTH])
MIXED = [2, 2, 4, 3, 2, 2]


def straight(s):
    """A straight centreline along z, and its directors."""
    one = np.ones_like(s)
    return (
        np.multiply.outer(s, [0, 0, 1]),
        np.multiply.outer(one, [1, 0, 0]),
        np.multiply.outer(one, [0, 1, 0]),
    )


def arc(curvature):
    """A circular centreline in the plane of x and z, and its directors."""

    def curve(s):
        t, zero = curvature * s, 0 * s
        centre = np.stack([1 - np.cos(t), zero, np.sin(t)], axis=-1) / curvature
        return centre, np.stack([np.cos(t), zero, -np.sin(t)], axis=-1), np.tile([0.0, 1.0, 0.0], (len(s), 1))

    return curve


class Rod:
    """One yarn of a law by name, or of a material, as matrices."""

    def __init__(self, curve, breaks, degrees, spline_degree=3, law="hencky", poisson=POISSON):
        yarn = yarn_space(breaks, degrees, spline_degree)
        s = np.unique(np.concatenate([np.linspace(*pair, 8) for pair in yarn.spline.spans]))
        coefficients = (yarn.spline.fit(s, values) for values in curve(s))
        self.space, self.nodes = Space((yarn,)), yarn.coefficients(*coefficients, RADIUS)
        self.groups = span_groups(
            self.space, self.nodes, made_of(law, YOUNG, poisson) if isinstance(law, str) else law
        )

    def respond(self, displacement):
        """Return the forces (N, 3) at the nodes and the energy."""
        force, energy = np.zeros((self.space.size, 3)), 0.0
        for group in self.groups:
            answer = group.elements.respond(slice(None), displacement[group.connectivity], False)
            np.add.at(force, group.connectivity, answer.force)
            energy += answer.internal.sum()
        return force, energy

    def stiffness(self, displacement=None, step=None):
        """Return the tangent (3 N, 3 N), where the yarn came by a straight step if there is one."""
        u = np.zeros((self.space.size, 3)) if displacement is None else displacement
        total = 0
        for group in self.groups:
            nodes = group.connectivity
            a = nodes.shape[1]
            way = None if step is None else step[nodes]
            blocks = group.elements.respond(slice(None), u[nodes], True, step=way).stiffness
            row = 3 * np.repeat(nodes, a, axis=1)[..., None] + np.repeat(np.arange(3), 3)
            column = 3 * np.tile(nodes, (1, a))[..., None] + np.tile(np.arange(3), 3)
            size = 3 * self.space.size
            total = total + sp.csc_matrix((blocks.ravel(), (row.ravel(), column.ravel())), shape=(size, size))
        return total

    def end(self, last):
        """Return the nodes of the first or of the last section."""
        station = self.space.station
        return np.flatnonzero(station == (station.max() if last else 0))

    def project(self, field):
        """Return the coefficients (N, 3) of a displacement field of places (k, 3) that lies in the space."""
        yarn = self.space.yarns[0]
        rng = np.random.default_rng(0)
        count = 4 * self.space.size
        x, s = rng.uniform(-0.7, 0.7, (count, 2)), rng.uniform(*yarn.spline.knots[[0, -1]], count)
        matrix = self.space.matrix(np.zeros(count, int), x, s)
        return np.linalg.lstsq(matrix.toarray(), field(matrix @ self.nodes), rcond=None)[0]

    def solve(self, prescribed, values, load=None):
        """Return linear displacements (N, 3) and forces (N, 3) where nodes are prescribed."""
        stiffness = self.stiffness()
        fixed = (3 * prescribed[:, None] + np.arange(3)).ravel()
        free = np.setdiff1d(np.arange(stiffness.shape[0]), fixed)
        u = np.zeros(stiffness.shape[0])
        u[fixed] = values.ravel()
        rest = (np.zeros_like(u) if load is None else load.ravel()) - stiffness @ u
        u[free] = splu(sp.csc_matrix(stiffness[free][:, free])).solve(rest[free])
        return u.reshape(-1, 3), (stiffness @ u).reshape(-1, 3)


def bent_rod(law="hencky"):
    """A bent yarn with spans and degrees of all kinds."""
    return Rod(arc(0.5 / RADIUS), UNEVEN, MIXED, law=law)
