"""Damaged and hostile YAML and netCDF files: one line of an error, in time, and never a number that is none.

The damage is drawn from a fixed seed: a failure can be repeated.
"""

import json
import math
import os
import time
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from click.testing import CliRunner
from refusals import refusal

from knitstudy.datasets import read_dataset, recorded_digest, write_dataset
from knitstudy.errors import KnitstudyError
from knitstudy.knit.scene.documents import DEEPEST, LARGEST, parsed
from knitstudy.run.commands.main import main
from knitstudy.run.configuration import load_scene
from knitstudy.run.simulations import simulate

SEED = 95
LONGEST = 10.0  # seconds of one reading

SCENE = """studies: []
scenes:
- name: jersey
  keys:
    knit: jersey
    specimen: cell
    fidelity: beam
    interaction: friction
    pattern.course_spacing: 0.9e-3
    pattern.wale_spacing: 1.1e-3
    pattern.stitches: [K]
    pattern.loops: 1
    pattern.rows: 1
    pattern.control_points: null
    mesh.section_law: straight
    yarn.youngs_modulus: 200e6
    yarn.diameter: 0.25e-3
    load.deformation: course
    load.strain: 0.002
"""
MARKS = (
    "[",
    "]",
    "{",
    "}",
    ":",
    "- ",
    "*a",
    "&a ",
    "!!python/name:os.system ",
    "\t",
    "'",
    "|",
    "%",
    "\x00",
    "1e999",
    ".nan",
)


def damaged_text(text, random):
    """Return a text with a few characters deleted, doubled, or replaced by marks of YAML."""
    for _ in range(random.integers(1, 3)):
        place = int(random.integers(0, len(text)))
        end = place + int(random.integers(0, 4))
        inside = random.choice(
            [text[place:end] * 2, "", *(str(random.choice(MARKS)) * k for k in (1, 3, 40))]
        )
        text = text[:place] + str(inside) + text[end:]
    return text


def test_damaged_scenes_are_read_or_refused_in_time(tmp_path):
    """Many in one process: read as a scene, or refused in one line."""
    random, ended, lines = np.random.default_rng(SEED), {"read": 0, "refused": 0}, list[str]()
    path = tmp_path / "scenes.yaml"
    for number in range(80):
        path.write_text(damaged_text(SCENE, random), encoding="utf-8")
        started = time.monotonic()
        try:
            load_scene("jersey", path)
            ended["read"] += 1
        except KnitstudyError as error:
            lines.append(str(error))
            ended["refused"] += 1
        assert time.monotonic() - started < LONGEST, number
    assert min(ended.values()) > 0, ended
    assert not [line for line in lines if "\n" in line]


@pytest.mark.parametrize("opened", ["[", "{a: ", "- ", "? "])
@pytest.mark.parametrize("depth", [DEEPEST + 1, 1000, 100_000])
def test_yaml_that_is_nested_too_deep_is_refused_at_once(opened, depth):
    with refusal(rf"^here, line \d+: lists or mappings are nested more than {DEEPEST} deep|is not YAML"):
        parsed(opened * depth, "here")


def test_a_pipe_in_a_folder_of_scenes_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.yaml")
    with refusal("a.yaml: is a pipe; a file must be there"):
        load_scene("jersey", tmp_path)


def test_yaml_of_usual_depth_and_size_is_read():
    assert parsed("[" * DEEPEST + "]" * DEEPEST, "here") is not None
    with refusal(f"here: has {LARGEST + 1} characters; at most {LARGEST} are read"):
        parsed("a" * (LARGEST + 1), "here")


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """Content of the file of a history."""
    folder = tmp_path_factory.mktemp("result")
    (folder / "scenes.yaml").write_text(SCENE)
    scene = load_scene("jersey", folder / "scenes.yaml")
    return simulate(scene, folder, config=folder / "scenes.yaml").path.read_bytes()


@pytest.fixture
def history(result, tmp_path):
    """File of a history, to be spoilt."""
    path = tmp_path / "jersey.nc"
    path.write_bytes(result)
    return path


def test_damaged_results_are_refused_in_time(history):
    """Bytes that are changed, cut or added anywhere: what is read is what was written."""
    random, whole, expected = np.random.default_rng(SEED), history.read_bytes(), read_dataset(history)
    lines = []
    for number in range(300):
        content = bytearray(whole)
        match number % 3:
            case 0:
                content[int(random.integers(len(content)))] ^= int(random.integers(1, 256))
            case 1:
                start = int(random.integers(len(content)))
                content[start : start + 64] = random.bytes(64)
            case 2:
                del content[int(random.integers(len(content))) :]
        history.write_bytes(content)
        started = time.monotonic()
        try:
            assert read_dataset(history).identical(expected), number
        except KnitstudyError as error:
            lines.append(str(error))
        assert time.monotonic() - started < LONGEST, number
    assert len(lines) > 60  # most of a file is room that nothing fills
    assert not [line for line in lines if "\n" in line]
    history.write_bytes(whole)
    assert recorded_digest(history)


def edit(path, change):
    """Change a netCDF file as another program does."""
    with netCDF4.Dataset(path, "a") as file:
        change(file)


EDITS = {
    "keys": lambda file: file.setncattr("scene_keys", "[" * 100_000),
    "name": lambda file: file.setncattr("scene_keys", json.dumps({"name": "\x1b[31m"})),
    "value": lambda file: file["force"].__setitem__(slice(None), math.nan),
    "axis": lambda file: file.setncattr("axis", "none"),
    "attribute": lambda file: file.setncattr("title", "another"),
}


@pytest.mark.optional_packages
@pytest.mark.parametrize(
    ("damage", "arguments"),
    [
        ("keys", ("show", "a.nc")),
        ("name", ("show", "a.nc", "a.nc")),
        ("value", ("compare", "a.nc", "lab.csv")),
        ("axis", ("run", "a.nc")),
        ("attribute", ("export", "a.nc", "--dialect", "paraview")),
        ("", ("show", "a.nc")),
    ],
)
def test_commands_refuse_damaged_results_in_one_line(history, tmp_path, monkeypatch, damage, arguments):
    """The one that is whole is shown."""
    monkeypatch.chdir(tmp_path)
    Path("lab.csv").write_text("strain (%),force_per_width_N_m\n0,0\n2,10\n5,25\n10,50\n")
    history.rename("a.nc")
    if damage:
        edit("a.nc", EDITS[damage])
    ended = CliRunner().invoke(main, arguments)
    assert ended.exit_code == (1 if damage else 0)
    assert len(ended.stderr.splitlines()) == (1 if damage else 0)
    assert "nan" not in ended.stdout
    assert "\x1b" not in ended.output
    assert not Path("runs").exists()


def test_a_history_whose_numbers_are_none_is_refused(history):
    """Not only damage: a program may write them with a right checksum."""
    data = read_dataset(history)
    data["force"][1] = math.nan
    write_dataset(data, history)
    with refusal(r"jersey\.nc: force holds a value that is not a number"):
        read_dataset(history)
