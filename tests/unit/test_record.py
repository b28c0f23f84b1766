"""A result file names its scene, and can be run again from that alone."""

import json

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from refusals import REFUSED, refusal

from knitstudy import errors
from knitstudy.datasets import read_dataset, write_dataset
from knitstudy.run.commands.main import main
from knitstudy.run.configuration import load_scene
from knitstudy.run.plan import Plan
from knitstudy.run.simulations import simulate
from knitstudy.run.store import described, keys_of, recorded_scenes

SMALL = {"pattern.loops": 1, "pattern.rows": 1, "rom.contacts_from": None, "solver.increments": 1}


def command(*arguments):
    return CliRunner().invoke(main, [str(each) for each in arguments])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of one cell of a network, under a name that the configuration does not have."""
    folder = tmp_path_factory.mktemp("results")
    simulate(load_scene("rom3d-tie-course-coarse").vary(SMALL | {"name": "mine"}), folder)
    return folder


@pytest.fixture
def file(folder):
    return folder / "simulation" / "mine.nc"


def test_files_follow_the_conventions_and_describe_their_variables(folder):
    for path in folder.glob("*/*.nc"):
        data = xr.open_dataset(path)
        assert data.Conventions == "CF-1.11"
        assert "mine" in data.title
        assert "knitstudy" in data.source
        for name, variable in data.variables.items():
            assert variable.attrs["long_name"], name
            assert variable.dtype.kind in "OSU" or variable.attrs["units"], name
    assert data.force.coords["strain"].dims == ("increment",)
    assert data.swap_dims(increment="strain").force.interp(strain=0.005) > 0


@pytest.mark.optional_packages
def test_a_file_alone_gives_the_same_bits_again(file, tmp_path):
    again = command("run", file, "--force", "-o", tmp_path)
    assert again.exit_code == 0, again.output
    assert "the same as in" in again.stderr
    assert "mine.nc, to the last bit, but for times" in again.stderr
    softer = command("run", file, "--set", "yarn.youngs_modulus=0.65e9", "-o", tmp_path)
    assert softer.exit_code == 0, softer.output
    rows = command("show", file, softer.stderr.splitlines()[-1].rstrip(":")).stdout.splitlines()
    assert any(row.startswith("yarn.youngs_modulus\t1.3e+09\t6.5e+08") for row in rows)
    (force,) = [row.split("\t") for row in rows if row.startswith("force along the load")]
    assert float(force[3]) == pytest.approx(0.5, rel=1e-5), "forces scale with the modulus"


@pytest.mark.optional_packages
def test_keys_that_differ_from_defaults_come_first(file):
    rows = [row.split("\t") for row in command("show", file, "--keys").stdout.splitlines()]
    assert rows[0] == ["key", "value", "default", "unit"]
    assert ["pattern.loops", "1", "3", "1"] in rows
    changed = [row[2] != "" for row in rows[1:]]
    assert changed == sorted(changed, reverse=True)
    assert {row[0] for row in rows[1:]} >= {"yarn.youngs_modulus", "mesh.beam_size"}


def test_scenes_and_those_that_they_name_survive_the_file(config, tmp_path):
    plan = Plan.of(config)
    scene = plan.scenes["rom3d-a"]
    data = described(xr.Dataset({"strain": ("increment", [0.0])}), plan.step("simulation", scene))
    write_dataset(data, tmp_path / "a.nc")
    actual, sources = recorded_scenes(read_dataset(tmp_path / "a.nc"), "a.nc")
    assert (actual, sources) == (scene, {"dns-a": plan.scenes["dns-a"]})
    other = {"dns-a": sources["dns-a"].replace("mesh.size", 0.5)}
    source = Plan.with_scenes(other, config).named(actual, "rom.contacts_from")
    assert source.mesh.size == 0.5, "the file counts"
    assert source.name.startswith("dns-a-"), "the scene of the configuration keeps its results"


@pytest.mark.parametrize(("attributes", "error", "message"), REFUSED["results"])
def test_files_without_keys_are_refused_by_one_line(attributes, error, message):
    with refusal(message, getattr(errors, error)):
        recorded_scenes(xr.Dataset(attrs=attributes), "old.nc")


@pytest.mark.optional_packages
def test_a_file_from_before_is_shown_and_compared(file, tmp_path):
    old = read_dataset(file)
    write_dataset(old.drop_attrs(deep=False).assign_attrs(scene="\x1b[2Jold"), tmp_path / "old.nc")
    shown = command("show", file, tmp_path / "old.nc")
    assert shown.exit_code == 0
    assert "old.nc: has no keys of its scene" in shown.stderr
    assert "force along the load at the end" in shown.stdout
    assert "\\x1b[2Jold" in shown.stdout
    assert "\x1b" not in shown.output


def test_a_variable_of_another_bit_is_named(file, tmp_path):
    data = read_dataset(file)
    force = data["force"].values.copy()
    force[-1] = np.nextafter(force[-1], 1.0)
    keys, _ = keys_of(data, file)
    changed = data.assign(
        force=data["force"].copy(data=force), seconds=data["seconds"].copy(data=2 * data["seconds"])
    )
    write_dataset(changed.assign_attrs(scene_keys=json.dumps(keys)), tmp_path / "a.nc")
    message = command("run", tmp_path / "a.nc", "--force", "-o", tmp_path).stderr.splitlines()[-1]
    assert message.startswith(f"not the same as in {tmp_path / 'a.nc'}, made by knitstudy")
    assert message.endswith(": force")
