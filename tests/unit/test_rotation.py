"""Maps of finite rotations against their definitions, at small and large angles."""

import numpy as np
import pytest

from knitstudy.mechanics.rotation import Halfway, exp, log

ANGLES = [0.0, 1e-9, 1e-4, 0.3, 1.0, 2.5, 3.1]


def rotation_vectors(angle, count=5):
    axes = np.random.default_rng(1).normal(size=(count, 3))
    return angle * axes / np.linalg.norm(axes, axis=1, keepdims=True)


@pytest.mark.parametrize("angle", ANGLES)
def test_exp_gives_rotations_that_log_takes_back(angle):
    v = rotation_vectors(angle)
    R = exp(v)
    np.testing.assert_allclose(R @ np.swapaxes(R, 1, 2), np.tile(np.eye(3), (len(v), 1, 1)), atol=1e-14)
    # Rounding in R of 1e-16 turns into 1e-16 of the angle, amplified by 1/(pi - angle) near pi.
    np.testing.assert_allclose(log(R), v, atol=1e-13)


@pytest.mark.parametrize("angle", [0.1, 1.0, 2.5, np.pi])
def test_scalars_equal_their_closed_forms(angle):
    h = Halfway.of(rotation_vectors(angle, 1))
    a = (angle / 2) / np.sin(angle / 2)
    assert h.a[0] == pytest.approx(a, rel=1e-14)
    assert h.b[0] == pytest.approx(np.tan(angle / 4) / (2 * angle), rel=1e-14)
    assert h.g[0] == pytest.approx((1 - a) / angle**2, rel=1e-12)  # the closed form cancels
