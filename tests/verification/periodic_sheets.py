"""Sheets of straight solid yarns that repeat themselves, and cells of a knit: their stiffness as shells."""

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.periodic import condensed, seam
from knitstudy.mechanics.solid import SolidModel
from knitstudy.mechanics.spline_yarn.space import Space, yarn_space
from knitstudy.mechanics.spline_yarn.span import span_groups

RADIUS, YOUNG, POISSON = 0.9, 1300.0, 0.3
SHEAR = YOUNG / (2 * (1 + POISSON))
AREA, INERTIA = np.pi * RADIUS**2, np.pi * RADIUS**4 / 4
TORSION = 2 * INERTIA
PLACES = 8


def rotated(stiffness: np.ndarray, angle: float) -> np.ndarray:
    """Return the stiffness (6, 6) of the shell turned in its plane by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    strains = np.array(
        [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]]
    )  # in the axes of the shell, from those in space
    turn = np.kron(np.eye(2), strains)
    return turn.T @ stiffness @ turn


def referred(stiffness: np.ndarray, height: float) -> np.ndarray:
    """Return the stiffness (6, 6) about a plane that lies higher by `height` [m]."""
    # The old plane is strained by e - k height.
    shift = np.eye(6) - height * np.eye(6, k=3)
    return shift.T @ stiffness @ shift


class StraightYarn:
    """A straight yarn along one of the lattice's vectors, from a point on, that meets its image."""

    def __init__(self, lattice, number, point, spans=12, degree=3):
        period = lattice.vectors[number]
        length = np.linalg.norm(period)
        self.space = yarn_space(np.linspace(0, length, spans + 1), degree)
        self.seam = seam(self.space)
        s = (np.arange(PLACES * spans) + 0.5) * length / (PLACES * spans)
        along = period / length
        up = np.array([0.0, 0, 1])
        first = self.seam.order == 0
        at = self.space.first_node[:-1]
        values, over = (
            (self.space.spline.matrix(s) @ each[at][:, first]).toarray()
            for each in (self.seam.wrapped, self.seam.beyond)
        )
        goal = point + np.multiply.outer(s, along) - np.multiply.outer(over.sum(axis=1), period)
        self.start = np.zeros((len(self.seam.order), 3))
        places = np.flatnonzero(first)
        self.start[places] = np.linalg.lstsq(values, goal, rcond=None)[0]
        self.start[places + 1] = 0.5 * RADIUS * up
        self.start[places + 2] = 0.5 * RADIUS * np.cross(along, up)
        self.nodes = self.seam.nodes(self.start, period)
        jumps = lattice.jumps(number, self.start, self.seam.unity)
        self.jumps = (self.seam.beyond @ jumps.reshape(len(jumps), -1)).reshape(-1, 6)


class Sheet:
    """Straight yarns of a lattice, with links between places of theirs."""

    def __init__(self, lattice, yarns, links=None):
        self.lattice, self.yarns = lattice, yarns
        space = Space(tuple(yarn.space for yarn in yarns))
        nodes = np.concatenate([yarn.nodes for yarn in yarns])
        every = sp.identity(len(nodes), format="csr")
        groups = span_groups(space, nodes, Hencky(YOUNG, POISSON))
        joined = None if links is None else links(space)
        self.solids = SolidModel(nodes, groups, RADIUS, every, links=joined)
        wrapped = sp.block_diag([yarn.seam.wrapped for yarn in yarns])
        self.spread = sp.csr_matrix(sp.kron(wrapped, sp.identity(3)))
        self.jumps = np.concatenate([yarn.jumps for yarn in yarns])

    def stiffness(self, held):
        """Return the stiffness (6, 6) with some unknowns held, which could move for nothing."""
        tangent = self.solids.respond(self.solids.start(), stiffness=True).stiffness
        return condensed(tangent, self.jumps, self.spread, np.asarray(held)) / self.lattice.area
