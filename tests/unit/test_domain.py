"""Square knits of rising size: what belongs together, how cost grows, and what the tables say of it."""

import numpy as np
import pytest
import scipy.linalg
import synthetic
import xarray as xr

from knitstudy.geometry.fabric import cut_cells
from knitstudy.measures.endless_knit import between_grips, held_over_free, limit
from knitstudy.measures.unknowns import law_of, nodes_2d, nodes_3d
from knitstudy.mechanics.membrane import strains
from knitstudy.mechanics.membrane_law import StretchLaw, forces_per_width
from knitstudy.mesh.mesher import mesh_fabric, slices_of
from knitstudy.tables import catalogue as tables


def test_counts_of_a_cell_are_those_of_larger_knits(plain_scene, knit_of):
    """Of the mesh of 3 x 3 cells and of what 6 x 6 have."""
    loop = knit_of(plain_scene).loop
    cell = cut_cells(loop, 1, 1)
    slices = law_of(lambda fabric: slices_of(fabric, 0.5, 1.2), cell)
    assert slices(3) == mesh_fabric(cut_cells(loop, 3, 3), 0.5, 1.2, load="course").slices
    assert slices(6) == slices_of(cut_cells(loop, 6, 6), 0.5, 1.2)
    spatial, planar = law_of(lambda fabric: nodes_3d(fabric, 5 / 9), cell), law_of(nodes_2d, cell)
    for n in (3, 6):
        fabric = cut_cells(loop, n, n)
        assert [spatial(n), planar(n)] == [nodes_3d(fabric, 5 / 9), nodes_2d(fabric)]
        assert planar(n) == 4 * n**2 + 6 * n, "zones, and the ends of 3 n pieces"


SMALL = 1e-4


def isotropic(poisson):
    shear = (1 - poisson) / 2
    return np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, shear]]) / (1 - poisson**2)


def test_a_short_sheet_is_held_across_everywhere():
    for strain in (SMALL, 0.05):
        found = held_over_free(isotropic(0.3), 1.0, 200.0, strain, elements=16)
        assert found == pytest.approx(1 / (1 - 0.3**2), rel=2e-3)


def test_a_law_of_stretches_has_those_of_the_polar_decomposition():
    law = StretchLaw(np.array([[3.0, 1.0, 0.2], [1.0, 5.0, 0.1], [0.2, 0.1, 0.8]]))
    for gradient in np.eye(2) + 0.2 * np.random.default_rng(0).normal(size=(20, 2, 2)):
        _, stretch = scipy.linalg.polar(gradient)
        expected = np.array([stretch[0, 0] - 1, stretch[1, 1] - 1, 2 * stretch[0, 1]])
        energy = law.energy(strains(gradient))
        np.testing.assert_allclose(energy, expected @ law.membrane @ expected / 2, atol=1e-12)
        np.testing.assert_allclose(forces_per_width(law, expected), law.membrane @ expected, atol=1e-12)


def test_limit_of_a_knit_whose_edges_are_a_part_of_it():
    cells = np.array([1, 3, 6, 8, 10])
    assert limit(cells, 5.0 - 2.0 / cells) == pytest.approx((5.0, 0.0), abs=1e-9)
    corners = 5.0 - 2.0 / cells + 0.9 / cells**2
    middle, uncertain = limit(cells, corners)
    assert middle + uncertain == pytest.approx(5.0), "the parabola finds it"
    assert uncertain > 0.005, "terms other than 1 / n show as uncertainty"


@pytest.fixture(scope="module")
def knits(plain_scene):
    """Scenes and histories of tied square knits and of the cell, in wale tension."""
    scenes, histories = {}, {}
    for count in (3, 6, 8):
        name = "yarns-tie-wale" if count == 3 else f"domain-yarns-tie-wale-{count}x{count}"
        size = {"knit": f"plain{count}", "pattern.loops": count, "pattern.rows": count}
        keys = {"name": name, "fidelity": "spline_yarns", "interaction": "tie", "load.direction": "wale"}
        scenes[name] = plain_scene.vary(keys | size)
        width = count * scenes[name].pattern.wale_spacing
        history = synthetic.history(scene=name, interaction="tie")
        force = history["force"] / history["force"][-1] * width * (1000.0 - 300.0 / count)
        histories[name] = history.assign(force=force)
    cell = plain_scene.vary(
        {"name": "cell-wale", "specimen": "cell", "fidelity": "spline_yarns", "interaction": "tie"}
        | {"load.deformation": "wale", "load.lateral": "free"}
    )
    membrane = np.diag([1.0, 1.0, 0.5])  # no contraction
    strain = histories["yarns-tie-wale"]["strain"].to_numpy()
    history = xr.Dataset(
        {
            "strain": ("increment", strain),
            "force_per_width": (("increment", "plane"), np.outer(strain / strain[-1], [0.0, 990.0, 0.0])),
            "tangent_per_width": (("increment", "plane", "of_plane"), np.tile(membrane, (len(strain), 1, 1))),
        }
    )
    return scenes, histories, cell, history


def test_cell_stands_beside_the_limit_of_knits(knits):
    scenes, histories, cell, history = knits
    table = tables.tabulate(
        "endless_knit", squares=histories, cells={"cell-wale": history}, scenes=scenes | {"cell-wale": cell}
    )
    last = table.iloc[-1]
    assert last["direction"] == "wale"
    assert last["cells in a row [1]"] == "3, 6, 8"
    assert last["limit [N/m]"] == pytest.approx(1000.0)
    assert last["uncertainty of the limit [N/m]"] == pytest.approx(0.0, abs=1e-6)
    assert last["the same, over the limit [1]"] == pytest.approx(0.99)
    assert len(table) == 2, "its first and its last strain"


def test_a_sheet_is_as_stiff_as_the_cell_on_its_way(knits):
    """Of a cell that grows stiffer, the sheet has the force of the whole way, not the last stiffness."""
    _, _, cell, history = knits
    strain = history["strain"].to_numpy()
    tangent = np.array([[1.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 0.3]])
    grows = np.multiply.outer(1 + strain / strain[-1], tangent)
    stiffer = history.assign(tangent_per_width=(history["tangent_per_width"].dims, grows))
    found = between_grips(stiffer, cell, len(strain) - 1)
    sides = cell.pattern.course_spacing, cell.pattern.wale_spacing
    assert found == pytest.approx(held_over_free(1.5 * tangent, *sides, strain[-1]), rel=1e-6)
