"""`knitstudy membrane` and `strip`: from histories of cells to a law, decks, and a strip between clamps."""

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from test_membrane_law import ORTHOTROPIC, cells

from knitstudy.files import read_dataset, write_dataset
from knitstudy.run.commands.main import main
from knitstudy.run.configuration import load_scene
from knitstudy.run.plan import Plan
from knitstudy.run.store import described
from knitstudy.use.inp import THICKNESS, solid_entries


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


def test_files_without_a_law_and_cells_of_two_fabrics_are_refused(results):
    result = command("membrane", results / "course.nc", results / "other.nc")
    assert result.exit_code == 1
    assert "yarn.poisson_ratio is 0.1 but" in result.stderr
    result = command("strip", results / "course.nc", "--length", 1, "--width", 1, "--strain", 0.1)
    assert "is no law of a fabric" in result.stderr
