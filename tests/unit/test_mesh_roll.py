import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing, place_slices
from knitstudy.mesh.sweep import Targets, roll_towards, sweep

ANGLES = Section.butterfly(4, 1).angles
STEP = 2 * np.pi / ANGLES.size


def straight(count=61, length=12.0):
    """Arc lengths, centres and frames of a straight yarn along z, d1 along x."""
    s = np.linspace(0.0, length, count)
    centres = np.stack([0 * s, 0 * s, s], axis=-1)
    return s, centres, np.broadcast_to(np.eye(3), (count, 3, 3))


def targets_at(arc_length, bearing):
    """Targets in given directions (rad) from the straight yarn."""
    point = np.stack([np.cos(bearing), np.sin(bearing), arc_length], axis=-1)
    return Targets(np.asarray(arc_length), point)


def steps_of(roll_at_targets):
    """Roll over the facet step of targets whose bearings are given in steps beyond a facet's middle."""
    where = np.array([3.1, 6.1, 9.1])
    bearing = ANGLES[0] + STEP * (0.5 + np.asarray(roll_at_targets))
    s, centres, frames = straight()
    return s, roll_towards(targets_at(where, bearing), s, centres, frames, ANGLES) / STEP


def test_roll_is_the_smallest_that_brings_facets_under_the_targets():
    s, roll = steps_of([0.3, 5.1, -3.4])
    at = np.interp([3.1, 6.1, 9.1], s, roll)
    np.testing.assert_allclose(at, [0.3, 0.1, -0.4], atol=1e-12)


def test_roll_follows_the_target_before_where_that_twists_less():
    s, roll = steps_of([0.4, -0.3, 0.0])
    np.testing.assert_allclose(np.interp([3.1, 6.1, 9.1], s, roll), [0.4, 0.7, 1.0], atol=1e-12)


def test_centred_arc_lengths_lie_in_the_middle_of_layers():
    spacing = Spacing(0.1, growth=2.0, stations=(2.03, 8.01), period=10.0, reach=0.5, ramp=1.0)
    s = place_slices(20.0, spacing, periods=2, centred=[2.03, 8.01, 12.03, 18.01])
    below = np.searchsorted(s, [2.03, 8.01, 12.03, 18.01]) - 1
    np.testing.assert_allclose(0.5 * (s[below] + s[below + 1]), [2.03, 8.01, 12.03, 18.01], rtol=1e-13)
    np.testing.assert_allclose(s[below + 1] - s[below], 0.1, rtol=1e-12)
    assert s[[0, -1]].tolist() == [0.0, 20.0]
    assert np.abs(s - 10.0).min() == 0.0
    ratio = np.diff(s) / spacing(0.5 * (s[1:] + s[:-1]))
    # The shortest part, 1.93 m beside a period's end, has some 14 elements: half of one to share out.
    assert np.abs(ratio - 1).max() < 0.5 / 13


def test_slices_stand_where_grips_end():
    s = place_slices(20.0, Spacing(0.3), periods=2, centred=[4.0], ends=[0.0, 1.23, 10.0, 17.7, 20.0])
    for end in (0.0, 1.23, 10.0, 17.7, 20.0):
        assert np.abs(s - end).min() == 0.0
    assert np.diff(s).min() > 0.5 * 0.3, "an end of a period that is one of a grip counts once"
    assert np.abs(0.5 * (s[1:] + s[:-1]) - 4.0).min() < 1e-12


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: place_slices(9.0, Spacing(1.0), centred=[4.0], ends=[4.2]), "-0.3 m between s = 4.5 m and"),
        (lambda: place_slices(9.0, Spacing(1.0), centred=[0.7, 4.5]), "between s = 0 m and s = 0.2 m"),
        (lambda: place_slices(9.0, Spacing(1.0), centred=[5.0, 4.0]), "must increase"),
        (
            lambda: sweep([None], Section.butterfly(3, 1), 0.9, Spacing(0.5), targets=[]),
            "0 targets for 1 centrelines",
        ),
    ],
)
def test_targets_without_room_are_refused(call, message):
    with pytest.raises(MeshError, match=message):
        call()
