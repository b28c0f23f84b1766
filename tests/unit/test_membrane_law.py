"""Laws of a membrane: uniaxial tension, laws found again from states, decks and strips by the commands."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from click.testing import CliRunner
from refusals import refusal
from scipy.optimize import brentq

from knitstudy.files import read_dataset, write_dataset
from knitstudy.mechanics.membrane import ExponentialLaw, forces_per_width
from knitstudy.run.commands.main import main
from knitstudy.run.configuration import load_scene
from knitstudy.run.plan import Plan
from knitstudy.run.store import described
from knitstudy.use.decks.fabric import THICKNESS, solid_entries
from knitstudy.use.fabric_law import States, fit_exponentials, law_of, membrane
from knitstudy.use.measured_curve import read_curve

FORM = np.array([[3.0, 1.0, 0.2], [1.0, 5.0, 0.1], [0.2, 0.1, 0.8]])
COUPLED = ExponentialLaw(FORM, np.array([0.5, 0.2]), np.array([[4.0, -2.0, 0.5], [-1.0, 3.0, 2.0]]))
ORTHOTROPIC = ExponentialLaw(np.diag([20.0, 60.0, 9.0]), np.array([3.0]), np.array([[6.0, 4.0, 0.0]]))


def test_residuals_are_over_the_force_and_a_share_of_the_largest_on_the_path():
    force = np.array([[0.0, 3.0, 4.0], [0.0, 0.0, 100.0], [200.0, 0.0, 0.0]])
    states = States(np.zeros((3, 3)), force, np.array(["soft", "soft", "stiff"], dtype=object))
    np.testing.assert_allclose(states.scale, [10.0, 105.0, 210.0])


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
    with refusal("no state is strained in shear"):
        States.of(few)
    slack = cells(ORTHOTROPIC)["shear"].assign(force_per_width=lambda cell: 0 * cell["force_per_width"])
    with refusal("slack: has no forces; leave it out"):
        States.of(few | {"slack": slack})


def test_the_largest_strain_is_that_of_tension_not_of_contraction():
    stretch = np.array([[0.3, -0.27, 0.0], [-0.045, 0.05, 0.0], [0.1, 0.2, -0.4]])
    force = np.array([[100.0, 0.0, 0.0], [0.0, 50.0, 0.0], [80.0, -1.0, 9.0]])
    np.testing.assert_array_equal(States(stretch, force, np.arange(3)).largest, [0.3, 0.05, 0.4])


def command(*arguments):
    return CliRunner().invoke(main, [str(each) for each in arguments])


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Histories of cells of one fabric, and one of another yarn."""
    folder, scene = tmp_path_factory.mktemp("cells"), load_scene("cell-course")
    for name, history in cells(ORTHOTROPIC).items():
        write_dataset(described(history, Plan({}).step("simulation", scene)), folder / f"{name}.nc")
    other = Plan({}).step("simulation", scene.vary({"yarn.poisson_ratio": 0.1}))
    write_dataset(described(history, other), folder / "other.nc")
    return folder


@pytest.fixture(scope="module")
def law(results):
    names = [results / f"{name}.nc" for name in cells(ORTHOTROPIC)]
    fitted = command("membrane", *names, "-o", results / "law" / "mine.nc")
    assert fitted.exit_code == 0, fitted.output
    return results / "law" / "mine.nc"


def test_a_law_has_coefficients_intervals_and_decks(law):
    table = pd.read_csv(law.with_suffix(".csv"))
    assert (table["95 % from"] <= table["value"]).all()
    fitted = read_dataset(law)
    form = fitted["linear_form"].to_numpy()[[0, 0, 1], [0, 1, 1]]
    for dialect, count in (("abaqus", 23), ("calculix", 22)):
        text = law.with_suffix(f".{dialect}.inp").read_text()
        assert "% off the cell" in " ".join(text.replace("\n** ", " ").split())
        assert "COURSE\n1., 0., 0., 0., 1., 0.\n3, 0.\n*MATERIAL" in text  # local 3 is the normal
        block = text.partition("*MATERIAL, NAME=FABRIC\n")[2].partition("*MEMBRANE SECTION")[0]
        numbers = [float(each) for each in " ".join(block.splitlines()[1:]).replace(",", " ").split()]
        scale = numbers[21] if dialect == "abaqus" else 1.0  # c of Fung's law, whose b is A / c
        np.testing.assert_allclose(THICKNESS * scale * np.array(numbers[:3]), form, rtol=1e-5)
        assert len(numbers) == count


def test_entries_of_a_solid_keep_the_plane_free_of_stress_across():
    form = np.array([[3.0, 1.0, 0.2], [1.0, 5.0, 0.1], [0.2, 0.1, 0.8]])
    solid = np.zeros((6, 6))
    rows, columns = zip(*[(row, column) for column in range(6) for row in range(column + 1)], strict=True)
    solid[rows, columns] = solid_entries(form, across=7.0)
    np.testing.assert_array_equal(solid[np.ix_([0, 1, 3], [0, 1, 3])], np.triu(form))
    assert solid[2, 2] == 7
    assert not solid[[0, 1], 2].any()
    assert not solid[2, 3:].any()


def test_a_strip_needs_less_strain_than_the_endless_fabric(law):
    result = command("strip", law, "--length", 0.02, "--width", 0.03, "--strain", 0.1)
    assert result.exit_code == 0, result.output
    rows = [line.split("\t") for line in result.stdout.splitlines()[1:]]
    assert all(float(clamped) < float(free) for _, clamped, free, _ in rows)
    assert "extrapolated" not in result.stderr
    curve = pd.read_csv(law.with_name("mine-course.csv"))
    assert curve["strain [1]"].iloc[-1] == pytest.approx(0.1)
    read = read_curve(law.with_name("mine-course.csv"), {}, {}, "course")  # as `compare` does
    assert read.iloc[-1] == pytest.approx(curve["force per width [N/m]"].iloc[-1])


def test_histories_of_one_name_in_two_folders_are_two(results, tmp_path):
    files = [tmp_path / name / "cell.nc" for name in ("course", "wale", "shear")]
    for file in files:
        file.parent.mkdir()
        file.write_bytes((results / f"{file.parent.name}.nc").read_bytes())
    assert command("membrane", *files, "-o", tmp_path / "law.nc").exit_code == 0
    assert list(read_dataset(tmp_path / "law.nc")["path"].values) == [str(file) for file in files]


def test_files_without_a_law_and_cells_of_two_fabrics_are_refused(results):
    result = command("membrane", results / "course.nc", results / "other.nc")
    assert result.exit_code == 1
    assert "yarn.poisson_ratio is 0.1 but" in result.stderr
    result = command("strip", results / "course.nc", "--length", 1, "--width", 1, "--strain", 0.1)
    assert "is no law of a fabric" in result.stderr
