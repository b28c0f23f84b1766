"""Results are used again where they belong to the same inputs, and only there."""

import os

import pytest
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.stages.archive import Archive
from knitstudy.study.configuration import load_knits, load_scenes


@pytest.fixture
def archive(config, tmp_path):
    return Archive.of(tmp_path / "results", config)


class Stage:
    """Computes another number every time."""

    def __init__(self):
        self.calls = 0

    def __call__(self):
        self.calls += 1
        return xr.Dataset({"number": self.calls})


def test_scenes_of_the_table_keep_their_names(archive, config):
    for name, scene in load_scenes(config).items():
        assert archive.labelled(scene) == scene
        assert archive.path("dns", scene) == archive.folder / "dns" / f"{name}.nc"
        assert archive.knit_of(scene) == load_knits(config)[scene.knit]


def test_changed_scenes_get_names_of_their_own(archive):
    scene = archive.scenes["dns-a"]
    varied = archive.labelled(scene.vary({"load.strain": 0.01}))
    assert varied.name == f"dns-a-{varied.hash[:8]}"
    assert varied.knit == "plain"
    assert archive.labelled(varied) == varied
    named = archive.labelled(scene.vary({"load.strain": 0.01, "name": "mine"}))
    assert named.name == "mine"


def test_changed_geometries_get_names_of_their_own(archive):
    varied = [
        archive.labelled(scene.vary({"pattern.loops": 2}))
        for scene in (archive.scenes["dns-a"], archive.scenes["rom3d-a"])
    ]
    first, second = map(archive.knit_of, varied)
    assert first == second
    assert first.name == f"plain-{varied[0].geometry_key[:8]}"
    assert first.geometry_key == varied[0].geometry_key != archive.knits["plain"].geometry_key


def test_file_of_the_same_inputs_is_used_again(archive):
    scene, stage = archive.scenes["dns-a"], Stage()
    archive.keep("dns", scene, stage)
    again = archive.keep("dns", scene, stage)
    assert (stage.calls, int(again["number"])) == (1, 1)
    assert again.attrs["scene_hash"] == scene.hash


@pytest.mark.parametrize(
    "asked",
    [
        {"scene": {"load.strain": 0.01, "name": "dns-a"}},
        {"needs": ["number", "other"]},
        {"after": "newer"},
        {"anew": True},
    ],
)
def test_file_of_other_inputs_is_replaced(archive, tmp_path, asked):
    scene, stage = archive.scenes["dns-a"], Stage()
    archive.keep("dns", scene, stage)
    other = scene.vary(asked.get("scene", {}))
    options = {key: value for key, value in asked.items() if key != "scene"}
    if "after" in asked:
        options["after"] = [None, touched(tmp_path / "newer.nc", archive.path("dns", scene), 1)]
    assert int(archive.keep("dns", other, stage, **options)["number"]) == 2
    kept = xr.load_dataset(archive.path("dns", scene))
    assert (kept["number"], kept.attrs["scene_hash"]) == (2, other.hash)


def touched(path, other, seconds):
    """Make a file so many seconds younger than another one."""
    path.touch()
    time = other.stat().st_mtime + seconds
    os.utime(path, (time, time))
    return path


def test_file_that_is_younger_than_its_inputs_is_used_again(archive, tmp_path):
    scene, stage = archive.scenes["dns-a"], Stage()
    archive.keep("dns", scene, stage)
    older = touched(tmp_path / "older.nc", archive.path("dns", scene), -1)
    archive.keep("dns", scene, stage, after=[older, None])
    assert stage.calls == 1


def test_failure_leaves_what_was_there(archive):
    scene = archive.scenes["dns-a"]
    archive.keep("dns", scene, Stage())
    before = archive.path("dns", scene).read_bytes()

    def fail():
        raise DataFileError("no")

    with pytest.raises(DataFileError):
        archive.keep("dns", scene, fail, anew=True)
    assert archive.path("dns", scene).read_bytes() == before


def test_damaged_file_is_named(archive):
    path = archive.path("dns", archive.scenes["dns-a"])
    path.parent.mkdir(parents=True)
    path.write_bytes(b"CDF")
    with pytest.raises(DataFileError, match=r"dns-a\.nc: is truncated or is not netCDF"):
        archive.keep("dns", archive.scenes["dns-a"], Stage())


def test_without_a_folder_nothing_is_written(config, tmp_path):
    archive, before = Archive.of(None, config), set(tmp_path.rglob("*"))
    stage = Stage()
    for _ in range(2):
        archive.keep("dns", archive.scenes["dns-a"], stage)
    assert stage.calls == 2
    assert set(tmp_path.rglob("*")) == before
