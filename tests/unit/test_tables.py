"""Tables against values computed by hand, and the paper's numbers beside them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import synthetic
import xarray as xr

from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.geometry.build import initial_loop
from knitstudy.geometry.pattern import Knit
from knitstudy.io import read_table
from knitstudy.tables import catalogue
from knitstudy.tables.reference import number, numbers
from knitstudy.tables.table5_cost import element_length

RESOURCES = Path(__file__).resolve().parents[2] / "resources" / "reference"


@pytest.fixture(scope="module")
def paper():
    return read_table(RESOURCES / "paper_tables.csv")


@pytest.fixture
def scenes(plain_scene):
    solid = plain_scene.to_dict() | {"fidelity": "dns", "rom": {"contacts_from": None, "joint": "rigid"}}
    solid = type(plain_scene).from_dict(solid)
    return {"dns": solid, "rom3d": plain_scene, "rom2d": plain_scene.replace("fidelity", "rom2d")}


@pytest.fixture(scope="module")
def geometry(plain_scene):
    return synthetic.geometry(Knit(initial_loop(plain_scene), 2, 2))


@pytest.fixture
def histories():
    return {
        "dns": synthetic.history(lift=2e-4, dof=59_940, memory_growth=134e6),
        "rom3d": synthetic.history(force=(0, 6, 12), lift=1e-4),
        "rom2d": synthetic.history(force=(0, 10, 20), dof=60, memory_growth=1e6),
    }


def contacts(rows=2, columns=2):
    """Contacts of a knit whose interlock segments go up by 2 for 1 across, and whose legs by 3 for 1."""
    row, column, zone = (index.ravel() for index in np.indices((rows, columns, 4)))
    x = 10 * column + np.array([0, 6, 1, 5])[zone]
    y = 5 * row + np.array([0, 0, 2, 2])[zone]
    centroid = np.column_stack([x, y, 0.3 * zone])
    place = {"row": row, "column": column, "zone": zone}
    return xr.Dataset(
        {name: ("crossing", values) for name, values in place.items()}
        | {"centroid": (("crossing", "xyz"), centroid)}
    )


def test_every_number_of_the_paper_that_tables_use_is_there(paper):
    assert number(paper, "5", "dns-tie 3x3", "degrees of freedom") == 189_513
    assert numbers(paper, "4", "rom2d", "segment 2 and 3 angles to x y z").tolist() == [66, 24, 90]


def test_number_that_is_not_printed_is_named(paper):
    with pytest.raises(DataFileError, match="case 'dns', quantity 'time' is there 0 times"):
        number(paper, "5", "dns", "time")


def test_printed_text_is_no_number(paper):
    with pytest.raises(DataFileError, match="'memory' is 'much'; it must be numbers"):
        number(paper.assign(value="much"), "5", "rom2d 3x3", "memory")


def test_angles_of_a_known_honeycomb(paper):
    table = catalogue.build("table4_angles", contacts=contacts(), paper=paper).set_index("segment")
    interlock, leg = np.degrees(np.arctan([2, 3]))
    np.testing.assert_allclose(table["angle to x [deg]"], [0, interlock, interlock, leg, leg, 0], atol=6e-4)
    np.testing.assert_allclose(table["angle to y [deg]"], 90 - table["angle to x [deg]"], atol=2e-3)
    assert (table["angle to z [deg]"] == 90).all()
    assert table["angle to x, paper [deg]"].tolist() == [0, 66, 66, 80, 80, 0]
    assert table.loc[2, "largest difference [deg]"] == pytest.approx(66 - interlock, abs=1e-3)
    assert table["segments"].tolist() == [4, 4, 4, 2, 2, 2]


def test_spread_of_angles_shows_one_zone_out_of_place(paper):
    bent = contacts()
    bent["centroid"][0, 0] += 0.5
    table = catalogue.build("table4_angles", contacts=bent, paper=paper).set_index("kind")
    assert table.loc["interlock, left", "spread over the knit [deg]"] > 1
    assert table.loc["head", "spread over the knit [deg]"] == 0


def test_knit_of_one_cell_has_heads_and_interlocks_only(paper):
    table = catalogue.build("table4_angles", contacts=contacts(1, 1), paper=paper)
    assert table["kind"].tolist() == ["head", "interlock, left", "interlock, right"]


def test_cost_beside_the_papers(histories, paper, scenes):
    table = catalogue.build("table5_cost", **histories, paper=paper, scenes=scenes).set_index("model")
    assert table.index.tolist() == ["DNS", "2D ROM", "3D ROM"]
    assert table.loc["DNS", "degrees of freedom over paper's [1]"] == pytest.approx(59_940 / 189_513)
    assert table.loc["DNS", "memory growth over paper's [1]"] == pytest.approx(134 / 128)
    assert table.loc["DNS", "mesh size [m]"] == 0.45e-3
    assert table.loc["2D ROM", "mesh size [m]"] == pytest.approx(2.5e-3)
    assert table.loc["3D ROM", "Newton iterations [1]"] == 9
    assert table["element, paper"].tolist() == ["C3D8R", "B31", "B31"]


def test_element_length_leaves_out_the_way_to_the_next_yarn():
    assert element_length(synthetic.history(stations=11)) == pytest.approx(1e-3)


def test_stiffness_and_distance(histories, geometry):
    table = catalogue.build("stiffness", **histories, geometry=geometry).set_index("model")
    np.testing.assert_allclose(table["stiffness over DNS's [1]"], [1, 1.2, 2])
    np.testing.assert_allclose(table["L2 distance of force to DNS [1]"], [0, 0.2, 1], atol=1e-12)
    np.testing.assert_allclose(table["largest |u_z| over diameter [1]"], [4e-4 / 1.8e-3, 2e-4 / 1.8e-3, 0])
    np.testing.assert_allclose(table["amplitude of u_z over DNS's [1]"], [1, 0.5, 0])


def test_residuals_of_the_calibration(geometry):
    targets = {
        "targets": {"length": {"value": 40e-3}, "interlock_angle": {"value": 66}, "leg_angle": {"value": 80}}
    }
    targets["targets"]["diameter"] = {"value": 1.8e-3}
    table = catalogue.build("geometry", geometry=geometry, targets=targets).set_index("quantity")
    assert table.loc["yarn in a loop", "residual"] == pytest.approx(0.2e-3)
    assert table.loc["angle of interlock segments to x", "residual"] == pytest.approx(0.5)
    assert table.loc["yarn diameter", "residual"] == pytest.approx(0, abs=1e-15)
    error = table.loc["largest |D - 2R - c0| of a crossing"]
    assert (error["before"], error["after"]) == (pytest.approx(4e-4), pytest.approx(1e-8))
    assert np.isnan(table.loc["smallest gap", "target"])
    assert table.loc["F, total", "after"] == 11


def test_missing_target_is_named(geometry):
    with pytest.raises(ConfigurationError, match=r"targets\.length\.value must be there"):
        catalogue.build("geometry", geometry=geometry, targets={"targets": {}})


def test_unknown_table_names_the_known_ones():
    with pytest.raises(ConfigurationError, match=r"unknown table 'table6'.*allowed are claims, geometry, "):
        catalogue.build("table6")


def test_missing_result_is_named(paper):
    with pytest.raises(ConfigurationError, match="table4_angles' needs contacts, paper: contacts is missing"):
        catalogue.build("table4_angles", paper=paper)


def test_claims_without_judge_wait(histories, geometry, paper, scenes):
    claims = pd.DataFrame({"id": ["K1"], "where": ["Fig 7a"], "claim": ["none"]})
    table = catalogue.build(
        "claims", **histories, geometry=geometry, paper=paper, claims=claims, scenes=scenes
    )
    assert table["verdict"].tolist() == ["not yet run"]
    assert table["measured"].tolist() == [""]
