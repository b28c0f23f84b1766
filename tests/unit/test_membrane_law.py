"""Laws of a membrane: derivatives, uniaxial tension, and laws that are found again from their states."""

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

from knitstudy.errors import DataFileError
from knitstudy.mechanics.membrane import ExponentialLaw, forces_per_width, green
from knitstudy.use.membrane_fit import States, fit_exponentials, law_of, membrane

FORM = np.array([[3.0, 1.0, 0.2], [1.0, 5.0, 0.1], [0.2, 0.1, 0.8]])
COUPLED = ExponentialLaw(FORM, np.array([0.5, 0.2]), np.array([[4.0, -2.0, 0.5], [-1.0, 3.0, 2.0]]))
ORTHOTROPIC = ExponentialLaw(np.diag([20.0, 60.0, 9.0]), np.array([3.0]), np.array([[6.0, 4.0, 0.0]]))
LAWS = [COUPLED, ORTHOTROPIC]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_stress_and_tangent_are_derivatives(law):
    strain = 0.2 * np.random.default_rng(0).normal(size=(4, 5, 3))
    strain[..., :2] += 0.3
    step = 1e-5  # cubic terms leave 1e-9, rounding 1e-10
    by_differences = [
        np.stack([(of(strain + h) - of(strain - h)) / (2 * step) for h in step * np.eye(3)], axis=-1)
        for of in (law.energy, law.stress)
    ]
    np.testing.assert_allclose(law.stress(strain), by_differences[0], atol=1e-7)
    np.testing.assert_allclose(law.tangent(strain), by_differences[1], atol=1e-6)
    np.testing.assert_allclose(law.stress(np.zeros(3)), 0, atol=1e-14)


def test_residuals_are_over_the_force_and_a_share_of_the_largest_on_the_path():
    force = np.array([[0.0, 3.0, 4.0], [0.0, 0.0, 100.0], [200.0, 0.0, 0.0]])
    states = States(np.zeros((3, 3)), force, np.array(["soft", "soft", "stiff"], dtype=object))
    np.testing.assert_allclose(states.scale, [10.0, 105.0, 210.0])


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_forces_per_width_do_the_work_of_stretches(law):
    stretch, step = 0.1 * np.random.default_rng(1).normal(size=(6, 3)), 1e-6
    energies = [
        (law.energy(green(stretch + h)[0]) - law.energy(green(stretch - h)[0])) / (2 * step)
        for h in step * np.eye(3)
    ]
    np.testing.assert_allclose(forces_per_width(law, stretch), np.stack(energies, axis=-1), atol=1e-8)


def test_uniaxial_tension_of_one_ridge_beside_a_diagonal_form():
    """Of S = A E + w (exp(a . E) - 1) a free across, both stresses hang on one unknown x = exp(a . E) - 1."""
    stretch = 1.3
    strain = (stretch**2 - 1) / 2
    (first, second), weight, (along, across) = [20.0, 60.0], 3.0, [6.0, 4.0]
    factor = brentq(lambda x: np.log1p(x) - along * strain + across * weight * x * across / second, 0, 1e3)
    expected = stretch * (first * strain + weight * factor * along)
    lateral = -weight * factor * across / second
    actual = forces_per_width(ORTHOTROPIC, np.array([stretch - 1, np.sqrt(1 + 2 * lateral) - 1, 0.0]))
    np.testing.assert_allclose(actual, [expected, 0, 0], atol=1e-10)


def cells(law, largest=0.2, count=12):
    """Histories of cells of a law, with other strains held."""
    part = np.linspace(0, 1, count)
    ways = {
        "course": (1, 0, 0),
        "wale": (0, 1, 0),
        "both": (1, 1, 0),
        "shear": (0.5, 0.2, 1),
        "back": (0.5, 0.2, -1),
    }
    return {
        name: xr.Dataset(
            {
                "cell_strain": (("increment", "plane"), (stretch := largest * np.outer(part, way))),
                "force_per_width": (("increment", "plane"), forces_per_width(law, stretch)),
            }
        )
        for name, way in ways.items()
    }


@pytest.mark.parametrize(("law", "mirrored"), [(ORTHOTROPIC, True), (COUPLED, False)])
def test_fit_comes_near_a_law_that_is_not_in_its_dictionary(law, mirrored):
    states = States.of(cells(law))
    fit = fit_exponentials(states, mirrored)
    assert fit.error < 0.012, "the wanted error, or nearly the least"
    assert np.all(fit.law.weight > 0)
    assert np.linalg.eigvalsh(fit.law.form).min() >= -1e-9
    # Away from the states: between them.
    between = 0.2 * np.array([[0.4, 0.7, 0.2], [0.8, 0.3, 0.5]])
    actual, expected = (forces_per_width(each, between) for each in (fit.law, law))
    assert np.linalg.norm(actual - expected) < 0.05 * np.linalg.norm(expected)


def test_intervals_hold_the_form_of_a_quadratic_law():
    form = np.array([[20.0, 8.0, 0], [8.0, 60.0, 0], [0, 0, 9.0]])
    states = States.of(cells(ExponentialLaw(form, np.empty(0), np.empty((0, 3)))))
    noise = 0.01 * np.random.default_rng(2).normal(size=states.force.shape) * states.scale[:, None]
    fit = fit_exponentials(States(states.stretch, states.force + noise, states.path), sizes=(0.0,))
    off = np.abs(fit.value - form[np.tril_indices(3)])
    assert fit.error == pytest.approx(0.01 * 3**0.5, rel=0.2)
    assert np.all(off <= 2 * fit.half)
    assert np.all(fit.half[[0, 2, 5]] < 0.05 * np.diag(form))


def test_a_law_comes_back_from_its_dataset():
    fitted = membrane(cells(ORTHOTROPIC))
    again, strain = law_of(fitted), np.array([0.1, 0.05, 0.02])
    np.testing.assert_allclose(again.stress(strain), ORTHOTROPIC.stress(strain), atol=0.2)  # of 24
    assert fitted.attrs["error"] < 0.012 < fitted.attrs["linear_error"]
    assert set(fitted["path"].values) == set(cells(ORTHOTROPIC))


def test_states_that_do_not_say_a_stiffness_are_refused():
    few = {name: cell for name, cell in cells(ORTHOTROPIC).items() if name in ("course", "wale")}
    with pytest.raises(DataFileError, match="no state is strained in shear"):
        States.of(few)
