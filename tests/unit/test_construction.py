"""Density, tightness factor, cover, mass and thickness of fabrics against closed forms."""

import json
from math import pi, sqrt

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

from knitstudy import load_scene
from knitstudy.datasets import write_dataset
from knitstudy.knit.geometry.fabric_file import fabric_dataset
from knitstudy.knit.geometry.lay_out import initial_loop, lay_out
from knitstudy.knit.geometry.specimens import endless_cell, plain_knit, yarn_pair
from knitstudy.measures.construction import AT_REST, at_rest, construction, cover, drawn, tex_of
from knitstudy.run.commands.main import main


def numbers(quantities):
    return {quantity.name: quantity.value for quantity in quantities}


def test_numbers_of_a_cotton_jersey_are_those_of_the_mill():
    """30 tex, 3 mm of yarn in a stitch, 12 wales and 17 courses in a cm."""
    width, height = 1e-2 / 12, 1e-2 / 17
    line = np.array([[0.0, 0.0, -1e-4], [width, 0.0, 1e-4]])
    actual = numbers(construction([line], 3e-3, (width, height, 1, 1), radius=1e-4, tex=30.0))
    assert actual == pytest.approx(
        {
            "wales per cm": 12.0,
            "courses per cm": 17.0,
            "stitch density": 12 * 17,
            "length of yarn in a stitch": 3.0,
            "cover": 2e-4 / height,
            "thickness": 0.4,
            "tightness factor": sqrt(30.0) / 0.3,
            "mass per area": 30e-3 * 3e-3 * 12 * 17 * 1e4,
        },
        rel=0.01,
    )
    assert "mass per area" not in numbers(construction([line], 3e-3, (width, height, 1, 1), 1e-4, np.nan))


def test_two_yarns_have_the_sum_of_their_masses_and_widths():
    """Straight rows 1 mm apart, one of them thinner, lighter and 0.1 mm above the other; they have no one tightness."""
    lines = [np.array([[0.0, y, z], [1e-3, y, z]]) for y, z in ((0.5e-3, 0.0), (1.5e-3, 1e-4))]
    radius, tex = np.array([2e-4, 1e-4]), np.array([30.0, 10.0])
    actual = numbers(construction(lines, np.array([1e-3, 1e-3]), (1e-3, 2e-3, 1, 2), radius, tex))
    assert actual["cover"] == pytest.approx(0.3, abs=0.005)
    assert actual["mass per area"] == pytest.approx(1e-3 * (30.0 + 10.0) / 2e-3)
    assert actual["thickness"] == pytest.approx(0.4)
    assert "tightness factor" not in actual


def test_tex_is_the_density_times_the_area_of_a_section():
    assert tex_of(0.2e-3, 1000.0) == pytest.approx(1e6 * 1000 * pi * 1e-8)


@pytest.mark.parametrize("lift", [0.0, 0.07])  # a yarn that leaves the cell comes in again below
def test_a_line_at_an_angle_covers_its_width_over_its_distance_to_its_images(lift):
    slanted = np.column_stack(
        [np.linspace(0, 1, 400, endpoint=False), np.linspace(0, 1, 400, endpoint=False) + lift]
    )
    assert cover(slanted, 0.1, (1.0, 1.0)) == pytest.approx(0.2 * sqrt(2), abs=0.005)


def test_a_knit_and_its_endless_cell_are_one_fabric(plain_scene):
    loop = initial_loop(plain_scene)
    knit, cell, large = (
        numbers(drawn(fabric_dataset(each)))
        for each in (plain_knit(loop, 3, 3), endless_cell(loop, 1, 1), endless_cell(loop, 2, 2))
    )
    assert knit == pytest.approx(cell)
    assert large == pytest.approx(cell, abs=3e-3)
    assert cell["length of yarn in a stitch"] == pytest.approx(1e3 * loop.length)
    assert cell["stitch density"] == pytest.approx(1e-4 / (loop.wale_spacing * loop.course_spacing))


def test_two_yarns_that_cross_are_no_fabric():
    assert drawn(fabric_dataset(yarn_pair(1e-3, 90.0, 1e-2))) == []


def test_a_cell_of_beams_has_the_size_of_its_rest():
    """Four nodes of a yarn 4 mm long that has contracted to a width of 3 mm; its last node is not the image."""
    s = np.arange(4) * 1e-3
    place = np.column_stack([0.75 * s, 0 * s, 0 * s])
    history = xr.Dataset(
        {
            "yarn": ("station", [0] * 4),
            "arc_length": ("station", s),
            "centreline": (("station", "xyz"), np.column_stack([s, 0 * s, 0 * s])),
            "centreline_displacement": (
                ("increment", "station", "xyz"),
                [place - np.column_stack([s, 0 * s, 0 * s])],
            ),
        },
        attrs={"cell_width": 3e-3, "cell_height": 2e-3},
    )
    actual = numbers(at_rest(history, 2, 1, radius=1e-4, tex=100.0))
    assert actual["wales per cm"] == pytest.approx(20 / 3)
    assert actual["courses per cm"] == pytest.approx(5.0)
    assert actual["length of yarn in a stitch"] == pytest.approx(2.0)
    assert actual["cover"] == pytest.approx(0.1, abs=0.005)
    assert actual["mass per area"] == pytest.approx(1e3 * 100e-6 * 4e-3 / 6e-6)
    assert at_rest(history.drop_attrs(), 2, 1, 1e-4) == []


@pytest.mark.optional_packages
def test_loop_and_check_print_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    loop = CliRunner().invoke(main, "loop --course 0.9e-3 --wale 1.1e-3 --tex 30 --density 909".split())
    rows = dict(line.split("\t")[:2] for line in loop.stdout.splitlines() if "\t" in line)
    length = float(rows["length of yarn in a stitch"])  # mm
    assert float(rows["stitch density"]) == pytest.approx(1 / (0.09 * 0.11), rel=1e-4)
    assert float(rows["tightness factor"]) == pytest.approx(sqrt(30) / (0.1 * length), rel=1e-4)
    assert float(rows["mass per area"]) == pytest.approx(30e-3 * 1e-3 * length / (0.9e-3 * 1.1e-3), rel=1e-4)
    checked = CliRunner().invoke(main, ["check", "cell-course"]).stdout
    assert "stitch density 0.454 1/cm2" in checked
    assert "mass per area" not in checked


@pytest.mark.optional_packages
def test_loops_that_are_drawn_for_a_thinner_yarn_do_not_say_how_thick_the_fabric_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = load_scene("fabric-acrylic-rib-course-free")
    diameter = f"{scene.yarn.diameter:.6g}"
    made = lay_out(scene).assign_attrs(scene="rib")
    for file, keys in (
        ("kept.nc", {"scene_keys": json.dumps(scene.to_dict()), "source_keys": "{}"}),
        ("old.nc", {}),
    ):
        write_dataset(made.assign_attrs(keys), tmp_path / file)
    for command in (f"loop {scene.name}", "show kept.nc", "show old.nc"):
        ended = CliRunner().invoke(main, command.split())
        assert ended.exit_code == 0, ended.stderr
        rows = dict(line.split("\t")[:2] for line in ended.stdout.splitlines() if "\t" in line)
        if command != "show old.nc":
            assert rows["yarn diameter"] == diameter
            assert rows["cover"] == rows["thickness"] == rows["gap"] == AT_REST
        assert rows["length of yarn in a stitch"] == "16.1"
    checked = CliRunner().invoke(main, ["check", scene.name]).stdout
    assert f"cover {AT_REST}, thickness {AT_REST}, tightness factor 13.9 sqrt(tex)/cm" in checked
