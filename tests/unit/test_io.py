"""Files are written whole or not at all, and reading a bad one says what to do."""

import os

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.files.csv_table import read_table, write_table
from knitstudy.files.netcdf import read_dataset, recorded_digest, write_dataset
from knitstudy.files.replacing import replacing
from knitstudy.study.configuration import load_scene


@pytest.fixture
def dataset():
    force = np.random.default_rng(0).normal(size=5000)
    return xr.Dataset({"force": ("increment", force, {"units": "N"})})


def test_replacing_keeps_the_old_file_until_the_new_one_is_whole(tmp_path):
    path = tmp_path / "folder" / "a.csv"
    with replacing(path) as temporary:
        temporary.write_text("old")
        assert not path.exists()
    with pytest.raises(ZeroDivisionError), replacing(path) as temporary:
        temporary.write_text(f"half {1 / 0}")
    assert path.read_text() == "old"
    assert os.listdir(path.parent) == ["a.csv"]


def test_replacing_says_when_nothing_was_written(tmp_path):
    with pytest.raises(DataFileError, match=r"a\.nc: nothing was written"), replacing(tmp_path / "a.nc"):
        pass


def test_replacing_into_something_that_is_no_folder(tmp_path):
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(DataFileError, match="the folder cannot be made"),
        replacing(tmp_path / "file" / "a.nc"),
    ):
        pass


def test_dataset_round_trip_with_provenance(tmp_path, config, dataset):
    scene = load_scene("dns-a", config)
    write_dataset(dataset, tmp_path / "a.nc", scene, digest="beef")
    read = read_dataset(tmp_path / "a.nc")
    xr.testing.assert_equal(read, dataset)
    assert read.force.units == "N"
    assert (read.scene, read.digest) == (scene.name, "beef") == ("dns-a", recorded_digest(tmp_path / "a.nc"))
    assert read.numpy == np.__version__
    assert {"code_version", "scipy", "pyamg"} <= set(read.attrs)
    (tmp_path / "a.nc").unlink()
    assert read.force.sum() == dataset.force.sum(), "the file is closed and all of it is in memory"


def test_missing_dataset(tmp_path):
    with pytest.raises(DataFileError, match=r"b\.nc: there is no such file; make it with `make study`"):
        read_dataset(tmp_path / "b.nc")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99])
def test_truncated_dataset(tmp_path, dataset, share):
    path = tmp_path / "a.nc"
    write_dataset(dataset, path)
    os.truncate(path, int(share * path.stat().st_size))
    with pytest.raises(DataFileError, match=r"a\.nc: is truncated or is not netCDF .* delete it"):
        read_dataset(path)


def test_dataset_of_other_content(tmp_path):
    (tmp_path / "b.nc").write_text("name,value\n")
    with pytest.raises(DataFileError, match=r"b\.nc: is truncated or is not netCDF"):
        read_dataset(tmp_path / "b.nc")


def test_table_round_trip_and_its_errors(tmp_path):
    path = tmp_path / "a.csv"
    table = pd.DataFrame({"scene": ["a"], "force [N]": [1.5]})
    write_table(table, path)
    pd.testing.assert_frame_equal(read_table(path, needs=["force [N]"]), table)
    with pytest.raises(DataFileError, match=r"has no column 'strain', only 'scene', 'force \[N\]'"):
        read_table(path, needs=["strain"])
    with pytest.raises(DataFileError, match="there is no such file"):
        read_table(tmp_path / "b.csv")
    path.write_text("")
    with pytest.raises(DataFileError, match="is not a CSV table"):
        read_table(path)
