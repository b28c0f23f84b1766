"""Contact points: which of them touch, their history, their surfaces, and inputs that are refused."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal
from scipy.spatial import cKDTree
from tubes import crossing, tube

from knitstudy.knit.mesh.section import drawn_angles
from knitstudy.knit.models.spline_yarns.build import undeformed_yarns
from knitstudy.knit.yarns.discretisation import WINDOW, contact_surfaces
from knitstudy.mechanics.contact.candidate_pairs import WIDTH, Neighbourhoods
from knitstudy.mechanics.contact.cylinders import Cylinders
from knitstudy.mechanics.contact.friction import OPEN, SLIP, STICK, ContactHistory, Coulomb
from knitstudy.mechanics.contact.grids import Grid, Grids, circular_chords
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.contact.tangent import Quadrature
from knitstudy.mechanics.solids.spline_yarn.space import Space, yarn_space

APART = ~np.eye(2, dtype=bool)


def contact(nodes, grids, friction=0.3, **options):
    options = {"margin": 0.2, "overlap": 1e-3} | options
    return Contact(nodes, Grids(grids), Coulomb(10.0, 7.0, friction), **options)


@pytest.fixture
def pressed():
    """Contact of two tubes, their nodes before and after the upper one was pressed on, and the mask of its nodes."""
    nodes, grids, upper = crossing(0.02)
    pressed = nodes + np.where(upper[:, None], [0, 0, -0.08], 0)
    return contact(nodes, grids, meets=APART), nodes, pressed, upper


def active(points):
    """Pairs (point, surface) that touch."""
    return set(zip(points.history.point[points.active], points.history.surface[points.active], strict=True))


def test_the_search_misses_nothing(pressed):
    """All points as near to the other tube as the margin are followed."""
    answer, before, _, _ = pressed
    points = answer.points(before, before, ContactHistory.empty())
    followed = set(zip(points.followed.point, points.followed.surface, strict=True))
    everywhere = np.arange(len(answer.quadrature.area))
    position = answer.reference(everywhere)
    side = answer.quadrature.surface(everywhere)
    for number in (0, 1):
        mine = np.flatnonzero(side == number)
        distance, _ = cKDTree(position[side != number]).query(position[mine])
        near = mine[distance < 0.9 * answer.margin]
        assert len(near) > 0
        assert {(point, 1 - number) for point in near} <= followed


class Restless(Grids):
    """Grids of which nothing is known but where they are: every pair is searched for and evaluated each time."""

    def controls(self, carriers):
        return super().controls(carriers) + np.random.default_rng().normal(size=(len(self._skin), 1, 3))


def test_pairs_that_are_left_out_do_not_touch():
    """Tubes that close, slide, turn, open and close again, with trials that are not committed in between."""
    nodes, grids, upper = crossing(0.02)
    options = {"meets": APART, "margin": 0.2, "overlap": 1e-3}
    quick, full = (
        Contact(nodes, kind(grids), Coulomb(10.0, 7.0, 0.3), **options) for kind in (Grids, Restless)
    )
    depth = [0.01, -0.02, -0.05, -0.06, -0.06, -0.055, -0.03, 0.03, 0.1, 0.02, -0.04, -0.05]
    before, histories = nodes, [ContactHistory.empty()] * 2
    evaluated, touched = [], []
    for step, gap in enumerate(depth):
        angle = 0.02 * step
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        there = np.where(upper[:, None], nodes @ turn.T + [0.03 * step, 0.02 * step, gap - 0.02], nodes)
        for share in (1.2, 0.7, 1.01, 1.0):
            now = before + share * (there - before)
            one, other = (
                each.forces(each.points(now, before, history), stiffness=False)
                for each, history in zip((quick, full), histories, strict=True)
            )
            np.testing.assert_array_equal(one.points.signature(), other.points.signature())
            np.testing.assert_allclose(one.node_force, other.node_force, atol=1e-10)
            gaps = quick.smallest_gap(one.points), full.smallest_gap(other.points)
            assert gaps[0] == pytest.approx(gaps[1], abs=1e-12)
            assert one.energy == pytest.approx(other.energy, abs=1e-12)
            evaluated.append(len(one.points.evaluated) / len(other.points.evaluated))
        histories = [each.commit(answer.points) for each, answer in ((quick, one), (full, other))]
        before = there
        touched.append(len(one.points.active))
    assert min(touched) == 0
    assert max(touched) > 20
    assert 0 < np.mean(evaluated) < 0.8


LAW = Coulomb(normal=100.0, tangential=50.0, friction=0.5)


def test_pressure_is_never_negative():
    gap = np.array([0.1, 0.0, -0.1, 0.01])
    multiplier = np.array([0.0, 0.0, 0.0, -3.0])
    np.testing.assert_allclose(LAW.pressure(gap, multiplier), [0, 0, 10, 2])


def test_traction_is_the_trial_or_the_limit():
    trial = np.array([[3.0, 0, 0], [0, 6.0, 8.0], [1.0, 0, 0], [0, 0, 0]])
    pressure = np.array([10.0, 10.0, 0.0, 2.0])
    traction, status = LAW.traction(trial, pressure)
    np.testing.assert_allclose(traction, [[3, 0, 0], [0, 3, 4], [0, 0, 0], [0, 0, 0]])
    np.testing.assert_array_equal(status, [STICK, SLIP, OPEN, STICK])
    np.testing.assert_allclose(LAW.slipped(trial, pressure), [0, 0.1, 0, 0])


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_gauss_points_stand_for_the_area_of_the_contact_surface(offset):
    nodes, grid = tube(angles=24)
    quadrature = Quadrature.on(Grids([Grid(grid.nodes, offset=offset)]), nodes, points=3)
    assert len(quadrature.area) == 12 * 24 * 9
    assert quadrature.area.sum() == pytest.approx(2 * np.pi * (1 - offset) * 6, rel=2e-3)
    _, xi = quadrature.places(np.arange(len(quadrature.area)))
    np.testing.assert_array_equal(quadrature.row_and_column(np.arange(len(xi)) // 9)[1], np.floor(xi))


@pytest.mark.parametrize("refinement", [1.5, 3.0])
def test_graded_angles_keep_the_radius(refinement):
    """Tangents touch the circle where steps differ: the error falls with the fourth power of the step."""
    errors = []
    for count in (24, 48):
        pull = np.array([[(refinement - 1) / (refinement + 1), 0.0]])
        angles = drawn_angles(2 * np.pi * (np.arange(count) + 0.5) / count, np.repeat(pull, 4, axis=0))
        s = np.repeat(np.arange(4.0), count)
        nodes = np.stack([np.cos(angles).ravel(), np.sin(angles).ravel(), -s], axis=-1)
        grid = Grid(np.arange(4 * count).reshape(4, count), chords=circular_chords(angles))
        xi = np.random.default_rng(1).uniform([0, 0], [3, count], (2000, 2))
        place = Grids([grid]).stencil(np.zeros(len(xi), int), xi).places(nodes)[0]
        errors.append(np.abs(np.hypot(place[:, 0], place[:, 1]) - 1).max())
    assert errors[1] < 3e-3
    assert np.log2(errors[0] / errors[1]) > 3.5


RADIUS, LENGTH, ANGLES = 0.5, 3.0, 12
BREAKS = np.array([0.0, 0.8, 1.2, 1.5, 2.1, LENGTH])
CELLS = [0.0, 0.6, 1.2, 1.4, 1.6, 1.8, 2.4, LENGTH]


def straight(space, middle, along, up):
    """Nodes of a straight yarn of that space."""
    spline = space.spline
    s = np.linspace(0, LENGTH, 60)
    centre = spline.fit(s, middle + (s - 0.5 * LENGTH)[:, None] * along)
    turned = [np.tile(d, (spline.size, 1)) for d in (up, np.cross(along, up))]
    return space.coefficients(centre, *turned, RADIUS)


@pytest.fixture(scope="module")
def crossed():
    """Two yarns that cross, with spans and degrees of all kinds: space, nodes and surfaces."""
    own = yarn_space(BREAKS, [2, 3, 4, 3, 2])
    space = Space((own, own))
    x, y, z = np.eye(3)
    nodes = np.concatenate(
        [straight(own, -(RADIUS + 0.005) * z, x, z), straight(own, (RADIUS + 0.005) * z, y, z)]
    )
    return space, nodes, Cylinders(space, RADIUS, [np.array(CELLS)] * 2, ANGLES)


def test_no_place_moves_farther_than_is_said(crossed):
    """In the box of a place's ring, for all places that share its neighbourhood."""
    _, nodes, surfaces = crossed
    generator = np.random.default_rng(5)
    before = surfaces.carry(nodes)
    near = Neighbourhoods(surfaces, before, RADIUS)
    xi = generator.uniform(0, [surfaces.edges(0)[0][-1], ANGLES], size=(4000, 2))
    surface = generator.integers(0, 2, len(xi))
    one, other = np.flatnonzero(surface == 0)[:500], np.flatnonzero(surface == 1)[:500]
    ring = np.searchsorted(surfaces.edges(0)[0], xi[one, 0], side="right") - 1
    smallest = []
    for size in np.linspace(0.002, 0.1, 20):
        change = surfaces.carry(size * RADIUS * generator.standard_normal(nodes.shape))
        # The larger part is of long waves, as in a fabric that shears.
        change += 0.3 * np.sin(before[:, [1, 2, 0]] / (6 * RADIUS)) * RADIUS
        motion = near.motion(before + change, before)
        here, there = (surfaces.places(surface, xi, state)[0] for state in (before, before + change))
        then, now = (np.linalg.norm(p[one, None] - p[None, other], axis=2) for p in (here, there))
        shares = then < (WIDTH - 2) * RADIUS
        bound = motion.least(then, near.of_ring[ring][:, None])
        assert np.all(now[shares] >= bound[shares])
        smallest.append((now - bound)[shares].min())
    assert shares.any()
    assert min(smallest) < 0.5 * RADIUS


@pytest.fixture(scope="module")
def scene(plain_scene):
    keys = {"fidelity": "spline_yarns", "interaction": "isotropic", "contact.tied_edges": "none"}
    return plain_scene.vary(keys | {"pattern.loops": 1, "pattern.rows": 1})


@pytest.fixture(scope="module")
def knit(scene, knit_of):
    return knit_of(scene)


def test_crossings_nearer_than_their_windows_are_refused(scene, knit):
    space = undeformed_yarns(scene, knit)[0]
    contact_surfaces(space, knit, scene.contact.cell, WINDOW)
    thick = replace(knit, radius=2 * knit.radius)
    space = undeformed_yarns(scene, thick)[0]
    contact_surfaces(space, thick, scene.contact.cell, WINDOW)
    with refusal(r"two crossings of a yarn are .* yarn radii apart: .* up to 4\.00 radii .* thinner yarn"):
        contact_surfaces(space, thick, scene.contact.cell, 4.0)
