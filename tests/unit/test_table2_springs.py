"""Table 2 against springs that are known."""

import numpy as np
import pytest
import study
import synthetic

from knitstudy.tables.table2_springs import AVERAGES, STATISTICS, tabulate

STIFFNESS = np.array([80e3, 60e3, 900e3])


@pytest.fixture
def scenes(plain_scene):
    course = plain_scene.vary({"fidelity": "hexahedra", "interaction": "isotropic", "name": "course"})
    return {"course": course, "wale": course.replace("name", "wale").replace("load.direction", "wale")}


@pytest.fixture
def touching(contacts):
    return synthetic.contacts_with_springs(contacts, STIFFNESS)


def rows_of(table, **values):
    for column, value in values.items():
        table = table[table[column] == value]
    return table.set_index("axis")


def test_one_row_a_scene_measure_statistic_and_axis(touching, scenes, paper):
    both = touching.assign(centreline_relative_displacement=2 * touching["relative_displacement"])
    table = tabulate({"course": touching, "wale": both}, paper, scenes)
    assert len(table) == (1 + 2) * len(STATISTICS) * (3 + 2)
    for statistic in AVERAGES:
        rows = rows_of(table, scene="wale", displacement="centreline", statistic=statistic)
        np.testing.assert_allclose(rows.loc[list("xyz"), "stiffness [N/m]"], STIFFNESS / 2)
    spread = rows_of(table, scene="course", statistic="standard deviation of F / d")
    np.testing.assert_allclose(spread.loc[list("xyz"), "stiffness [N/m]"], 0, atol=1e-6)


def test_numbers_of_the_paper_stand_beside_averages_along_its_axes(touching, scenes, paper):
    table = tabulate({"course": touching, "wale": touching}, paper, scenes)
    for load, printed in study.SPRINGS.items():
        rows = rows_of(table, load=load, statistic=AVERAGES[0])
        np.testing.assert_array_equal(rows.loc[list("xyz"), "paper [N/m]"], printed)
        np.testing.assert_allclose(rows.loc[list("xyz"), "over paper's [1]"], STIFFNESS / printed)
        assert rows.loc[["normal", "tangential"], "paper [N/m]"].isna().all()
    assert rows_of(table, statistic="largest F / d")["paper [N/m]"].isna().all()
    rough = {"course": scenes["course"].replace("interaction", "rough")}
    assert tabulate({"course": touching}, paper, rough)["paper [N/m]"].isna().all()
