"""Contact points: which of them touch, their history, and inputs that are refused."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from tubes import crossing, hairpin

from knitstudy.mechanics.contact.friction import OPEN, SLIP, STICK, ContactHistory, Coulomb
from knitstudy.mechanics.contact.grids import Grids
from knitstudy.mechanics.contact.interaction import Contact

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


def test_motion_counts_between_yarns_that_are_near_each_other(pressed):
    answer, before, after, upper = pressed
    assert answer.motion(before, 3.0 + before) == pytest.approx(0, abs=1e-12)
    assert answer.motion(before, after) == pytest.approx(0.08)
    far = before + np.where(upper[:, None], [0, 0, 9.0], 0)
    assert answer.motion(far, far + np.where(upper[:, None], [0, 0, 5.0], 0)) == pytest.approx(0, abs=1e-12)


def test_surfaces_that_nearly_touch_are_pulled_together():
    """Pressures close the gaps of the pairs that are nearly as near as the nearest ones, and no other pair touches."""
    nodes, grids, upper = crossing(0.01)
    answer = contact(nodes, grids, meets=APART, margin=0.3)
    assert not len(answer.points(nodes, nodes, ContactHistory.empty()).active)
    points = answer.points(nodes, nodes, ContactHistory.empty(), pulled=True)
    nearest = points.evaluated_gap.min()
    assert 0 < nearest < 0.015
    near = points.evaluated_gap < nearest + 0.003
    assert near.any()
    np.testing.assert_array_equal(points.number, points.evaluated[near])
    assert np.all(points.status == STICK)
    np.testing.assert_allclose(points.pressure, -10.0 * points.gap)
    pull = answer.forces(points, stiffness=False).node_force
    assert pull[upper, 2].sum() > 0 > pull[~upper, 2].sum()  # internal forces: what moves the upper tube down


def test_places_that_were_far_apart_touch_within_one_increment():
    nodes, grids, upper = crossing(3.0)
    answer = contact(nodes, grids, meets=APART)
    assert not len(answer.points(nodes, nodes, ContactHistory.empty()).evaluated)
    moved = nodes + np.where(upper[:, None], [0.5, 0.3, -3.06], 0)
    points = answer.points(moved, nodes, ContactHistory.empty())
    assert len(points.active) > 10
    assert points.gap.min() == pytest.approx(-0.06, abs=5e-3)
    # Of the way of 3 m, all but the last 0.06 was in the air.
    assert points.slip_share[points.active].max() < 0.03


def test_a_yarn_touches_itself():
    nodes, grid = hairpin(4.0)
    answer = contact(nodes, [grid])
    assert not len(answer.points(nodes, nodes, ContactHistory.empty()).active)
    # The legs turn towards each other about the bend.
    share = np.clip(-nodes[:, 0] / 8, 0, 1)
    moved = nodes + (np.where(nodes[:, 1] > 2, -1.05, 1.05) * share)[:, None] * [0, 1.0, 0]
    points = answer.points(moved, nodes, ContactHistory.empty())
    assert len(points.active) > 0
    row = answer.quadrature.places(points.history.point[points.active])[1][:, 0]
    assert np.all(np.abs(row - points.projection.xi[points.active, 0]) > 10)


def test_slip_adds_up_and_is_forgotten_when_a_point_opens(pressed):
    answer, before, nodes, upper = pressed
    history, slid = answer.commit(answer.points(nodes, before, ContactHistory.empty())), nodes
    for _ in range(2):
        last, slid = slid, slid + np.where(upper[:, None], [0.05, 0, 0], 0)
        points = answer.points(slid, last, history)
        deep = points.pressure > 0.8 * points.pressure.max()
        assert set(points.status[deep]) == {SLIP}
        history = answer.commit(points)
    # All of the way but the elastic part.
    np.testing.assert_allclose(
        history.slip[points.number[deep]], 0.1 - 0.3 * points.pressure[deep] / 7, atol=5e-3
    )
    assert history.dissipated > 0
    lifted = slid + np.where(upper[:, None], [0, 0, 0.1], 0)
    points = answer.points(lifted, slid, history)
    assert np.all(points.status == OPEN)
    after = answer.commit(points)
    assert not after.slip.any()
    assert after.dissipated == history.dissipated


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
