"""The command parses and prints, and ends with one message where something is wrong."""

import contextlib
import io
import logging
import os
import re
import sys
from importlib import import_module
from pathlib import Path

import pytest
from click import UsageError
from click.testing import CliRunner
from refusals import REFUSED
from synthetic import geometry

from knitstudy.datasets import write_dataset
from knitstudy.errors import ConfigurationError, ConvergenceError, EndedEarly
from knitstudy.knit.scene.documents import CONFIG
from knitstudy.run.commands.main import main
from knitstudy.run.commands.run import log_on_console
from knitstudy.run.configuration import own_scenes
from knitstudy.run.simulations import Results

ROOT = Path(__file__).parents[2]


@pytest.fixture
def knitstudy(monkeypatch, tmp_path):
    """Run the command in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(main, [str(each) for each in arguments])


def table(result):
    assert result.exit_code == 0, result.stderr
    return [line.split("\t") for line in result.stdout.splitlines()]


def message(result):
    """Return the only line of a command that failed."""
    assert result.exit_code == 1
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    return line


@pytest.mark.optional_packages
def test_help_and_completion_import_no_library_of_results_and_no_model(printed_and_imported):
    """A command starts in a third of the time: half of a second is what a shell waits for a completion."""
    code = (
        "from click.testing import CliRunner; from knitstudy.run.commands.main import main;"
        "from knitstudy.run.configuration import load_families; load_families();"
        "ended = [CliRunner().invoke(main, [name, '--help']).exit_code for name in ('run', 'show', 'plan', 'export')];"
        "print(ended)"
    )
    assert printed_and_imported(code) == ["[0, 0, 0, 0]", "[]"]


OPTIONAL_USAGE = [
    pytest.param(*each, marks=pytest.mark.optional_packages) for each in REFUSED["optional_usage"]
]


@pytest.mark.parametrize(("arguments", "reason"), [*REFUSED["usage"], *OPTIONAL_USAGE])
def test_wrong_usage_has_status_2(knitstudy, arguments, reason):
    result = knitstudy(*arguments)
    assert result.exit_code == 2
    assert reason in result.stderr


def test_list(knitstudy, config):
    columns, *rows = table(knitstudy("list", "--config", config))
    assert columns == ["scene", "family", "studies", "differs from defaults"]
    assert rows == [
        ["dns-a", "small", "ci,reduced", ""],
        ["rom3d-a", "small", "reduced", "fidelity=rom3d, load.strain=0.02, rom.contacts_from=dns-a"],
    ]
    for option, name in (("--study=ci", "dns-a"), ("--fidelity=rom3d", "rom3d-a")):
        assert [row[0] for row in table(knitstudy("list", "--config", config, option))] == ["scene", name]
    assert len(table(knitstudy("list", "--config", config, "--family", "small"))) == 3
    wrong = message(knitstudy("list", "--config", config, "--family", "smal"))
    assert wrong == "error: unknown family 'smal' (did you mean 'small'?); allowed are small"


def test_check_folder(knitstudy, config):
    for arguments in (("check", config), ("check", "--config", config)):
        result = knitstudy(*arguments)
        assert result.exit_code == 0
        assert (
            "valid; 2 scenes (1 of study ci, 2 of study reduced, 0 of study full, 0 of study reference, "
            "0 of study fabrics), 1 geometries" in result.stdout
        )
    path = config / "scenes" / "small.yaml"
    path.write_text(path.read_text().replace("2e-2", "-1"))
    assert "small.yaml, scene 'rom3d-a': load.strain is -1 but must be a number from -0.2" in message(
        knitstudy("check", config)
    )


def test_check_of_a_file_says_which_scene_it_checked(knitstudy, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "studies: []\nscenes:\n- name: mine\n"
        "  keys: {knit: plain3x3, fidelity: rom3d, rom.contacts_from: dns-tie-course}\n"
    )
    ended = knitstudy("check", path)
    assert ended.exit_code == 0, ended.stderr
    first, second = ended.stdout.splitlines()
    assert first == f"{path}: valid; scene mine"
    assert second == f"knitstudy check mine --config {path} shows all keys of mine"


def test_keys_that_nothing_reads_are_not_listed(knitstudy, monkeypatch):
    """A modulus beside the stiffnesses of a yarn; where the yarn has none, it is read."""
    monkeypatch.setattr("knitstudy.run.commands.scenes._checked_loop", lambda scene: "loop: as drawn")
    soft, plain = ("fabric-acrylic-stockinette-course-free", "cell-course")
    listed = {name: {row[0] for row in table(knitstudy("check", name))} for name in (soft, plain)}
    assert "yarn.bending" in listed[soft]
    assert "yarn.youngs_modulus" not in listed[soft]
    assert "yarn.youngs_modulus" in listed[plain]


ESCAPE = "\x1b[31mred\x07"


def test_nothing_from_a_file_reaches_the_terminal_as_a_command_of_it(knitstudy, tmp_path, caplog):
    """Escape sequences in names and keys of scenes, in columns of tables, and in messages of the log."""
    quoted = ESCAPE.encode("unicode_escape").decode()
    path = tmp_path / "mine.yaml"
    for keys in (
        f'"{quoted}": 1',
        f'yarn.of: "{quoted}"',
        f'pattern.stitches: ["{quoted}"]',
        f'fidelity: "{quoted}"',
    ):
        path.write_text(f"studies: []\nscenes:\n- {{name: mine, keys: {{knit: mine, {keys}}}}}\n")
        assert "red" in message(knitstudy("check", path))
    Path("a.csv").write_text(f"{ESCAPE},b\n{ESCAPE},2\n")
    shown = knitstudy("show", "a.csv")
    assert shown.stdout.count("red") == 2
    stream = io.StringIO()
    with contextlib.redirect_stderr(stream), log_on_console(verbose=True):
        logging.getLogger("knitstudy.run.store").warning("%s\nsecond line é", ESCAPE)
    assert stream.getvalue() == "\\x1b[31mred\\x07\nsecond line é\n"
    for text in (shown.output, stream.getvalue()):
        assert "\x1b" not in text


def test_check_scene(knitstudy, config, monkeypatch):
    monkeypatch.setattr("knitstudy.run.commands.scenes._checked_loop", lambda scene: "loop: as drawn")
    change = ("--config", config, "--set", "mesh.size=0.4", "--set", "load.stops=[0.01, 2e-2]")
    Path("dns-a").mkdir()  # a folder that is called as the scene
    rows = table(knitstudy("check", "dns-a", *change))
    assert rows[0] == ["key", "value", "unit", "role", "provenance"]
    assert ["mesh.size", "0.4", "yarn radii", "resolution", "set here"] in rows
    assert ["load.stops", "[0.01, 0.02]", "1", "output", "set here"] in rows
    columns, *rows = table(knitstudy("check", "dns-a", *change, "--sources"))
    assert columns == ["key", "value", "unit", "role", "provenance", "source", "checked"]
    (size,) = [row for row in rows if row[0] == "mesh.size"]
    assert size[:5] == ["mesh.size", "0.4", "yarn radii", "resolution", "set here"]
    assert size[5] == "default: stated, Table 5: 0.3 mm, of a radius of 0.9 mm"


def test_sources_are_those_of_the_value_and_not_of_the_default(knitstudy, monkeypatch):
    monkeypatch.setattr("knitstudy.run.commands.scenes._checked_loop", lambda scene: "loop: as drawn")
    scene = ("check", "fabric-acrylic-stockinette-course-free", "--sources")
    rows = {
        row[0]: row[4:6] for row in table(knitstudy(*scene, "--set", "pattern.courses_per_metre=500"))[:-1]
    }
    assert rows["load.strain"][0] == "set by the scene"
    assert rows["load.strain"][1].startswith("default: stated, Section 3.1: 5 %")
    assert rows["pattern.course_spacing"][0] == "set here"
    assert rows["yarn.bending"][0] == "printed"
    assert rows["yarn.bending"][1].startswith("Singal et al. 2024")
    assert rows["pattern.loop_length"] == ["printed", "Singal et al. 2024, files of their simulations"]
    assert rows["pattern.clearance"][0] == "assumed"


def test_plugins_of_another_configuration_run_only_if_named(knitstudy, config, monkeypatch):
    (config / "config.yaml").write_text("study: ci\nfolder: config\nplugins: [plugin_of_a_test]\n")
    named = ("--plugin", "plugin_of_a_test")
    reason = "plugins: 'plugin_of_a_test' cannot be imported: No module named 'plugin_of_a_test'"
    for arguments in (("list", "--config", config), ("check", config), ("run", "dns-a", "--config", config)):
        assert reason in message(knitstudy(*arguments, *named))
    module = config / "plugin_of_a_test.py"
    module.write_text("from pathlib import Path\n\nPath('ran').touch()\n")
    monkeypatch.syspath_prepend(config)
    checked = knitstudy("check", config)
    assert "plugin 'plugin_of_a_test' was not run" in checked.stderr
    assert (checked.exit_code, (config / "ran").exists()) == (0, False)
    checked = knitstudy("check", config, *named)
    assert (checked.exit_code, checked.stderr, (config / "ran").exists()) == (0, "", True)
    (config / "config.yaml").write_text("study: ci\nfolder: config\nplugin: []\n")
    assert "unknown key 'plugin' (did you mean 'plugins'?)" in message(knitstudy("check", config))


@pytest.mark.parametrize(("when_imported", "when_run", "reason"), REFUSED["plugins"])
def test_plugin_that_exits_or_raises_ends_a_run(
    knitstudy, config, monkeypatch, when_imported, when_run, reason
):
    (config / "ends.py").write_text(
        f"{when_imported}\ndef simulate(*scene, **options):\n    {when_run or 'pass'}\n"
    )
    monkeypatch.syspath_prepend(config)
    monkeypatch.delitem(sys.modules, "ends", raising=False)
    if when_run:
        monkeypatch.setattr("knitstudy.run.simulations.simulate", import_module("ends").simulate)
    assert reason in message(knitstudy("run", "dns-a", "--config", config, "--plugin", "ends"))


def test_installed_plugin_by_its_entry_point(knitstudy, config, tmp_path, monkeypatch):
    about = tmp_path / "wool-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: wool\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[knitstudy.plugins]\nwool = wool_laws\n")
    (tmp_path / "wool_laws.py").write_text("from pathlib import Path\n\nPath('ran').touch()\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert knitstudy("check", config).exit_code == 0
    assert not (tmp_path / "ran").exists()
    assert knitstudy("check", config, "--plugin", "wool").exit_code == 0
    assert (tmp_path / "ran").exists()


JERSEY_FILE = """\
studies: []
scenes:
- name: jersey
  case: isotropic-course
  keys: {knit: jersey, fidelity: spline_yarns, pattern.course_spacing: 0.9e-3, pattern.wale_spacing: 1.1e-3,
    yarn.diameter: 0.25e-3}
"""


@pytest.mark.parametrize("place", ["jersey.yaml", "mine/jersey.yaml", "mine/scenes/jersey.yaml"])
def test_scenes_of_ones_own_beside_those_of_knitstudy(knitstudy, tmp_path, simulated, place):
    path = tmp_path / place
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(JERSEY_FILE)
    config = path if place == path.name else "mine"
    names = [row[0] for row in table(knitstudy("list", "--config", config))]
    assert names[-1] == "jersey"
    assert "dns-tie-course" in names
    knitstudy("run", path)
    assert (simulated["scene"].name, simulated["scene"].yarn.diameter) == ("jersey", 0.25e-3)
    path.write_text(JERSEY_FILE.replace("jersey\n", "dns-tie-course\n"))
    assert "is defined twice; first in the family '2-hexahedra'" in message(knitstudy("check", config))
    family = Path(os.path.relpath(CONFIG / "scenes" / "2-hexahedra.yaml"))
    assert "valid; " in knitstudy("check", family).stdout
    assert own_scenes(family)[0] == "dns-tie-course"


def test_file_of_several_scenes_and_none(knitstudy, tmp_path):
    assert message(knitstudy("run", "nix.yaml")) == "error: nix.yaml: there is no such file"
    (tmp_path / "two.yaml").write_text(
        JERSEY_FILE + JERSEY_FILE[JERSEY_FILE.index("- name") :].replace("jersey", "b")
    )
    assert "two.yaml: has the scenes jersey, b; name one of them, with --config two.yaml" in message(
        knitstudy("check", "b", "--config", "two.yaml", "--set", "youngs_modulus=1")
        and knitstudy("run", "two.yaml")
    )


@pytest.mark.parametrize(("arguments", "reason"), REFUSED["commands"])
def test_wrong_scenes_end_with_one_message_of_near_names(knitstudy, arguments, reason):
    line = message(knitstudy(*arguments))
    assert re.search(reason, line), line
    assert len(line) < 300


def test_completion_of_scenes_and_keys(knitstudy, config):
    def completed(*words):
        asked = {
            "_MAIN_COMPLETE": "bash_complete",
            "COMP_WORDS": " ".join(("main", *words)),
            "COMP_CWORD": str(len(words)),
        }
        return CliRunner().invoke(main, env=asked, prog_name="main").stdout.split()

    assert completed("run", "--config", str(config), "d") == ["plain,dns-a"]
    assert completed("run", "dns-a", "--set", "yarn.y") == ["plain,yarn.youngs_modulus="]


@pytest.mark.optional_packages
def test_deck(knitstudy, tmp_path):
    coarse = ("--set", "mesh.size=0.66", "--set", "gates.elements_across=3", "--dialect", "calculix")
    result = knitstudy("export", "pair-slid-90", *coarse, "--set", "name=coarse")
    (hexahedra,) = re.findall(r"(\d+) hexahedra", result.stdout)
    text = (tmp_path / "coarse.calculix.inp").read_text()
    assert "*CONTACT PAIR" in text
    assert re.search(rf"^{hexahedra}, ", text, flags=re.MULTILINE)


@pytest.mark.optional_packages
def test_no_refusal_of_a_deck_leads_to_another(knitstudy, tmp_path):
    """What refuses the deck of a cell names the fidelity and the interactions that have one, and these do."""
    for change in ("fidelity=beam", "interaction=tie"):
        line = message(knitstudy("export", "cell-course-isotropic", "--set", change, "--dialect", "calculix"))
        assert "a cell with fidelity spline_yarns and interaction friction or rough" in line
        assert "--dialect shell" in line
    result = knitstudy("export", "cell-course-isotropic", "--set", "mesh.span=1.8", "--dialect", "calculix")
    assert re.search(r"\d+ hexahedra; m, N, Pa\n$", result.stdout), result.stderr
    assert "*EQUATION" in (tmp_path / "cell-course-isotropic.calculix.inp").read_text()


@pytest.fixture
def simulated(monkeypatch, knit):
    """Take the place of the simulation, and return its arguments."""
    asked = {}

    def simulate(scene, folder, **options):
        asked.update(scene=scene, folder=folder, **options)
        return Results(scene, None, geometry(knit), path=folder / "simulation" / "a.nc")

    monkeypatch.setattr("knitstudy.run.simulations.simulate", simulate)
    return asked


def test_run(knitstudy, config, simulated, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    result = knitstudy(
        "run", "dns-a", "--config", config, "--set", "load.strain=1e-2", "-o", "mine", "--threads", "2"
    )
    assert ["loops", "3", "1"] in table(result)
    assert "mine/simulation/a.nc:" in result.stderr
    assert simulated["scene"].load.strain == 0.01
    assert (str(simulated["folder"]), simulated["config"], simulated["force"]) == ("mine", config, False)


@pytest.mark.parametrize(
    ("error", "status"), [(EndedEarly("so"), 3), (ConvergenceError("so"), 1), (KeyboardInterrupt(), 130)]
)
def test_how_a_run_ended_is_its_status(knitstudy, config, monkeypatch, error, status):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr("knitstudy.run.simulations.simulate", fail)
    result = knitstudy("run", "dns-a", "--config", config)
    assert result.exit_code == status
    assert result.stderr.startswith("error: so" if status != 130 else "error: stopped; stages that were done")


@pytest.mark.optional_packages
def test_show(knitstudy, knit, tmp_path):
    write_dataset(geometry(knit), "knit.nc")
    assert ["kind", "geometry", ""] in table(knitstudy("show", "knit.nc"))
    (tmp_path / "table.csv").write_text("model,\x1b]0;t\x07force [N]\ndns\x1b[2J,1.25\n")
    assert table(knitstudy("show", "table.csv")) == [
        ["model", r"\x1b]0;t\x07force [N]"],
        [r"dns\x1b[2J", "1.25"],
    ]


@pytest.mark.optional_packages
def test_show_of_missing_and_damaged_files(knitstudy, tmp_path):
    assert "nix.nc: there is no such file" in message(knitstudy("show", "nix.nc"))
    assert "nix.csv: there is no such file" in message(knitstudy("show", "nix.csv"))
    (tmp_path / "a.nc").write_bytes(b"CDF\x01")
    assert "a.nc: does not end with a checksum: it was cut" in message(knitstudy("show", "a.nc"))
    (tmp_path / "a.txt").touch()
    assert "a.txt: results are .nc and .csv files" in message(knitstudy("show", "a.txt"))


def test_check_refuses_elements_that_are_too_long_for_the_loop(knitstudy):
    result = knitstudy("check", "rom3d-tie-course", "--set", "mesh.beam_size=5")
    assert "mesh.beam_size is 5 yarn radii: straight beams in bent yarns are" in message(result)
    kept = knitstudy("check", "rom3d-tie-course")
    assert re.search(r"loop: 55\.5 mm of yarn.*some 0\.\d% too stiff", kept.stdout)


@pytest.mark.optional_packages
def test_values_of_a_measured_file_cannot_leave_the_folder(tmp_path):
    from knitstudy.use.commands import curves

    text = "yarn,strain,load N/m\n../../esc,.01,100\n../../esc,.02,300\n../../esc,.04,900\n"
    (tmp_path / "lab.csv").write_text(text)
    asked = dict.fromkeys(curves.READ_BY) | curves.USUAL | {"skip_bad": False, "only": ("yarn=../../esc",)}
    name = curves._read(tmp_path / "lab.csv", "course", asked)[1]
    assert re.fullmatch(r"lab-yarn=\.\.-\.\.-esc-[0-9a-f]{6}", name)


@pytest.mark.optional_packages
def test_curves_that_options_choose_have_files_of_their_own(tmp_path):
    from knitstudy.use.commands import curves

    rows = "0,0\n1,100\n2,300\n3,600\n2,400\n1,200\n2,300\n3,600\n4,900\n"
    of_yarns = "".join(f"{yarn},{row}\n" for yarn in ("50/50", "50-50") for row in rows.split())
    text = f"yarn,strain (%),load N/m\n{of_yarns}"
    for name in ("lab.csv", "lab.txt"):
        (tmp_path / name).write_text(text)
    plain = dict.fromkeys(curves.READ_BY) | curves.USUAL | {"skip_bad": False}
    asked = [
        ("lab.csv", {"only": ("yarn=50/50",)}),
        ("lab.csv", {"only": ("yarn=50-50",)}),
        ("lab.txt", {"only": ("yarn=50-50",)}),
        ("lab.csv", {"only": ("yarn=50-50",), "cycle": 2}),
        ("lab.csv", {"only": ("yarn=50-50",), "branch": "unloading"}),
    ]
    names = [curves._read(tmp_path / file, "course", plain | how)[1] for file, how in asked]
    assert len({*names}) == len(asked)
    assert names[1] == "lab-yarn=50-50"
    for twice in (("yarn=50-50", "yarn=50/50"), ("yarn",)):
        with pytest.raises(UsageError, match="COLUMN=VALUE, once a column"):
            curves._read(tmp_path / "lab.csv", "course", plain | {"only": twice})


HALF_CARDIGAN = ROOT / "examples" / "knitout" / "half_cardigan.k"


@pytest.mark.optional_packages
def test_stitches_of_a_machine_file(knitstudy):
    result = knitstudy("stitches", HALF_CARDIGAN, "--rows", "3:8", "--needles=2:7")
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert "rows of letters, the bottom row first\tKP KT\t" in lines
    assert lines[-3:] == [
        f"pattern.knitout: {HALF_CARDIGAN}",
        "pattern.knitout_rows: [3, 8]",
        "pattern.knitout_needles: [2, 7]",
    ]
    assert knitstudy("stitches", HALF_CARDIGAN, "--rows", "3").exit_code == 2


DRAWN = {
    "pattern.stitches": "[KP, KT]",
    "pattern.loops": 2,
    "pattern.rows": 2,
    "pattern.loop_length": "null",
    "load.start": "rest",
    "load.largest_force": "null",
}


@pytest.mark.optional_packages
def test_check_and_loop_of_stitches_that_are_drawn(knitstudy):
    changes = [f"--set={key}={value}" for key, value in DRAWN.items()]
    checked = knitstudy("check", "fabric-acrylic-stockinette-course-free", *changes)
    assert checked.stdout.splitlines()[-1].startswith("loop: stitches as they are drawn, not optimised")
    refused = message(knitstudy("loop", "fabric-acrylic-stockinette-course-free", *changes))
    assert "are not optimised; `knitstudy run` finds their shape at rest" in refused


def test_a_value_in_another_unit_is_questioned(knitstudy, simulated, monkeypatch):
    """At the end of a run, after its numbers; `simulate` logs the warning before."""
    monkeypatch.setattr("knitstudy.measures.summary.summarise", lambda history: [])
    question = "yarn.youngs_modulus is 1300 Pa; yarns have 1e+06 to 1e+12 Pa: is it meant in MPa?"
    changed = ("cell-course", "--set", "yarn.youngs_modulus=1300")
    assert knitstudy("run", *changed).stderr.splitlines()[-1] == question
    assert knitstudy("check", *changed).stderr.splitlines()[-1] == question
    assert "meant" not in knitstudy("check", "cell-course").stderr


@pytest.mark.optional_packages
@pytest.mark.parametrize("command", ["check", "loop"])
def test_millimetres_typed_as_metres_are_questioned_where_no_loop_fits(knitstudy, monkeypatch, command):
    def no_loop(_):
        raise ConfigurationError("no loop fits")

    monkeypatch.setattr("knitstudy.knit.geometry.lay_out.lay_out", no_loop)
    refused = knitstudy(command, "cell-course", "--set", "pattern.course_spacing=1.1", "--set", "outputs=[]")
    asked, error = refused.stderr.splitlines()
    assert asked.endswith(", 1222 radii of the yarn: is it meant in mm?")
    assert "no loop fits" in error


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (
            UnicodeEncodeError("ascii", "läufe", 1, 2, "ordinal not in range"),
            "the locale cannot write '\\xe4': set LC_ALL",
        ),
        (ModuleNotFoundError("no", name="fcntl"), "knitstudy runs on Linux and macOS; on Windows, use WSL"),
        (MemoryError(), "out of memory (no more details); use larger elements"),
    ],
)
def test_faults_of_the_system_are_one_line(knitstudy, monkeypatch, error, line):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr("knitstudy.run.commands.scenes.load_families", fail)
    assert line in message(knitstudy("list"))


def test_a_folder_called_as_a_number_is_one(knitstudy, monkeypatch):
    given = []
    monkeypatch.setattr(
        "knitstudy.run.commands.run.snakemake", lambda arguments: given.extend(arguments) or 1
    )
    knitstudy("study", "--folder", "2024")
    assert given[-1] == "folder=./2024"


def test_measure_refuses_a_foreign_table_before_it_runs(knitstudy, tmp_path, monkeypatch):
    (tmp_path / "measured.csv").write_text("strain,force\n0,0\n")
    monkeypatch.setattr("knitstudy.run.trade.run", lambda *_, **__: pytest.fail("it ran"))
    assert "measured.csv: is not a table of errors and prices (it has no column" in message(
        knitstudy("measure", "yarns-tie-course")
    )
