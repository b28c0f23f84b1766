"""Local kinematics of crossings from motions that are known."""

import numpy as np
import pytest

from knitstudy.knit.contacts.kinematics import (
    CrossingAxes,
    kinematics,
    place_on_yarn,
    section_motion,
    segment_contraction,
    twist,
)
from knitstudy.knit.geometry.columns import CONTACTS
from knitstudy.knit.geometry.specimens import yarn_pair
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.mechanics.core.rotation import exp

RADIUS = 0.9e-3
X, Y, Z = np.eye(3)


@pytest.fixture
def pair():
    """Yarns along x, below, and along y, above."""
    return yarn_pair(RADIUS, 90.0, 10e-3, 0.01)


def of_pair(pair, lower, upper, relative=(0, 0, 0), contact=None):
    """Return the kinematics of a pair at the last of two increments, when its sections have deformed."""
    gradient = np.stack([np.eye(3), np.eye(3), lower, upper]).reshape(2, 1, 2, 3, 3)
    displacement, relative = np.zeros((2, 1, 2, 3)), np.stack([0 * X, relative])[:, None]
    contact = np.full((2, 1, 2, 3), np.nan) if contact is None else contact
    actual = kinematics(pair, gradient, displacement, relative, contact)
    CONTACTS.require(actual)
    return {name: values[-1, 0] for name, values in actual.items()}


def test_axes_stand_on_the_yarns_and_point_to_each_other(pair, knit):
    axes = CrossingAxes.of(pair)
    np.testing.assert_allclose(axes.tangent[0], [X, Y], atol=1e-12)
    np.testing.assert_allclose(axes.towards[0], [Z, -Z], atol=1e-12)
    axes = CrossingAxes.of(knit)
    np.testing.assert_allclose(np.linalg.norm(axes.across, axis=-1), 1.0, rtol=1e-7)


def test_spin_and_tilt_of_rotations_by_hand(pair):
    """The lower yarn spins by 0.2 and then tilts by 0.5; the upper one only tilts, about x."""
    turned = of_pair(pair, exp(0.5 * Y) @ exp(0.2 * X), exp(-0.3 * X))
    np.testing.assert_allclose(turned["spin"], [0.2, 0.0], atol=1e-14)
    np.testing.assert_allclose(turned["tilt"], [0.5, 0.3], rtol=1e-12)
    np.testing.assert_allclose(turned["section_rotation"][1], -0.3 * X, atol=1e-14)
    for name in ("axial_stretch", "normal_stretch", "across_stretch"):
        np.testing.assert_allclose(turned[name], 1.0, rtol=1e-14)
    np.testing.assert_allclose(turned["section_contraction"], 0.0, atol=1e-14)


def test_stretches_of_turned_sections_by_hand(pair):
    """Stretches along x, y and z; z is the normal of both yarns, along and across change places."""
    stretch = np.diag([1.02, 0.99, 0.96])
    actual = of_pair(pair, exp([0.1, 0.2, 0.3]) @ stretch, stretch)
    np.testing.assert_allclose(actual["axial_stretch"], [1.02, 0.99], rtol=1e-12)
    np.testing.assert_allclose(actual["across_stretch"], [0.99, 1.02], rtol=1e-12)
    np.testing.assert_allclose(actual["normal_stretch"], [0.96, 0.96], rtol=1e-12)
    np.testing.assert_allclose(actual["section_contraction"], [1 - 0.99 * 0.96, 1 - 1.02 * 0.96], rtol=1e-9)
    np.testing.assert_allclose(actual["section_rotation"], [[0.1, 0.2, 0.3], [0, 0, 0]], atol=1e-13)


@pytest.mark.parametrize("angle", [-3.1, -1e-9, 0.0, 0.7, 3.1])
def test_twist_undoes_swing_and_twist(angle):
    rng = np.random.default_rng(0)
    axis = rng.normal(size=(6, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    square_to_axis = np.cross(axis, rng.normal(size=(6, 3)))
    rotation = exp(square_to_axis) @ exp(angle * axis)
    np.testing.assert_allclose(twist(rotation, axis), angle, rtol=1e-9, atol=1e-14)


def test_segments_contract_by_their_chords(knit):
    """A motion that halves all lengths; and one crossing that alone moves changes its neighbours' chords."""
    crossings = knit.crossings
    halved = segment_contraction(crossings, -0.5 * crossings.point[None])
    inner = np.isfinite(halved)
    np.testing.assert_allclose(halved[inner], 0.5)
    ends = 2 * (knit.cells[1] + 1)
    assert (~inner).sum() == ends, "every yarn has two ends"
    middle = np.argmin(np.abs(crossings.arc_length[:, 0] - 0.5 * knit.centrelines[0].length))
    displacement = np.zeros((1, *crossings.point.shape))
    displacement[0, middle, 0] = [1e-4, 2e-4, 3e-4]
    moved = np.argwhere(np.nan_to_num(segment_contraction(crossings, displacement)[0]))
    assert len(moved) == 4, "two chords, seen from both of their ends"
    assert {tuple(place) for place in moved} >= {(middle, 0, 0), (middle, 0, 1)}


def test_contact_that_moves_around_and_along_a_straight_yarn(pair):
    """From the line of closest points by 0.1 about the lower yarn's tangent, and by 0.3 mm along it."""
    angle = np.array([0.0, 0.1])
    contact = np.zeros((2, 1, 2, 3))
    contact[:, 0] = pair.crossings.point[0]
    contact[:, 0, 0] += RADIUS * (np.cos(angle)[:, None] * Z - np.sin(angle)[:, None] * Y)
    contact[:, 0, 0, 0] += [0.0, 3e-4]
    contact[:, 0, 1, 2] -= RADIUS
    actual = of_pair(pair, np.eye(3), np.eye(3), contact=contact)
    np.testing.assert_allclose(actual["contact_spin"], [0.1, 0.0], atol=1e-12)
    np.testing.assert_allclose(actual["contact_travel"], [3e-4, 0.0], atol=1e-15)


def test_sliding_is_along_the_yarns_as_they_lie_now(pair):
    """The upper yarn slides by 3 along x and 4 along y, and has turned from y to x by 30 degrees."""
    turned = exp(-np.pi / 6 * Z)
    actual = of_pair(pair, np.eye(3), turned, relative=[3e-4, 4e-4, 0], contact=np.zeros((2, 1, 2, 3)))
    np.testing.assert_allclose(actual["sliding"], [3e-4, 1.5e-4 + 4e-4 * np.sqrt(0.75)], rtol=1e-12)


def test_places_on_a_curved_yarn_are_found_again(knit):
    """Points laid out by arc length and angle in frames carried along the curve."""
    crossings, axes = knit.crossings, CrossingAxes.of(knit)
    shift, angle = 2e-4, 0.3
    place = np.full((1, *crossings.point.shape), np.nan)
    for yarn, curve in enumerate(knit.centrelines):
        k, side = np.nonzero(crossings.yarn == yarn)
        s = crossings.arc_length[k, side] + shift
        arm = np.cos(angle) * axes.towards[k, side] + np.sin(angle) * axes.across[k, side]
        old, new = axes.tangent[k, side], curve.tangent(s)
        normal = np.cross(old, new)
        sine = np.linalg.norm(normal, axis=1)
        turn = exp((np.arcsin(sine) / sine)[:, None] * normal)
        place[0, k, side] = curve.position(s) + RADIUS * np.einsum("kij,kj->ki", turn, arm)
    along, around = place_on_yarn(knit, axes, place)
    np.testing.assert_allclose(along, shift, atol=1e-9)
    np.testing.assert_allclose(around, angle, atol=1e-6)


SIZE = 0.5


@pytest.fixture(scope="module")
def knitted(plain_scene, knit_of):
    """Crossings and mesh of a knit of two rows."""
    knit = knit_of(plain_scene.replace("pattern.loops", 1).replace("pattern.rows", 2))
    return knit.crossings, mesh_fabric(knit, SIZE)


@pytest.mark.parametrize(
    "gradient",
    [exp([0.4, -1.1, 0.3]), np.eye(3) + 0.1 * np.random.default_rng(0).normal(size=(3, 3))],
    ids=["rotation", "deformation"],
)
def test_affine_motions_are_exact(knitted, gradient):
    crossings, mesh = knitted
    shift = np.array([1e-3, -2e-3, 5e-4])
    motion = section_motion(crossings, mesh, mesh.nodes, mesh.nodes @ (gradient - np.eye(3)).T + shift)
    count = len(crossings.row)
    np.testing.assert_allclose(motion.gradient, np.tile(gradient, (count, 2, 1, 1)), atol=1e-12)
    expected = crossings.point @ (gradient - np.eye(3)).T + shift
    np.testing.assert_allclose(motion.displacement, expected, atol=1e-15)
