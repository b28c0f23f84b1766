"""Forces through a knit from averaged stresses: a bar of known stress, and pieces of known share."""

import numpy as np
import pytest
import synthetic
import xarray as xr

from knitstudy.geometry.fabric import plain_knit
from knitstudy.geometry.lay_out import initial_loop
from knitstudy.measures.segments import cell_force, cut_force
from knitstudy.tables import catalogue

STRESS, AREA, LENGTH, CELLS = 2e6, 3e-6, 0.05, 1000


@pytest.fixture(scope="module")
def knit(plain_scene):
    return plain_knit(initial_loop(plain_scene), 3, 3)


@pytest.fixture(scope="module")
def bar():
    """A bar along y under tension, in cells, that is pressed beside its middle half."""
    y = LENGTH * (np.arange(CELLS) + 0.5) / CELLS
    stress = np.zeros((CELLS, 6))
    stress[:, 1] = np.where(np.abs(y / LENGTH - 0.5) < 0.25, STRESS, -STRESS)
    return xr.Dataset(
        {
            "cell_stress": (("cell", "component"), stress),
            "cell_volume": ("cell", np.full(CELLS, AREA * LENGTH / CELLS)),
            "cell_place": (("cell", "xyz"), np.column_stack([0 * y, y, 0 * y])),
        },
        attrs={"direction": "wale"},
    )


@pytest.mark.parametrize(("share", "sign"), [(0.5, 1), (0.47, 1), (0.04, -1)])
def test_force_through_a_cut_is_that_of_its_slab(bar, share, sign):
    """Of the last one half of the slab lies outside of the bar."""
    inside = 1.0 if share > 0.2 else 0.5 + share / 0.4 + np.sin(2 * np.pi * share / 0.4) / (2 * np.pi)
    assert cut_force(bar, share) == pytest.approx(sign * inside * STRESS * AREA, rel=5e-3)


@pytest.mark.parametrize("direction", ["course", "wale"])
def test_pieces_of_one_period_are_one_loop_of_every_yarn(knit, direction):
    """With stress times volume of 1 N m for every metre of yarn, and all yarns alike."""
    stresses = synthetic.stresses(knit, direction, 60, 80)
    length = np.diff(stresses["piece_arc_length"], axis=1)[:, 0]
    axis = "xy"[direction == "wale"]
    stresses["piece_stress"][:] = np.eye(3)
    stresses["piece_volume"][:] = length[:, None]
    loop, period = knit.centrelines[0].length / knit.cells[0], (knit.cell[0], knit.cell[1])
    # In course tension a column: a loop of all four yarns. In wale tension a row: all loops of what makes one yarn.
    wanted = 4 * loop if axis == "x" else knit.cells[0] * loop
    found = cell_force(stresses, knit)
    assert found == pytest.approx(wanted / (period[axis == "y"] * 1.05), rel=1e-6)


def test_table_of_forces(knit, plain_scene):
    scene = plain_scene.vary({"fidelity": "hexahedra", "mesh.size": 0.3e-3})
    stresses = synthetic.stresses(knit, "course", 60, 80)
    count = 100
    x = np.linspace(0, LENGTH, count)
    stresses["cell_stress"] = (("cell", "component"), np.tile([STRESS, 0, 0, 0, 0, 0], (count, 1)))
    stresses["cell_volume"] = ("cell", np.full(count, AREA * LENGTH / count))
    stresses["cell_place"] = (("cell", "xyz"), np.column_stack([x, 0 * x, 0 * x]))
    stresses.attrs["force"] = STRESS * AREA
    given = {"geometry": knit.to_dataset(), "stresses": {"dns-a": stresses}, "scenes": {"dns-a": scene}}
    (row,) = catalogue.tabulate("cut_forces", **given).to_dict("records")
    assert row["force of the grips [N]"] == STRESS * AREA
    assert row["smallest force through a cut, over it [1]"] == pytest.approx(1, abs=0.03)
    assert row["largest force through a cut, over it [1]"] == pytest.approx(1, abs=0.03)
