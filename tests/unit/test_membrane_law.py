"""Laws of a membrane: uniaxial tension, laws found again from states, decks and strips by the commands."""

import re

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from click.testing import CliRunner
from fabric_states import cells_of_knits
from refusals import refusal
from scipy.optimize import brentq

from knitstudy.datasets import read_dataset, write_dataset
from knitstudy.run.commands.main import main
from knitstudy.run.configuration import load_scene
from knitstudy.run.plan import Plan
from knitstudy.run.store import described
from knitstudy.use.decks.fabric import THICKNESS, solid_entries, write_membrane, write_sliding
from knitstudy.use.fabric_law import (
    States,
    fit_exponentials,
    fit_linear,
    forces_beside,
    forces_on_paths,
    law_of,
    membrane,
)
from knitstudy.use.measured_curve import read_curve
from knitstudy.use.membrane_law import ExponentialLaw, forces_per_width

FORM = np.array([[3.0, 1.0, 0.2], [1.0, 5.0, 0.1], [0.2, 0.1, 0.8]])
COUPLED = ExponentialLaw(FORM, np.array([0.5, 0.2]), np.array([[4.0, -2.0, 0.5], [-1.0, 3.0, 2.0]]))
ORTHOTROPIC = ExponentialLaw(np.diag([20.0, 60.0, 9.0]), np.array([3.0]), np.array([[6.0, 4.0, 0.0]]))


def test_residuals_are_over_the_tension_and_the_shear_that_a_path_reaches():
    force = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 2.0], [200.0, 0.0, 0.0], [60.0, 80.0, 0.0]])
    states = States(np.zeros((4, 3)), force, np.array(["wale", "shear", "course", "wale"], dtype=object))
    wale = [100.0, 100.0, 2.0]
    # The edges of the shear are free: tension that the law has there is over that of the fabric
    np.testing.assert_allclose(states.scale, [wale, [200, 200, 2], [200, 200, 2], wale])


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
    noise = 0.01 * np.random.default_rng(2).normal(size=states.force.shape) * states.scale
    fit = fit_exponentials(States(states.stretch, states.force + noise, states.path), sizes=(0.0,))
    off = np.abs(fit.value - form[np.tril_indices(3)])
    assert fit.error == pytest.approx(0.01 * 3**0.5, rel=0.2)
    assert np.all(off <= 2 * fit.half)
    assert np.all(fit.half[[0, 2, 5]] < 0.05 * np.diag(form))


@pytest.mark.parametrize("mirrored", [True, False])
def test_the_linear_law_of_linear_states_is_theirs(mirrored):
    form = np.array([[20.0, 8.0, 0], [8.0, 60.0, 0], [0, 0, 9.0]]) if mirrored else FORM
    states = States.of(cells(ExponentialLaw(form, np.empty(0), np.empty((0, 3)))))
    np.testing.assert_allclose(fit_linear(states, mirrored), form, atol=1e-9)


def test_forces_on_paths_are_free_where_the_states_are():
    """Course tension free across of E = (x, -A12 / A22 x): the force of Young's modulus."""
    form = np.array([[20.0, 8.0, 0], [8.0, 60.0, 0], [0, 0, 9.0]])
    law = ExponentialLaw(form, np.empty(0), np.empty((0, 3)))
    free = States(
        np.array([[0.1, -0.3, 0.0]]), np.array([[5.0, 0.0, 0.0]]), np.array(["course"], dtype=object)
    )
    expected = 1.1 * 0.105 * (20 - 8**2 / 60)
    np.testing.assert_allclose(forces_on_paths(law, free), [[expected, 0, 0]], atol=1e-9)


@pytest.mark.parametrize("fabric", cells_of_knits())
def test_a_deck_of_a_knit_carries_the_forces_of_its_cell(fabric):
    """Free across; least squares at given strains left 1e-15 of them to the jersey's deck."""
    fitted = membrane(cells_of_knits()[fabric])
    assert not fitted.attrs["refused"]
    assert fitted.attrs["eigenvalues"] > 1e-3
    work = {}  # of the forces of deck and cell along the strains of a path
    for path, _, strain, *forces in forces_beside(fitted, "deck"):
        work[path] = work.get(path, 0.0) + strain * np.array(forces)
    for path, (deck, cell) in work.items():
        assert 0.5 < deck / cell < 2, path


def test_a_cell_that_leans_by_itself_has_no_say_in_the_stiffness_in_shear():
    """The rib leans by 0.5 on its way along the courses; its shear is tried to 0.01."""
    fitted = membrane(cells_of_knits()["acrylic rib"])
    for law in ("law", "deck"):
        (force, cell), *_ = [row[3:] for row in forces_beside(fitted, law) if row[1] == "shear"]
        assert force == pytest.approx(cell, rel=0.05)


def test_the_law_of_the_jersey_has_the_force_of_its_cell_in_course_tension():
    """76 N/m for 51.5 where the few N/m of shear outweighed it."""
    rows = forces_beside(membrane(cells_of_knits()["jersey"]), "law")
    (force, cell), *_ = [row[3:] for row in rows if row[0] == "course"]
    assert force == pytest.approx(cell, rel=0.05)


def stiffening(rate, both):
    """Histories of an orthotropic fabric that stiffens at a rate, strained both ways up to a share of one way."""
    law = ExponentialLaw(np.eye(3), np.array([1e-3, 1e-3]), rate * np.eye(3)[:2])
    ways = {"course": (1, 0, 0), "wale": (0, 1, 0), "both": (both, both, 0), "shear": (0, 0, 1)}
    return {
        name: xr.Dataset(
            {
                "cell_strain": (
                    ("increment", "plane"),
                    (stretch := 0.3 * np.outer(np.linspace(0, 1, 13), way)),
                ),
                "force_per_width": (("increment", "plane"), forces_per_width(law, stretch)),
            }
        )
        for name, way in ways.items()
    }


def test_a_secant_stands_in_where_the_law_of_all_states_misses_a_path(tmp_path):
    fitted = membrane(stiffening(20.0, both=0.5))
    assert fitted.attrs["secant"] == 1
    assert not fitted.attrs["refused"]
    strains = {path: strain for path, way, strain, *_ in forces_beside(fitted, "deck") if path == way}
    assert strains["course"] == pytest.approx(0.15), "half of the largest"
    write_membrane(fitted, tmp_path / "deck.inp", "calculix", "stiffening")
    text = (tmp_path / "deck.inp").read_text()
    assert "A SECANT" in text
    assert "** course, course 15 %: deck" in text


def test_no_deck_is_written_where_every_linear_law_misses_a_path(results, tmp_path):
    cells = stiffening(40.0, both=0.25)
    fitted = membrane(cells)
    with refusal("off the forces of the cell by a factor of 3.37, above 2"):
        write_membrane(fitted, tmp_path / "deck.inp", "calculix", "stiffening")
    scene = load_scene("cell-course")
    for name, history in cells.items():
        write_dataset(described(history, Plan({}).step("simulation", scene)), tmp_path / f"{name}.nc")
    (tmp_path / "law.abaqus.inp").write_text("an earlier one")
    ended = command("membrane", *(tmp_path / f"{name}.nc" for name in cells), "-o", tmp_path / "law.nc")
    assert ended.exit_code == 0
    assert "no deck is written: " in ended.stderr
    assert not list(tmp_path.glob("*.inp"))


def test_a_singular_law_is_for_no_deck():
    """A law whose stresses are proportional to each other but for 1e-5, as those of the jersey's deck were."""
    law = ExponentialLaw(
        np.array([[4.0, 2.0, 0], [2.0, 1.0 + 1e-5, 0], [0, 0, 1.0]]), np.empty(0), np.empty((0, 3))
    )
    fitted = membrane(cells(law))
    with refusal("the linear law is singular"):
        write_membrane(fitted, "deck.inp", "calculix", "singular")


def test_a_section_without_a_stiffness_is_for_no_deck(tmp_path):
    fitted = membrane(cells(ORTHOTROPIC))
    write_sliding(fitted, (1e-6, 2e-6), tmp_path / "shell.inp", "shell")
    with refusal("no stiffness in one mode of stretching and bending"):
        write_sliding(fitted, (1e-6, 0.0), tmp_path / "shell.inp", "shell")


def test_a_law_comes_back_from_its_dataset():
    fitted = membrane(cells(ORTHOTROPIC))
    again, strain = law_of(fitted), np.array([0.1, 0.05, 0.02])
    np.testing.assert_allclose(
        again.stress(strain), ORTHOTROPIC.stress(strain), atol=0.4
    )  # of 24, and of 190 at the ends
    assert fitted.attrs["error"] < 0.012
    assert fitted.attrs["factor"] > 1.01
    assert set(fitted["path"].values) == set(cells(ORTHOTROPIC))


def test_states_that_do_not_say_a_stiffness_are_refused():
    few = {name: cell for name, cell in cells(ORTHOTROPIC).items() if name in ("course", "wale")}
    with refusal("no state is strained in shear"):
        States.of(few)
    slack = cells(ORTHOTROPIC)["shear"].assign(force_per_width=lambda cell: 0 * cell["force_per_width"])
    with refusal("slack: has no forces; leave it out"):
        States.of(few | {"slack": slack})
    slack["force_per_width"][-1, 0] = 1.0
    with refusal("no state has a force in shear"):
        States.of(few | {"shear": slack})


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
        assert re.search(r"\*\* course, course 20 %: deck [\d.]+ N/m, cell [\d.]+ N/m\n", text)
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
    assert "is not a law of a fabric" in result.stderr
