"""A fabric comes back whole from its file, whatever it was made by, and fabrics from elsewhere are read."""

import sys

import numpy as np
import pandas as pd
import pytest

from knitstudy import registry
from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.files import write_dataset
from knitstudy.knit.geometry import readers
from knitstudy.knit.geometry.fabric import of_curves
from knitstudy.knit.geometry.fabric_file import fabric_dataset, fabric_of
from knitstudy.knit.geometry.loop import LoopTarget
from knitstudy.knit.geometry.readers import centreline, read_fabric
from knitstudy.knit.geometry.specimens import cut_cells, endless_cell, plain_knit, yarn_pair

RADIUS = 0.1e-3


def wave(shift, sign):
    """A yarn along x that passes over and under others."""
    x = np.linspace(0, 2e-3, 17)
    return np.stack([x, np.full(17, shift), sign * 1.05 * RADIUS * np.cos(2 * np.pi * x / 1e-3)], axis=1)


def weft(shift, sign):
    return wave(shift, sign)[:, [1, 0, 2]] + [0, -0.5e-3, 0]


YARNS = [wave(0.0, 1), wave(0.5e-3, -1), weft(0.5e-3, -1), weft(1e-3, 1)]


def garter():
    return LoopTarget(0.9e-3, 1.1e-3, RADIUS, 0.01, stitches=("K", "P")).drawn()


MADE = {
    "knit": lambda loop: plain_knit(loop, 2, 3),
    "cut_knit": lambda loop: cut_cells(loop, 2, 1),
    "cell": lambda loop: endless_cell(garter(), 1, 2),
    "pair": lambda loop: yarn_pair(RADIUS, 60.0, 2e-3, 0.1),
    "curves": lambda loop: of_curves([centreline(each) for each in YARNS], RADIUS),
}


@pytest.mark.parametrize("kind", MADE)
def test_a_fabric_comes_back_whole(knit, tmp_path, kind):
    fabric = MADE[kind](knit.loop)
    write_dataset(fabric_dataset(fabric), tmp_path / "a.nc")
    again = read_fabric(tmp_path / "a.nc")
    assert len(again.centrelines) == len(fabric.centrelines)
    for one, other in zip(again.centrelines, fabric.centrelines, strict=True):
        s = np.linspace(0, other.length, 7)
        assert one.position(s) == pytest.approx(other.position(s), abs=1e-9 * RADIUS)
    for name in ("size", "copy_of", "shift", "periods", "cell", "radius", "clearance", "repeats", "angle"):
        np.testing.assert_array_equal(getattr(again, name), getattr(fabric, name), err_msg=name)
    for name in vars(fabric.crossings):
        np.testing.assert_array_equal(getattr(again.crossings, name), getattr(fabric.crossings, name))
    assert again.grips.keys() == fabric.grips.keys()
    for load, pair in fabric.grips.items():
        for one, other in zip(again.grips[load], pair, strict=True):
            np.testing.assert_array_equal(one.yarn, other.yarn)
            np.testing.assert_array_equal(one.arc, other.arc)
            assert (one.side is None) == (other.side is None)
    assert (again.loop is None, again.sample is None) == (fabric.loop is None, fabric.sample is None)
    assert fabric_dataset(again).equals(fabric_dataset(fabric))


def table(**changes):
    rows = [(number, *point, RADIUS) for number, points in enumerate(YARNS) for point in points]
    return pd.DataFrame(rows, columns=list(readers.COLUMNS)).assign(**changes)


def test_a_table_of_centrelines_is_a_fabric(tmp_path):
    table().to_csv(tmp_path / "weave.csv", index=False)
    fabric = read_fabric(tmp_path / "weave.csv")
    assert len(fabric.crossings) == 4
    assert fabric.centrelines[0].position(np.zeros(1)) == pytest.approx(YARNS[0][:1], abs=1e-12)
    assert fabric_of(fabric_dataset(fabric)).radius == RADIUS


@pytest.mark.parametrize(
    ("spoilt", "message"),
    [
        (table(**{"radius [m]": 0.0}), r"column radius \[m\] holds \[0\.0\]"),
        (table()[:3], "a yarn has 3 points"),
        (table(**{"y [m]": "2 mm"}), r"row 2, column y \[m\] holds '2 mm' but must be a number"),
        (
            table(**{"radius [m]": 1e-3}),
            r"yarns overlap: .* m apart where they cross, .* radii less than a diameter",
        ),
        (table().drop(columns="z [m]"), r"z \[m\]"),
    ],
)
def test_a_table_that_is_no_fabric_is_refused(tmp_path, spoilt, message):
    spoilt.to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(DataFileError, match=message):
        read_fabric(tmp_path / "a.csv")


def test_a_table_in_millimetres(tmp_path):
    names = {name: name.replace("[m]", "[mm]") for name in readers.COLUMNS}
    lengths = {name: 1e3 for name in readers.COLUMNS[1:]}
    (table() * ({"yarn": 1} | lengths)).rename(columns=names).to_csv(tmp_path / "a.csv", index=False)
    assert read_fabric(tmp_path / "a.csv").radius == pytest.approx(RADIUS)


def test_millimetres_that_are_called_metres_are_questioned(tmp_path, caplog):
    (table() * ({"yarn": 1} | {name: 1e3 for name in readers.COLUMNS[1:]})).to_csv(
        tmp_path / "a.csv", index=False
    )
    read_fabric(tmp_path / "a.csv")
    assert "lengths in mm?" in caplog.text


PLUGIN = """
from knitstudy.knit.geometry.specimens import yarn_pair
from knitstudy.knit.geometry.readers import READERS, Reader
READERS.register(Reader(".pair", "radius of two yarns", lambda path: yarn_pair(float(path.read_text()), 90.0, 1e-2)))
"""


def test_a_plugin_of_one_file_adds_a_reader(tmp_path, monkeypatch):
    (tmp_path / "pairs_of_a_test.py").write_text(PLUGIN)
    (tmp_path / "a.pair").write_text("0.5e-3")
    with pytest.raises(
        ConfigurationError, match=r"unknown ending of a fabric file '\.pair'.*\.csv, \.k, \.knitout, \.nc"
    ):
        read_fabric(tmp_path / "a.pair")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(registry, "_imported", {})
    registry.load_plugins(["pairs_of_a_test"])
    assert read_fabric(tmp_path / "a.pair").radius == 0.5e-3
    readers.READERS._entries.pop(".pair")
    sys.modules.pop("pairs_of_a_test")
