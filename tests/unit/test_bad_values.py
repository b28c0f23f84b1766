"""What people type, paste and leave behind: one line that names key or file, its value and the remedy, and status 1.

Keys out of their bounds stand in `test_scene.py`, families in `test_families.py`, usage in `test_cli.py`; here is what
is no number, name or file at all, what contradicts itself, and files that are something else.
"""

import numpy as np
import pytest
import xarray as xr
import yaml
from click.testing import CliRunner

from knitstudy.cli.main import main
from knitstudy.errors import ConfigurationError
from knitstudy.study.campaign import load_campaign

STRAIN = "a number from -0.2 to 0.5, not 0 (0.05 is 5 %, -0.05 a compression)"
LENGTH = "a number > 0 and <= 1e6, in m"
COUNT = "a whole number from 1 to 10000"
NAME = "a name of at most 200 small letters, digits, - and _, that starts with a letter"
LABEL = "one geometry (at most 200 small letters, digits, - and _)"
POINTS = "a list of at least 4 points x, y, z in m"
STOPS = "a list of strains on the way, for example [0.01, 0.02], or []"


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
        ("load.strain", "5 %", "'5 %'", STRAIN),
        ("load.strain", "'0.1'", "'0.1'", STRAIN),
        ("load.strain", "", "None", STRAIN),
        ("load.strain", "[0.1]", "[0.1]", STRAIN),
        ("load.strain", "1e400", "inf", "a finite number"),
        ("mesh.size", "0.3 mm", "'0.3 mm'", LENGTH),
        ("mesh.size", "2e6", "2000000.0", LENGTH),
        ("yarn.youngs_modulus", "1.3 GPa", "'1.3 GPa'", "in Pa"),
        ("yarn.poisson_ratio", "50", "50", "between -1 and 0.5"),
        # Whole numbers that are none.
        ("pattern.loops", "3.0", "3.0", COUNT),
        ("pattern.loops", "1e3", "1000.0", COUNT),
        ("pattern.rows", "3x3", "'3x3'", COUNT),
        # Names that are none.
        ("name", "''", "''", NAME),
        ("name", "../x", "'../x'", NAME),
        ("name", "DNS", "'DNS'", NAME),
        ("name", 201 * "x", "'" + 119 * "x" + " ...", NAME),
        ("knit", "../x", "'../x'", LABEL),
        # Lists that are none, too short, or of something else.
        ("outputs", "fields vtu", "'fields vtu'", "a list of what is written besides"),
        ("pattern.control_points", "[[0, 0, 0]]", "[[0, 0, 0]]", POINTS),
        ("pattern.control_points", "[[0, 0], [1, 1], [2, 2], [3, 3]]", "the entry [0, 0]", POINTS),
        ("pattern.control_points", "[[0, 0, a], [1, 1, 1], [2, 2, 2], [3, 3, 3]]", "the entry 'a'", POINTS),
        ("load.stops", "[1 %]", "the entry '1 %'", STOPS),
        # Choices that are not there.
        ("solver.linear", "LU", "'LU'", "auto, three_scale, amg or lu"),
        ("mesh.element", "C3D8R", "'C3D8R'", "one_point (with hourglass"),
        ("load.lateral", "no", "False", "fixed or free"),
        # Limits of gates that would let everything or nothing pass.
        ("gates.ledger", "0", "0", "a number > 0, over the external work"),
        ("gates.elements_across", "0", "0", "or null for 3 of a knit and 7 of a pair"),
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
        (["yarn.diameter=0.02"], ("pattern.course_spacing is 0.0104 m", "exceed yarn.diameter, 0.02 m")),
        (["specimen=pair"], ("the key 'load.path' is missing", "a list of one displacement x, y, z in m")),
        (
            ["specimen=pair", "pattern.loops=2"],
            ("pattern.loops is no key of a scene", "specimen is pair", "leave it"),
        ),
        (["rom.joint=pinned"], ("rom.joint is no key", "fidelity hexahedra", "leave it out")),
        (
            ["specimen=pair", "fidelity=beam", "interaction=rough"],
            ("fidelity is 'beam' but must be", "is pair"),
        ),
        (["mesh.size.x=1"], ("unknown key 'mesh.size.x'",)),
        ([".size=1"], ("unknown key '.size'; allowed are beam, contact",)),
        (["mesh.=1"], ("unknown key 'mesh.'; allowed are element",)),
        (["pattern.loop=x.yaml"], ("unknown key 'pattern.loop' (did you mean 'loops'?)",)),
        (["mesh=fine"], ("mesh is 'fine' but must be a group of keys",)),
    ],
)
def test_keys_that_contradict_each_other(message, changes, parts):
    said = message("check", "dns-a", *(part for change in changes for part in ("--set", change)))
    for part in parts:
        assert part in said


def rewritten(path, **values):
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | values))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"\xff\xfe\x00a", "is no text in UTF-8 (byte 1); save it as such"),
        (b"yarn:\n  density: 905 \xb1 5\n", "is no text in UTF-8 (byte 22)"),
        (b"", "must hold a mapping of keys to values"),
        (b"yarn:\n\tdensity: 905", "is not YAML: line 2: "),
        (b"yarn: !!python/object:os.system x", "is not YAML: line 1: could not determine a constructor"),
        (b"yarn: {<<: {density: 1}}", "line 1: a key must be a text"),
        (b"PK\x03\x04" + 50 * b"\x00", "is not YAML: unacceptable character #x0003"),
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


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (
            {"diameter": "thick"},
            "defaults.yaml over loop.yaml: yarn.diameter is 'thick' but must be a number",
        ),
        ({"course_spacing": -1.0}, "over loop.yaml: pattern.course_spacing is -1.0 but must be a number > 0"),
        ({"diametre": 1e-3}, "loop.yaml: unknown key 'diametre' (did you mean 'diameter'?)"),
    ],
)
def test_loop_that_is_none(message, config, values, said):
    rewritten(config / "loop.yaml", **values)
    assert said in message("list")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("study: ci\nfolder: config\nplugins: mine\n", "plugins is 'mine' but must be a list of the dotted"),
        ("study: ci\nfolder: config\nplugins: [bad_sum]\n", "plugins: 'bad_sum' cannot be imported: Zero"),
        ("study: ci\nfolder: config\nplugins: [bad_code]\n", "plugins: 'bad_code' cannot be imported: Syn"),
    ],
)
def test_configuration_of_the_workflow_that_is_none(message, config, text, said):
    (config / "config.yaml").write_text(text)
    (config / "bad_sum.py").write_text("1 / 0\n")
    (config / "bad_code.py").write_text("def bad(:\n")
    assert said in message("list")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ("check", "dns-a", "--config", "loop.yaml"),
            "loop.yaml/defaults.yaml: cannot be read (Not a directory)",
        ),
        (("check", "loop.yaml"), "scenes: unknown scene 'loop.yaml'; allowed are dns-a, rom3d-a"),
        (("run", "results/dns/dns-a.nc"), "unknown scene 'results/dns/dns-a.nc'; allowed are dns-a"),
        (("show", "loop.yaml"), "loop.yaml: results are .nc and .csv files"),
    ],
)
def test_file_in_the_place_of_something_else(message, arguments, said):
    assert said in message(*arguments)


def foreign(path):
    xr.Dataset({"temperature": ("x", [1.0])}).to_netcdf(path)


def of_another_version(path):
    """A history whose force has gone, as of an earlier format."""
    names = ("load", "strain")
    data = {name: ("increment", np.linspace(0, 1, 3)) for name in names}
    xr.Dataset(data, attrs={"scene": "dns-a", "fidelity": "hexahedra"}).to_netcdf(path)


def truncated(path):
    foreign(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def written(content):
    return lambda path: path.write_bytes(content)


@pytest.mark.parametrize(
    ("name", "make", "said"),
    [
        ("a.nc", foreign, "not a result of this study: it must have the variables of one of history"),
        (
            "a.nc",
            of_another_version,
            "not a result of this study: it must have the variables of one of history",
        ),
        ("a.nc", truncated, "is truncated or is not netCDF"),
        ("a.nc", written(b""), "is truncated or is not netCDF"),
        ("a.nc", lambda path: path.mkdir(), "a.nc: is a folder; move it away, or name a file in it"),
        ("a.csv", written(b""), "is not a CSV table (No columns to parse from file); delete it"),
        ("a.csv", written(b"a,b\n1,2,3\n1\n4,5,6,7,8\n"), "Expected 3 fields in line 4, saw 5"),
        ("a.csv", lambda path: path.mkdir(), "Is a directory"),
    ],
)
def test_result_that_is_none(message, config, name, make, said):
    make(config / name)
    line = message("show", name)
    assert f"{name}: " in line
    assert said in line


CAMPAIGN = {
    "seed": 1,
    "limit": 1.0,
    "cheap": 1.0,
    "alone": {"strain": {"of": ["a"], "values": {"load.strain": [-1, 0.1]}}},
    "together": {"scenes": 2, "changed": 0.5, "of": ["a"], "keys": {"load.strain": {"even": [0.1, 0.2]}}},
}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"seed": -1}, "seed is -1 but must be a whole number from 0 on"),
        ({"sead": 1}, "unknown key 'sead' (did you mean 'seed'?)"),
        ({"alone": {"x": {"of": ["b"]}}}, "alone: x: unknown scene of scenes 'b'; allowed are a"),
        (
            {"alone": {"x": {"of": ["a"], "values": {"load.strane": [1]}}}},
            "unknown key 'load.strane' (did you mean",
        ),
        (
            {"together": CAMPAIGN["together"] | {"changed": 0}},
            "together: changed is 0 but must be a number > 0",
        ),
        (
            {"together": CAMPAIGN["together"] | {"keys": {"load.strain": {"odd": [1, 2]}}}},
            "together: load.strain is {'odd': [1, 2]} but must be a list of values, or even: [low, high]",
        ),
        (
            {"together": CAMPAIGN["together"] | {"keys": {"load.strain": {"decades": [0, 2]}}}},
            "together: load.strain is {'decades': [0, 2]} but must be",
        ),
    ],
)
def test_campaign_that_is_none(config, changes, said):
    path = config / "scenes" / "small.yaml"
    path.write_text(path.read_text().replace("dns-a", "extreme-a"))
    (config / "extremes.yaml").write_text(yaml.safe_dump(CAMPAIGN | changes))
    with pytest.raises(ConfigurationError) as error:
        load_campaign(config)
    assert said in str(error.value)
    assert str(error.value).startswith(f"{config / 'extremes.yaml'}: ")
    assert "\n" not in str(error.value)
