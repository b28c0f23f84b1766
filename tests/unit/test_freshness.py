"""Files by which the workflow engine, which compares times, learns what is up to date."""

import os

import pytest
import xarray as xr

from knitstudy.files import write_dataset
from knitstudy.stages import freshness
from knitstudy.stages.plan import Plan
from knitstudy.stages.table import STAGES
from knitstudy.study.configuration import load_scenes


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def time(path):
    return path.stat().st_mtime


def test_a_result_of_its_digest_is_newer_than_it_whoever_made_it(folder):
    result, noted = folder / "a.nc", freshness.FOLDER / "dns" / "a.nc"
    write_dataset(xr.Dataset(), result, digest="one")
    assert freshness.note("dns/a.nc", "one", result)
    assert noted.read_text() == "one"
    assert time(noted) < time(result)


def test_a_result_of_another_digest_is_older(folder):
    result, noted = folder / "a.nc", freshness.FOLDER / "dns" / "a.nc"
    write_dataset(xr.Dataset(), result, digest="one")
    os.utime(result, (1, 1))
    assert freshness.note("dns/a.nc", "one", result)
    assert not freshness.note("dns/a.nc", "two", result)
    assert time(noted) > time(result)
    # The engine takes files of the same content for the same: what is wrong is part of it.
    assert noted.read_text() == "two instead of one"
    before = time(noted)
    assert not freshness.note("dns/a.nc", "two", result)
    assert time(noted) == before, "nothing is written anew that says the same"
    write_dataset(xr.Dataset(), result, digest="two")
    assert freshness.note("dns/a.nc", "two", result)
    assert time(noted) < time(result)


def test_what_cannot_be_read_is_not_up_to_date(folder, caplog):
    result = folder / "a.nc"
    result.write_bytes(b"no netCDF")
    assert not freshness.note("dns/a.nc", "one", result)
    assert "is truncated or is not netCDF" in caplog.text
    assert "it will be made again" in caplog.text


def test_without_a_recorded_digest_only_another_one_counts(folder):
    noted = freshness.FOLDER / "figures" / "fig01"
    freshness.note("figures/fig01", "one")
    os.utime(noted, (1, 1))
    freshness.note("figures/fig01", "one")
    assert time(noted) == 1
    freshness.note("figures/fig01", "two")
    assert time(noted) > 1


def test_a_result_is_dated_after_what_it_is_made_from(folder, config):
    scenes = load_scenes(config)
    plan, results, scene = Plan(scenes), folder / "results", scenes["dns-a"]
    files = {}
    for name, seconds in (("geometry", 10), ("mesh", 30), ("simulation", 20)):
        stage = STAGES[name]
        files[name] = results / stage.path(scene)
        write_dataset(xr.Dataset(), files[name], digest=plan.digest(stage, scene))
        os.utime(files[name], (seconds, seconds))
    freshness.note_all(plan, scenes.values(), results)
    assert [time(files[name]) for name in files] == [10, 30, 30]
