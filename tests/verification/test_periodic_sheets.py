"""Shell stiffness of sheets of straight yarns: closed forms of beam theory."""

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.cells.lattice import Lattice
from knitstudy.mechanics.cells.solids import condensed, seam
from knitstudy.mechanics.contact.solid import SolidModel
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.solids.spline_yarn.space import Space, yarn_space
from knitstudy.mechanics.solids.spline_yarn.span import span_groups

RADIUS, YOUNG, POISSON = 0.9, 1300.0, 0.3
SHEAR = YOUNG / (2 * (1 + POISSON))
AREA, INERTIA = np.pi * RADIUS**2, np.pi * RADIUS**4 / 4
TORSION = 2 * INERTIA
PLACES = 8


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


FIRST, SECOND = 30.0, 24.0  # edges of the cell

HEIGHT = 0.4

TRANSLATIONS = [0, 1, 2]

# A straight yarn turns about its axis for nothing: where the director points up, what lies across is held.
SPIN = [3 * 1 + 1]


def parallel(reference=0.0):
    lattice = Lattice(np.array([[FIRST, 0, 0], [0, SECOND, 0]]), reference)
    return Sheet(lattice, [StraightYarn(lattice, 0, np.array([0, 0, HEIGHT]))])


def test_yarns_side_by_side_are_rods():
    actual = parallel().stiffness(TRANSLATIONS + SPIN)
    expected = np.zeros((6, 6))
    expected[0, 0] = YOUNG * AREA / SECOND
    expected[0, 3] = expected[3, 0] = HEIGHT * expected[0, 0]
    expected[3, 3] = YOUNG * INERTIA / SECOND + HEIGHT**2 * expected[0, 0]
    expected[5, 5] = SHEAR * TORSION / (4 * SECOND)  # k_xy is twice the twist
    scale = np.sqrt(np.outer(*2 * [np.diag(expected) + expected[0, 0] * np.array([0, 1, 1, 0, 1, 0])]))
    # Tension, bending and torsion of a straight round rod lie in the space: what is left is rounding.
    assert np.abs(actual - expected).max() <= 1e-9 * scale.max()
    np.testing.assert_allclose(np.diag(actual), np.diag(expected), rtol=1e-9, atol=1e-9 * YOUNG)


def crossing(space):
    """Springs that join both yarns where they meet, at places of a small cross: forces and moments, nearly rigid."""
    reach = 0.35 * RADIUS
    lengths = [own.spline.knots[-1] for own in space.yarns]
    spots = [(0, 0, 0), *(np.eye(3) * reach), *(-np.eye(3) * reach)]
    rows = []
    # Directors are z, and -y of the yarn along x, x of the yarn along y.
    for x, y, z in spots:
        at = [
            space.matrix(np.array([0]), np.array([[z, -y]]) / RADIUS, np.array([lengths[0] / 2 + x])),
            space.matrix(np.array([1]), np.array([[z, x]]) / RADIUS, np.array([lengths[1] / 2 + y])),
        ]
        rows.append(at[0] - at[1])
    joined = sp.vstack(rows)
    return sp.csr_matrix(1e3 * YOUNG * RADIUS * (joined.T @ joined))


def grid(first, second, spans):
    """Stiffness of a grid of joined yarns, over that of beams."""
    lattice = Lattice(np.array([[first, 0, 0], [0, second, 0]]))
    begin = np.array([[0, second / 2, 0], [first / 2, 0, 0]])  # through the middle of the cell
    yarns = [StraightYarn(lattice, number, begin[number], spans) for number in range(2)]
    actual = Sheet(lattice, yarns, crossing).stiffness(TRANSLATIONS)
    shear_area = 6 * (1 + POISSON) / (7 + 6 * POISSON) * SHEAR * AREA  # Cowper 1966, a round section
    # Each beam is bent to and fro between joints that turn; its deflection by shear comes on top.
    sway = first * second * (first + second) / (12 * YOUNG * INERTIA) + (first + second) / shear_area
    beams = [
        YOUNG * AREA / second,
        YOUNG * AREA / first,
        1 / sway,
        YOUNG * INERTIA / second,
        YOUNG * INERTIA / first,
        SHEAR * TORSION / 4 * (1 / first + 1 / second),
    ]
    return actual, actual / np.sqrt(np.outer(beams, beams))


def test_a_grid_of_joined_yarns_is_one_of_beams():
    actual, ratio = grid(40 * RADIUS, 30 * RADIUS, 40)
    # Joined over a third of a radius, yarns are stiffer there in tension and bending, and yield to the moment of shear:
    # a share of a radius in 30 to 40 between two joints.
    np.testing.assert_allclose(np.diag(ratio), 1, atol=0.03)
    np.testing.assert_allclose(np.diag(ratio)[[0, 1, 3, 4, 5]], 1, atol=0.01)
    assert np.abs(ratio - np.diag(np.diag(ratio))).max() < 0.01
    np.testing.assert_array_equal(actual, actual.T)
    assert np.linalg.eigvalsh(ratio).min() > 0.95
    # Twice as far apart, what is left of beam theory is half as much.
    _, longer = grid(80 * RADIUS, 60 * RADIUS, 80)
    left, right = (np.abs(np.diag(each) - 1)[:5] for each in (ratio, longer))
    np.testing.assert_allclose(right / left, 0.5, atol=0.1)
