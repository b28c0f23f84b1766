"""Figures and tables from outside of the package: one file each, drawn, planned and reported like all others."""

import sys

import pandas as pd
import pytest
import study
import synthetic

from knitstudy.figures.catalogue import FIGURES, draw
from knitstudy.measures.selection import TIED_COURSE
from knitstudy.registry import load_plugins
from knitstudy.stages.displays import files_of, possible, scenes_of
from knitstudy.tables.catalogue import TABLES, build

TOY = """
import pandas as pd
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.measures.response import secant_stiffness
from knitstudy.measures.selection import TIED_COURSE
from knitstudy.tables.catalogue import TABLES


@FIGURES.add("toy_curve", "A toy", needs=("dns", "scenes"), of=TIED_COURSE, optional=("beams",), texts={"alt": "line"})
def curve(dns, scenes, beams=None):
    figure = Figure()
    figure.subplots().plot(dns["strain"], dns["force"], label=scenes["dns"].name)
    return figure


@TABLES.add("toy_stiffness", "Another", needs=("rom3d", "tie_wale_dns_contacts"), of=TIED_COURSE)
def stiffness(rom3d, tie_wale_dns_contacts):
    return pd.DataFrame({"k": [secant_stiffness(rom3d)]})
"""


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """Name of a module outside of the package that is not imported yet."""
    (tmp_path / "toydisplays.py").write_text(TOY)
    monkeypatch.syspath_prepend(tmp_path)
    load_plugins(["toydisplays"])
    yield "toydisplays"
    FIGURES.forget("toy_curve")
    TABLES.forget("toy_stiffness")
    del sys.modules["toydisplays"]


@pytest.fixture
def scenes(plain_scene):
    return list(study.scenes(plain_scene).values())


def test_figure_from_outside_is_drawn_and_named_with_its_code(toy, plain_scene):
    figure = draw("toy_curve", dns=synthetic.history(force=(0, 1, 3)), scenes={"dns": plain_scene}, mesh=None)
    (line,) = figure.axes[0].lines
    assert line.get_ydata().tolist() == [0, 1, 3]
    assert FIGURES.module("toy_curve") == TABLES.module("toy_stiffness") == toy
    assert FIGURES.names()[0] == "fig15a_force_strain"
    assert FIGURES.names()[-1] == "toy_curve"  # those without a place in the report come last


def test_table_from_outside_is_built(toy):
    table = build("toy_stiffness", rom3d=synthetic.history(), tie_wale_dns_contacts=None)
    pd.testing.assert_frame_equal(table, pd.DataFrame({"k": table["k"]}))
    assert table["k"].item() > 0


def test_they_are_planned_from_the_scenes_of_a_study(toy, scenes):
    reference = {"paper": "paper.csv"}
    figures, tables = (possible(catalogue, scenes, reference, "out") for catalogue in (FIGURES, TABLES))
    assert figures["toy_curve"] == {"dns": "out/dns/dns-tie-course.nc"}
    assert tables["toy_stiffness"] == {
        "rom3d": "out/rom/rom3d-tie-course.nc",
        "tie_wale_dns_contacts": "out/contacts/dns-tie-wale.nc",
    }
    alone = [scene for scene in scenes if "wale" not in scene.name]
    assert "toy_stiffness" not in possible(TABLES, alone, reference, "out")
    assert {role: scene.name for role, scene in scenes_of(FIGURES.find("toy_curve"), scenes).items()} == {
        "dns": "dns-tie-course"
    }
    assert scenes_of(TABLES.find("toy_stiffness"), scenes) == {}


def test_several_scenes_of_a_role_are_lists(scenes):
    beams = [scene for scene in scenes if scene.fidelity == "beam"][:2]
    direct = next(scene for scene in scenes if scene.fidelity == "dns")
    assert files_of({"beams": beams, "tie": direct}, "r") == {
        "beams": [f"r/beams/{scene.name}.nc" for scene in beams],
        "tie": f"r/dns/{direct.name}.nc",
        "tie_contacts": f"r/contacts/{direct.name}.nc",
        "tie_geometry": f"r/geometry/{direct.knit}.nc",
        "tie_mesh": f"r/mesh/{direct.name}.nc",
    }


def test_every_display_of_the_package_can_be_made_from_a_whole_study(scenes):
    found = possible(FIGURES, scenes, {}, "out")
    assert {"fig15a_force_strain", "fig02_interfaces", "fig12b_beam_contact"} <= set(found)
    assert found["fig02_interfaces"] == {}
    assert set(found["fig15a_force_strain"]) == {"dns", "rom3d", "rom2d", "other_mesh", "reduced"}
    assert TIED_COURSE == FIGURES.find("fig15a_force_strain").of
