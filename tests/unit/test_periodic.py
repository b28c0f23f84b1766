"""Cells that repeat themselves: seams of splines, jumps over the lattice, the section in a deck, refused scenes."""

import numpy as np
import pytest
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.mechanics.periodic import Lattice, seam
from knitstudy.mechanics.spline_yarn.space import yarn_space
from knitstudy.paper.tables.endless_knit import moduli
from knitstudy.run.configuration import load_scene
from knitstudy.use.inp import SHELL_ENTRIES, section_matrix, shell_entries, write_shell

BREAKS = np.array([0.0, 0.7, 1.1, 2.0, 2.6, 3.0])


@pytest.mark.parametrize("degree", [2, 3, 4])
def test_wrapped_splines_are_as_smooth_over_the_seam_as_within(degree):
    own = yarn_space(BREAKS, 2, degree)
    around = seam(own)
    rng = np.random.default_rng(0)
    nodes = around.wrapped @ rng.standard_normal((around.wrapped.shape[1], 3))
    first = own.first_node[:-1]
    ends = [own.spline.basis(np.array([s]), orders=degree - 1) for s in BREAKS[[0, -1]]]
    for k in range(3):
        left, right = (
            np.einsum("oj,ji->oi", values[:, 0], nodes[first[at[0] + np.arange(degree + 1)] + k])
            for at, values in ends
        )
        np.testing.assert_allclose(left, right, atol=1e-10 * np.abs(right).max())
    assert around.wrapped.shape[1] == own.size - degree * 6  # functions of degree 2 over the section


def test_the_jump_lifts_the_image_alone():
    own = yarn_space(BREAKS, 2, 3)
    around = seam(own)
    nodes = around.nodes(np.zeros((len(around.order), 3)), np.array([0, 0, 2.0]))
    first, values = own.spline.basis(BREAKS[[0, -1]], orders=2)
    left, right = (values[:, end] @ nodes[own.first_node[first[end] + np.arange(4)], 2] for end in range(2))
    np.testing.assert_allclose(right - left, [2, 0, 0], atol=1e-10)


def test_jumps_are_those_of_the_macroscopic_field():
    lattice = Lattice(np.array([[3.0, 0.5, 0], [-0.4, 2.0, 0]]), reference=0.3)
    rng = np.random.default_rng(1)
    points, strains = rng.standard_normal((7, 3)), rng.standard_normal(6)

    def field(x):
        ex, ey, gxy, kx, ky, kxy = strains
        e, k = np.array([[ex, gxy / 2], [gxy / 2, ey]]), np.array([[kx, kxy / 2], [kxy / 2, ky]])
        plane = x[:, :2]
        moved = plane @ e + (x[:, 2:] - lattice.reference) * (plane @ k)
        return np.column_stack([moved, -0.5 * np.einsum("ni,ij,nj->n", plane, k, plane)])

    for number, vector in enumerate(lattice.vectors):
        jumps = lattice.jumps(number, points, np.ones(len(points)))
        np.testing.assert_allclose(jumps @ strains, field(points + vector) - field(points), atol=1e-12)
    assert lattice.area == pytest.approx(6.2)


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


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"load.deformation": "twist"}, "is 'twist' but must be course, wale, biaxial or shear"),
        ({"fidelity": "rom3d"}, "'rom3d' but must be beam or spline_yarns where specimen is cell"),
        (
            {"interaction": "rough", "outputs": [], "contact.tied_edges": "outer"},
            "contact.tied_edges is no key of a scene whose specimen is cell",
        ),
        ({"outputs": ["film"]}, r"outputs is \['film'\] but must be a list out of \[fields, vtu, deck\]"),
    ],
)
def test_keys_that_a_cell_cannot_have_are_refused_by_name(changes, message):
    with pytest.raises(ConfigurationError, match=message):
        load_scene("cell-course").vary(changes)


@pytest.mark.parametrize("degree", [2, 3])
def test_a_yarn_goes_on_as_its_own_images(degree):
    own = yarn_space(BREAKS, [2, 3, 2, 2, 3], degree, beyond=5)
    around = seam(own)
    period = np.array([2.0, 0.1, 0.0])
    rng = np.random.default_rng(0)
    nodes = around.nodes(rng.standard_normal((len(around.order), 3)), period)
    s = np.array([0.3, 1.0, 1.9, 2.5])
    assert own.spline.spans[0, 0] == pytest.approx(-BREAKS[-1])
    within, later = (places(own, nodes, s + shift) for shift in (0.0, BREAKS[-1]))
    there = s + BREAKS[-1] < own.spline.spans[-4, 1]  # beyond, splines reach over fewer spans
    assert there.any()
    np.testing.assert_allclose(later[there], within[there] + period, atol=1e-9)


def places(own, nodes, s):
    first, values = own.spline.basis(s)
    at = own.first_node[first[:, None] + np.arange(own.spline.degree + 1)]
    return np.einsum("kj,kji->ki", values[0], nodes[at])
