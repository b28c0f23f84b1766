"""What people type, paste and leave behind: one line that names key or file, its value and the remedy, and status 1.

Keys out of their bounds stand in `test_scene.py`, families in `test_families.py`, usage in `test_cli.py`; here is what
is no number, name or file at all, what contradicts itself, and files that are something else.
"""

import pytest
import xarray as xr
from click.testing import CliRunner

from knitstudy.cli.main import main

STRAIN = "a number from -0.2 to 0.5, not 0 (0.05 is 5 %, -0.05 a compression)"
LENGTH = "a number > 0 and <= 1e6, in m"
COUNT = "a whole number from 1 to 10000"
NAME = "a name of at most 200 small letters, digits, - and _, that starts with a letter"
POINTS = "a list of at least 4 points x, y, z in m"


@pytest.fixture
def message(config, monkeypatch):
    """Return the only line that a command fails with, in the folder of a small configuration."""
    monkeypatch.chdir(config)

    def of(*arguments):
        where = () if arguments[0] == "show" or "--config" in arguments else ("--config", config)
        result = CliRunner().invoke(main, [str(each) for each in (*arguments, *where)])
        assert result.exit_code == 1, result.output
        assert type(result.exception) is SystemExit, result.exception
        assert result.stdout == ""
        (line,) = result.stderr.splitlines()
        assert line.startswith("error: ")
        return line

    return of


@pytest.mark.parametrize(
    ("key", "text", "value", "allowed"),
    [
        # Numbers that are none, and units that nobody asked for.
        ("load.strain", "5%", "'5%'", STRAIN),
        ("load.strain", "1e400", "inf", "a finite number"),
        ("mesh.size", "0.3 mm", "'0.3 mm'", LENGTH),
        # Whole numbers that are none.
        ("pattern.loops", "1e3", "1000.0", COUNT),
        # Names that are none.
        ("name", "../x", "'../x'", NAME),
        # Lists that are none, too short, or of something else.
        ("pattern.control_points", "[[0, 0, 0]]", "[[0, 0, 0]]", POINTS),
        # Limits of gates that would let everything or nothing pass.
        ("gates.ledger", "0", "0", "a number > 0, over the external work"),
    ],
)
def test_value_that_is_none(message, key, text, value, allowed):
    said = message("check", "dns-a", "--set", f"{key}={text}")
    assert said.startswith(f"error: scene 'dns-a': {key} ")
    assert f" {value} but must be " in said
    assert allowed in said.partition(" but must be ")[2]


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        (
            ["mesh.size=3e-4", "mesh.size=4e-4"],
            ("--set mesh.size is given 2 times, 0.0003 and 0.0004; once",),
        ),
        (["load.stops=[0.02]", "load.strain=0.01"], ("load.stops is [0.02]", "load.strain, 0.01")),
    ],
)
def test_keys_that_contradict_each_other(message, changes, parts):
    said = message("check", "dns-a", *(part for change in changes for part in ("--set", change)))
    for part in parts:
        assert part in said


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"\xff\xfe\x00a", "is no text in UTF-8 (byte 1); save it as such"),
        (b"", "must hold a mapping of keys to values"),
        (None, "cannot be read (Is a directory); a file must be there"),
    ],
)
def test_configuration_that_is_no_text(message, config, content, said):
    path = config / "defaults.yaml"
    path.unlink()
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)
    line = message("list")
    assert line.startswith(f"error: {path}")
    assert said in line


def foreign(path):
    xr.Dataset({"temperature": ("x", [1.0])}).to_netcdf(path)


def written(content):
    return lambda path: path.write_bytes(content)


@pytest.mark.parametrize(
    ("name", "make", "said"),
    [
        ("a.nc", foreign, "not a result of this study: it must have the variables of one of history"),
        ("a.nc", lambda path: path.mkdir(), "a.nc: is a folder; move it away, or name a file in it"),
        ("a.csv", written(b""), "is not a CSV table (No columns to parse from file); delete it"),
    ],
)
def test_result_that_is_none(message, config, name, make, said):
    make(config / name)
    line = message("show", name)
    assert f"{name}: " in line
    assert said in line
