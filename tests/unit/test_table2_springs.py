"""Table 2 against springs that are known."""

import numpy as np
import pytest
import study
import synthetic

from knitstudy.errors import DataFileError
from knitstudy.paper.tables.table1_table2_contact import (
    AVERAGED,
    READINGS,
    tabulate_averages,
    tabulate_springs,
)

STIFFNESS = np.array([80e3, 60e3, 900e3])


@pytest.fixture
def scenes(plain_scene):
    course = plain_scene.vary({"fidelity": "hexahedra", "interaction": "isotropic", "name": "course"})
    return {"course": course, "wale": course.replace("name", "wale").replace("load.direction", "wale")}


@pytest.fixture
def touching(contacts):
    return synthetic.contacts_with_springs(contacts, STIFFNESS)


def rows_of(table, axes="global", **values):
    for column, value in values.items():
        table = table[table[column] == value]
    return table[table["axes"] == axes].set_index("axis")


def test_one_row_a_scene_measure_and_axis(touching, scenes, paper):
    both = touching.assign(centreline_relative_displacement=2 * touching["relative_displacement"])
    table = tabulate_springs({"course": touching, "wale": both}, paper, scenes)
    assert len(table) == (1 + 2) * len(READINGS) * 3
    rows = rows_of(table, scene="wale", displacement="centreline")
    for average in (AVERAGED, "mean of F / d [N/m]"):
        np.testing.assert_allclose(rows.loc[list("xyz"), average], STIFFNESS / 2)
    spread = rows_of(table, scene="course")["standard deviation of F / d [N/m]"]
    np.testing.assert_allclose(spread.loc[list("xyz")], 0, atol=1e-6)


def test_numbers_of_the_paper_stand_beside_averages_along_its_axes(touching, scenes, paper):
    table = tabulate_springs({"course": touching, "wale": touching}, paper, scenes)
    for load, printed in study.SPRINGS.items():
        rows = rows_of(table, load=load)
        np.testing.assert_array_equal(rows.loc[list("xyz"), "paper [N/m]"], printed)
        np.testing.assert_allclose(
            rows.loc[list("xyz"), "averaged, over the paper's [1]"], STIFFNESS / printed
        )
    rough = {"course": scenes["course"].replace("interaction", "rough")}
    assert tabulate_springs({"course": touching}, paper, rough)["paper [N/m]"].isna().all()


def test_spread_and_counts(touching, scenes, paper):
    force = touching["force"].to_numpy().copy()
    force[-1, 12] *= [3.0, -1.0, 1.0]
    displacement = touching["relative_displacement"].to_numpy().copy()
    displacement[:, 13, 2] = 0.0
    changed = touching.assign(
        force=(touching["force"].dims, force),
        relative_displacement=(touching["relative_displacement"].dims, displacement),
    )
    table = tabulate_springs({"course": changed}, paper, scenes)
    table = table[table["axes"] == "global"].set_index("axis")
    assert table.loc["x", "largest F / d [N/m]"] == pytest.approx(3 * STIFFNESS[0])
    assert table.loc["y", "smallest F / d [N/m]"] == pytest.approx(-STIFFNESS[1])
    assert table.loc["x", "mean of F / d [N/m]"] == pytest.approx(14 / 12 * STIFFNESS[0])
    counts = table[["crossings [1]", "negative [1]", "undefined [1]", "open [1]"]]
    np.testing.assert_array_equal(counts.loc[["x", "y", "z"]], [[12, 0, 0, 0], [12, 1, 0, 0], [11, 0, 1, 0]])


def test_both_systems_of_axes_stand_beside_the_paper_at_a_glance(touching, scenes, paper):
    table = tabulate_averages({"course": touching}, paper, scenes).set_index("axes")
    assert list(table.index) == ["global", "local"]
    row = table.loc["global"]
    np.testing.assert_allclose(row[["kx [N/m]", "ky [N/m]", "kz [N/m]"]].astype(float), STIFFNESS)
    assert row["kz / kx [1]"] == pytest.approx(900 / 80)
    assert row["kz / kx, paper [1]"] == pytest.approx(952.1 / 84.5)


def test_ties_are_refused(touching, scenes, paper):
    tied = touching.assign(tied=("crossing", np.ones(touching.sizes["crossing"], dtype=np.int8)))
    with pytest.raises(DataFileError, match="'course' are all tied"):
        tabulate_springs({"course": tied}, paper, scenes)
