"""How deep yarns pass through each other: by centrelines alone, on images too."""

import numpy as np
import pytest

from knitstudy.errors import ConvergenceError
from knitstudy.knit.loading.gates import require_apart
from knitstudy.knit.loading.history import Recorder, Stations
from knitstudy.knit.loading.overlap import Repeats, largest_overlap

S = np.linspace(0, 20, 41)


def stations(*curves):
    yarn = np.repeat(np.arange(len(curves)), [len(curve) for curve in curves])
    s = np.concatenate([np.append(0, np.cumsum(np.linalg.norm(np.diff(c, axis=0), axis=1))) for c in curves])
    return Stations(yarn, s, np.concatenate(curves))


def overlap(*curves, **repeats):
    at = stations(*curves)
    return largest_overlap(at, at.position, 1.0, **repeats)


def line(y, z=0.0):
    return np.column_stack([S, 0 * S + y, 0 * S + z])


@pytest.mark.parametrize("depth", [0.0, 0.3, 1.7])
@pytest.mark.parametrize("angle", [0, 7, 90])
def test_straight_yarns(depth, angle):
    turn = np.radians(angle)
    across = np.column_stack([10 + (S - 10) * np.cos(turn), (S - 10) * np.sin(turn), 0 * S + 2 - depth])
    # Places lie at most a quarter of the radius apart.
    assert overlap(line(0.0), across) == pytest.approx(depth, abs=0.03)


def test_a_hairpin_overlaps_itself_and_a_bend_does_not():
    turn = np.linspace(0, np.pi, 60)

    def hairpin(bend):
        head = np.column_stack([bend * np.sin(turn), -bend * np.cos(turn), 0 * turn])
        leg = np.column_stack([np.linspace(-10, 0, 60)[:-1], np.full(59, -bend), np.zeros(59)])
        return np.concatenate([leg, head, (leg * [1, -1, 1])[::-1]])

    assert overlap(hairpin(1.05)) == pytest.approx(0.0, abs=1e-3)
    assert overlap(hairpin(0.7)) == pytest.approx(0.6, abs=0.02)


def test_images_overlap_as_yarns_do():
    rows = {"length": np.array([20.0]), "vectors": np.array([[20.0, 0, 0], [0, 1.6, 0]])}
    assert overlap(line(0.0), **rows) == pytest.approx(0.4, abs=0.02)
    # A yarn goes on as its own image along the first vector, and does not overlap there.
    rows["vectors"] = np.array([[20.0, 0, 0], [0, 5.0, 0]])
    assert overlap(line(0.0), **rows) == 0.0
    # Yarns beyond those that repeat themselves are images, which are no other yarns.
    rows["vectors"] = np.array([[20.0, 0, 0], [0, 0.9, 3.0]])
    assert overlap(line(0.0), line(0.0), **rows) == 0.0
    # A yarn and the second image of another one
    rows["length"] = np.array([20.0, 20.0])
    assert overlap(line(0.0), line(4.0, 6.5), **rows) == 0.0
    assert overlap(line(0.0), line(1.8, 6.5), **rows) == pytest.approx(1.5, abs=0.02)


def test_a_lattice_is_stretched_and_sheared():
    repeats = Repeats(np.array([1.0]), np.array([[2.0, 0, 0], [0, 3.0, 0]]))
    np.testing.assert_allclose(
        repeats.stretched(np.array([0.1, -0.2, 0.04])), [[2.2, 0.04, 0], [0.06, 2.4, 0]], atol=1e-12
    )


def test_the_gate_names_the_depth_and_the_key():
    recorder = Recorder.__new__(Recorder)
    recorder.columns = {"largest_overlap": [0.2, 0.61]}
    with pytest.raises(
        ConvergenceError, match=r"increment 3: yarns pass 0.61 radii .*gates.overlap allows 0.5"
    ):
        require_apart(recorder, 3, 0.5)
    recorder.columns["largest_overlap"].append(0.49)
    require_apart(recorder, 4, 0.5)
