"""Cells that repeat themselves: seams of splines, jumps over the lattice, the section in a deck, refused scenes."""

import numpy as np
import pytest
import xarray as xr

from knitstudy.paper.tables.endless_knit import moduli
from knitstudy.run.configuration import load_scene
from knitstudy.use.inp import SHELL_ENTRIES, section_matrix, shell_entries, write_shell


def test_moduli_of_a_sheet():
    compliance = np.array([[1 / 10, -0.2 / 10, 0], [-0.2 / 10, 1 / 40, 0], [0, 0, 1 / 3]])
    assert list(moduli(np.linalg.inv(compliance)).values()) == pytest.approx([10, 40, 3, 0.2, 0.8])


def random_stiffness():
    root = np.random.default_rng(2).standard_normal((6, 6))
    return root @ root.T + 6 * np.eye(6)


def cell_history(strain=0.05, matrix=None):
    matrix = random_stiffness() if matrix is None else matrix
    strains = np.array([[0, 0, 0], [strain, -0.2 * strain, 0]])
    return xr.Dataset(
        {
            "cell_strain": (("increment", "plane"), strains),
            "force_per_width": (("increment", "plane"), np.array([[0, 0, 0], [10 * strain, 0, 0]])),
            "tangent_per_width": (("increment", "plane", "of_plane"), np.stack(2 * [matrix[:3, :3]])),
            "membrane_stiffness": (("plane", "of_plane"), matrix[:3, :3]),
            "coupling_stiffness": (("plane", "of_plane"), matrix[:3, 3:]),
            "bending_stiffness": (("plane", "of_plane"), matrix[3:, 3:]),
        }
    )


def test_the_deck_has_the_section_column_by_column(tmp_path):
    path = tmp_path / "cell.inp"
    write_shell(load_scene("cell-course"), path, cell_history())
    lines = path.read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("*SHELL GENERAL SECTION, ELSET=FABRIC"))
    rows = [[float(value) for value in line.split(",")] for line in lines[at + 1 :]]
    assert [len(row) for row in rows] == [8, 8, 5]
    matrix, numbers = random_stiffness(), np.concatenate(rows)
    assert SHELL_ENTRIES[:7] == ("D11", "D12", "D22", "D13", "D23", "D33", "D14")
    assert (SHELL_ENTRIES[-1], len(SHELL_ENTRIES)) == ("D66", 21)
    for name, number in zip(SHELL_ENTRIES, numbers, strict=True):
        assert number == pytest.approx(matrix[int(name[1]) - 1, int(name[2]) - 1], rel=1e-12)
    np.testing.assert_allclose(section_matrix(cell_history()), matrix)
    np.testing.assert_allclose(shell_entries(matrix), numbers, rtol=1e-12)


def test_a_cell_has_the_values_that_its_specimen_requires():
    assert (
        load_scene("cell-course").vary({"interaction": "rough", "outputs": []}).contact.tied_edges == "none"
    )
