import numpy as np
import pytest

from knitstudy.mechanics.contact.friction import OPEN, SLIP, STICK, Coulomb

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


@pytest.mark.parametrize(("friction", "expected"), [(np.inf, STICK), (0.0, SLIP)])
def test_rough_never_slips_and_frictionless_never_sticks(friction, expected):
    law = Coulomb(100.0, 50.0, friction)
    trial = np.array([[1e9, 0, 0], [1e-9, 0, 0], [0, 0, 0]])
    traction, status = law.traction(trial, np.full(3, 1e-3))
    assert set(status) == {expected}
    np.testing.assert_array_equal(traction, trial if friction else 0 * trial)
    assert np.all(law.slipped(trial, np.full(3, 1e-3)) == 0) or friction == 0


def test_symmetric_stiffness_is_positive():
    rng = np.random.default_rng(0)
    normal = rng.normal(size=(20, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    trial = np.cross(normal, rng.normal(size=(20, 3))) * 10
    pressure = np.full(20, 10.0)
    _, status = LAW.traction(trial, pressure)
    assert set(status) == {STICK, SLIP}
    stiffness = LAW.symmetric_stiffness(trial, normal, pressure, status)
    np.testing.assert_allclose(stiffness, np.swapaxes(stiffness, 1, 2), atol=1e-12)
    assert np.linalg.eigvalsh(stiffness).min() > -1e-9
