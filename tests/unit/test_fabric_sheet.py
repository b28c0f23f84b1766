"""The sheet of a fabric: numbers that say how sure they are, a page, curves to paste, and cycles with their loss."""

import errno
import os
import re
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import synthetic
import xarray as xr
from click.testing import CliRunner
from refusals import refusal

from knitstudy import fabric_sheet, load_scene
from knitstudy.datasets import read_dataset, read_table
from knitstudy.errors import ConvergenceError, KnitstudyError, UnwritableError
from knitstudy.knit.geometry.fabric_file import fabric_dataset
from knitstudy.knit.scene.scene import Scene
from knitstudy.run.commands.main import main
from knitstudy.run.plan import Plan
from knitstudy.run.stages import STAGES
from knitstudy.run.store import Store
from knitstudy.use import fabric_sheet as sheets
from knitstudy.use import sheet_numbers as rows
from knitstudy.use.decks.fabric import SHELL_ENTRIES
from knitstudy.use.fabric_law import membrane
from knitstudy.use.measured_curve import (
    curve_table,
    force_over_strain,
    loss_of_cycle,
    read_curve,
    simulated_curve,
)
from knitstudy.use.plot import draw

pytestmark = pytest.mark.optional_packages


def cell(strain, force, start="rest", axis=0):
    """History of a cell that is pulled along an axis; half of the strain goes across."""
    planes = np.zeros((2, len(strain), 3))
    planes[0, :, axis], planes[0, :, (axis + 1) % 2], planes[1, :, axis] = (
        strain,
        -0.5 * np.array(strain),
        force,
    )
    names = ("increment", "plane")
    more = {"cell_strain": (names, planes[0]), "force_per_width": (names, planes[1])}
    return synthetic.history(strain=strain, force=force, axis=axis).assign(more)


THERE_AND_BACK = cell([0.0, 0.1, 0.2, 0.1, 0.0], [0.0, 10.0, 20.0, 5.0, 0.0])


def test_a_number_is_a_column_where_another_first_reaches_a_value():
    curve = curve_table(THERE_AND_BACK)
    at = (rows.PULL("course"), 15.0)
    assert rows.when(curve, rows.STRAIN("course"), *at) == pytest.approx(0.15)
    assert rows.when(curve, rows.STRAIN("wale"), *at) == pytest.approx(-0.075)
    assert np.isnan(rows.when(curve, rows.STRAIN("course"), rows.PULL("course"), 21.0))


def test_energy_is_a_square_of_the_force_inside_an_increment():
    """Both curves are straight: the energy is half of the force times the way, wherever increments end."""
    pulled = (rows.STRAIN("course"), rows.PULL("course"))
    for force in (2.0, 10.0, 15.0, 20.0):
        energy = rows.energy_to(curve_table(THERE_AND_BACK), *pulled, force)
        assert energy == pytest.approx(0.5 * force * force / 100.0)
    assert np.isnan(rows.energy_to(curve_table(THERE_AND_BACK), *pulled, 21.0))
    pressed = pd.DataFrame(
        [(1.0, 0.0, 0.0), (0.9, 2000.0, 0.1)], columns=["thickness [mm]", "pressure [Pa]", rows.ENERGY]
    )
    (row,) = rows.thickness_rows([pressed, pressed], [50.0])[1:]
    assert row == ["energy of pressing to 50 Pa", "6.25e-05", "not known", "J/m2", ""]


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ([12.3456], ["12.35", "not known"]),
        ([12.3456, 12.0, 13.0], ["12.35", "0.65"]),
        ([np.nan], ["not known", "not known"]),
        ([12.0, 12.5, np.nan], ["12", "not known"]),
        ([12.0, 12.0 + 1e-14], ["12", "not known"]),
    ],
)
def test_every_number_has_an_uncertainty_or_says_that_it_is_not_known(values, texts):
    assert rows._row("length", values, "m") == ["length", *texts, "m", ""]


def test_the_loss_of_a_cycle_is_the_area_of_its_loop():
    curve = force_over_strain(curve_table(THERE_AND_BACK), "course")
    loss = loss_of_cycle(curve)
    up, down = np.trapezoid([0, 10, 20], [0, 0.1, 0.2]), np.trapezoid([0, 5, 20], [0, 0.1, 0.2])
    assert loss.work == pytest.approx(up)
    assert loss.share == pytest.approx(1 - down / up)
    assert loss.peak == 20.0
    assert loss_of_cycle(curve.iloc[:3]) is None


def test_a_knit_has_the_force_over_its_width_and_the_work_over_its_area(knit):
    energy = xr.DataArray([[0.0], [1.0], [3.0]], dims=("increment", "form"), coords={"form": ["external"]})
    table = curve_table(synthetic.history(axis=0).assign(energy=energy), fabric_dataset(knit))
    assert table["course force per width [N/mm]"].iloc[-1] == pytest.approx(1e-3 * 10.0 / knit.height)
    assert table["energy [J/m2]"].iloc[-1] == pytest.approx(3.0 / (knit.width * knit.height))
    assert list(table.filter(like="strain")) == ["course strain [1]"]
    with refusal("two yarns, which have no force per width"):
        curve_table(synthetic.history(axis=2), fabric_dataset(knit))


def test_cells_are_drawn_by_force_per_width_and_lateral_strain():
    energy = xr.DataArray(np.zeros((5, 6)), dims=("increment", "form"), coords={"form": FORMS})
    (force, lateral) = draw(THERE_AND_BACK.assign(energy=energy)).axes
    assert force.get_ylabel() == "force per width (N/m)"
    assert lateral.get_lines()[0].get_ydata() == pytest.approx([0, -5, -10, -5, 0])
    (text,) = force.get_legend().get_texts()
    assert text.get_text() == "loss 25%"
    sheared = cell([0.0, 0.1], [0.0, 10.0], axis=2).assign(energy=energy[:2])
    assert [draw(sheared).axes[1].get_xlabel(), draw(sheared).axes[1].get_ylabel()] == [
        "shear (%)",
        "course strain (%)",
    ]


def test_a_branch_of_a_history_is_taken():
    back = simulated_curve(THERE_AND_BACK, None, cycle=2, branch="unloading")  # of the last cycle there is
    assert back.to_dict() == {0.0: 0.0, 0.1: 5.0, 0.2: 20.0}
    assert simulated_curve(THERE_AND_BACK, None).tolist() == [0.0, 10.0, 20.0]
    with refusal("the history has no unloading: simulate one"):
        simulated_curve(THERE_AND_BACK.isel(increment=slice(3)), None, branch="unloading")


FORMS = ["external", "internal", "hourglass", "penalty", "friction", "stabilisation"]


@pytest.fixture(scope="module")
def coarse_jersey(jersey):
    """The same of few beams."""
    return jersey.vary({"mesh.beam_size": 0.8, "gates.polygon": 0.3})


@pytest.fixture(scope="module")
def made(coarse_jersey, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sheet")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sheets, "EVEN", 6)
        return fabric_sheet(coarse_jersey, tex=45.0, force=30.0, ratios=(1.0, 0.5), folder=folder), folder


def test_a_sheet_has_all_numbers_of_a_fabric(made):
    table = made[0].numbers.set_index("quantity")
    assert float(table.loc["stitch density", "value"]) == pytest.approx(1e-4 / (0.9e-3 * 1.1e-3), rel=1e-3)
    known = (
        "course strain at 30 N/m",
        "wale strain at 3 N/m",
        "course energy to 30 N/m",
        "shear stiffness at 0.01 rad",
    )
    for quantity in known:
        value, uncertainty = table.loc[quantity, ["value", "uncertainty"]].astype(float)
        assert 0 < uncertainty < 0.3 * value, quantity
    assert 0 < float(table.loc["course loss of a cycle", "value"]) < 100
    assert float(table.loc["bending stiffness, course, yarns tied", "value"]) > 0
    between = [float(table.loc[f"thickness at {pressure} Pa", "value"]) for pressure in (49, 1000, 4900)]
    assert float(table.loc["thickness", "value"]) > between[0] > between[1] > between[2]
    assert float(table.loc["energy of pressing to 4900 Pa", "value"]) > 0
    for quantity in ("bending stiffness, wale", "curling moment at rest, wale"):
        assert list(table.loc[quantity, ["value", "uncertainty"]]) == ["not known", "not known"]
    assert table.loc["bending stiffness, wale", "remark"] == rows.SLACK  # rows of drawn loops do not touch
    assert float(table.loc["bending stiffness, course", "value"]) > 0  # of the yarns alone
    loads = {"course", "wale", "shear", "both ways 1:1", "both ways 1:0.5", "press"}
    assert set(made[0].curves["load"]) == loads
    at_once = made[0].curves.query("load == 'both ways 1:0.5'")
    assert at_once["wale strain [1]"].to_numpy() == pytest.approx(
        0.5 * at_once["course strain [1]"].to_numpy()
    )


def test_a_sheet_says_what_its_inputs_change(made):
    """Of the yarn and of the spacing that loops are drawn for; a solid yarn has forces proportional to its modulus."""
    (note,) = [note for note in made[0].notes if note.startswith("Of 10 % more of an input")]
    named = r"(\S+) ([+-][\d.]+) %"
    shares = {key: float(share) for key, share in re.findall(named, note)}
    assert set(shares) == {"pattern.course_spacing", "yarn.diameter", "yarn.youngs_modulus"}
    assert all(1 < abs(share) < 100 for share in shares.values())
    assert -10 < shares["yarn.youngs_modulus"] < 0


def test_a_sheet_is_a_page_with_tables_and_decks(made, tmp_path):
    page, *files = made[0].write(tmp_path)
    text = page.read_text()
    assert "<td>stitch density</td>" in text
    assert all(file.stat().st_size > 100 and file.name in text for file in files)
    assert "shell.abaqus.inp bends as tied yarns, since" in text  # rows of drawn loops do not touch
    shell = (tmp_path / "shell.abaqus.inp").read_text()
    assert "D44 to D66 are those of yarns that are tied" in " ".join(shell.replace("\n** ", " ").split())
    assert "N/m, cell " in shell
    assert {file.name for file in files} >= {
        "numbers.csv",
        "curves.csv",
        "membrane.calculix.inp",
        "shell.abaqus.inp",
    }
    pd.testing.assert_frame_equal(read_table(tmp_path / "curves.csv"), made[0].curves.reset_index(drop=True))


def test_a_sheet_leaves_no_deck_of_an_earlier_one_and_names_both_yarns(made, tmp_path):
    made[0].write(tmp_path)
    two = made[0].scene.vary({"pattern.rows": 2, "yarn_b.diameter": 0.2e-3})
    compressed = made[0].curves.assign(**{"wale strain [1]": -made[0].curves["course strain [1]"]})
    few = {"course": made[0].histories["course"]}
    page, *files = replace(made[0], scene=two, histories=few, tied=None, curves=compressed).write(tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {page.name, *(file.name for file in files)}
    assert "yarn 0.25 and 0.2 mm thick" in page.read_text()
    assert not [file for file in files if file.suffix == ".inp"]


def test_a_sheet_without_the_extra_pictures_has_no_page(made, tmp_path, monkeypatch, caplog):
    made[0].write(tmp_path)
    monkeypatch.delitem(sys.modules, "knitstudy.use.sheet_page")
    monkeypatch.setitem(sys.modules, "jinja2", None)
    files = made[0].write(tmp_path)
    assert files[0].name == "numbers.csv"
    assert {file.name for file in tmp_path.iterdir()} == {file.name for file in files}
    assert 'pip install "knitstudy[pictures]"' in caplog.text


def test_a_sheet_is_written_whole_or_not_at_all_and_says_what_it_replaces(
    made, tmp_path, monkeypatch, caplog
):
    """A disk that is full before the page leaves the whole of the earlier sheet, and no part of another one."""
    made[0].write(tmp_path)
    made[0].write(tmp_path)
    assert "is replaced" not in caplog.text
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    other = replace(made[0], numbers=made[0].numbers.assign(value="1"))

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as disk:
        disk.setattr(sheets, "write_text", full)
        with refusal(rf"{tmp_path}: cannot be written .No space left on device.: make room", UnwritableError):
            other.write(tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    other.write(tmp_path)
    assert f"{tmp_path}: a sheet with other numbers is replaced" in caplog.text


def test_a_cell_between_plates_is_drawn_by_its_pressure(made):
    history = read_dataset(made[1] / "simulation" / "jersey-sheet-press-drawn.nc")
    pressure, lateral = draw(history).axes
    assert (pressure.get_ylabel(), lateral.get_xlabel()) == ("pressure (kPa)", "thickness (mm)")
    with refusal("no force per width along its load"):
        simulated_curve(history, history)
    with refusal("is not a history of a cell without plates"):
        membrane({"press": history})


def test_show_writes_a_curve_and_says_that_it_draws(made, tmp_path):
    """Of a sheet's own cycle in course direction: numbers to paste, and a picture with the outline of the cell."""
    file, curve = made[1] / "simulation" / "jersey-sheet-course.nc", tmp_path / "curve.csv"
    shown = CliRunner().invoke(main, ["show", str(file), "--curve", str(curve)])
    assert shown.exit_code == 0, shown.stderr
    assert "stitch density\t101.01\t1/cm2" in shown.stdout
    lost = made[0].numbers.set_index("quantity").loc["course loss of a cycle", "value"]
    assert f"course loss of the first cycle\t{lost[:4]}" in shown.stdout
    assert read_curve(curve, {}, {}, "course").max() == pytest.approx(
        read_table(curve)["course force per width [N/m]"].max()
    )
    table = read_table(curve)
    newtons, others = (table[f"course force per width [{unit}]"].to_numpy() for unit in ("N/m", "N/mm"))
    assert 1e3 * others == pytest.approx(newtons)
    assert len(table) == read_dataset(file).sizes["increment"]
    page = tmp_path / "knit.html"
    drawn = CliRunner().invoke(main, ["show", str(file), "--picture", str(page)])
    assert drawn.stderr.splitlines()[-2:] == [f"drawing {page} ...", f"drawn: {page}"]


def test_histories_are_kept_and_the_command_prints_them(made, coarse_jersey, monkeypatch):
    """The second sheet simulates nothing."""
    _, folder = made
    monkeypatch.setattr(sheets, "EVEN", 6)
    monkeypatch.setattr("knitstudy.run.store._made", lambda *arguments: pytest.fail("nothing is made"))
    monkeypatch.setattr(ProcessPoolExecutor, "submit", lambda *_, **__: pytest.fail("a process begins"))
    monkeypatch.setattr("knitstudy.use.commands.sheet.changed_scene", lambda *arguments: coarse_jersey)
    asked = (
        "sheet",
        "jersey",
        "--density",
        "909",
        "--force",
        "30",
        "--ratio=1",
        "--ratio=0.5",
        "--output",
        str(folder),
    )
    printed = CliRunner().invoke(main, asked)
    assert printed.exit_code == 0, printed.stderr
    rows = [line.split("\t") for line in printed.stdout.splitlines()]
    assert rows[0] == ["quantity", "value", "uncertainty", "unit", "remark"]
    assert "mass per area" in [row[0] for row in rows]
    assert (folder / "sheet" / "jersey" / "sheet.html").is_file()
    assert CliRunner().invoke(main, [*asked, "--tex", "30"]).exit_code == 2


def test_a_killed_process_is_named_and_nameless_sheets_keep_their_places(
    coarse_jersey, monkeypatch, tmp_path
):
    """A sheet has no jobs to take fewer of."""
    die, names = replace(STAGES["bending"], function=lambda scene, **needed: os._exit(1)), []
    monkeypatch.setitem(STAGES, "bending", die)
    monkeypatch.setattr(sheets, "cell_of", lambda scene: names.append(scene.name) or scene)
    for friction in (0.2, 0.3):
        with refusal("ended a process, perhaps for its memory: take a larger mesh.beam_size", KnitstudyError):
            fabric_sheet(coarse_jersey.vary({"name": "scene", "contact.friction": friction}), folder=tmp_path)
    assert len({*names} - {"scene"}) == 2


def test_results_side_by_side_have_the_diameter_of_the_yarn_not_of_the_drawn_loops(tmp_path):
    scene, store, files = load_scene("fabric-acrylic-stockinette-course-free"), Store(tmp_path), []
    for share in (0.6, 0.5):
        step = Plan({}).step(
            "geometry", scene.vary({"geometry.diameter_share": share, "knit": f"k{100 * share:g}"})
        )
        store.get(step)
        files.append(str(tmp_path / step.path))
    for asked in (files[:1], files):
        shown = CliRunner().invoke(main, ["show", *asked])
        assert shown.exit_code == 0, shown.stderr
        (row,) = [line.split("\t") for line in shown.stdout.splitlines() if line.startswith("yarn diameter")]
        assert {*row[1 : 1 + len(asked)]} == {f"{scene.yarn.diameter:.6g}"}


def bent(slope, cycle=True):
    """Bending with a moment of 1e-3 N at rest in both directions, 1e-4 N less on the way to the back, 2e-4 N more at
    the end; to the back it is three times as stiff.
    """
    curvature = np.array([0.0, 50, 100, 150, 250, 50, 0, -250, 0]) if cycle else np.array([0.0, 100, 250])
    moment = 1e-3 + slope * curvature * np.where(curvature < 0, 3, 1)
    if cycle:
        moment += [0, 0, 0, 0, 0, -1e-4, -1e-4, -1e-4, 2e-4]
    names = ("direction", "increment")
    planes = {
        "curvature": curvature,
        "moment_per_width": moment,
        "friction_per_area": 1e-3 * curvature[::-1] + 0.2,
    }
    both = {name: (names, np.tile(values, (2, 1))) for name, values in planes.items()}
    first = {"first_bending_stiffness": ("direction", [2 * slope, 3 * slope])}
    return xr.Dataset(both | first, attrs={"ended": ""})


def test_bending_is_a_slope_a_hysteresis_and_a_moment_at_rest():
    made = rows.bending_rows([bent(1e-5), bent(2e-5, cycle=False)], 0.08, None)
    table = {row[0]: row[1:4] for row in made}
    # As KES-FB2 has it: the mean of 1e-5 N m to the front and 3e-5 N m to the back; the other start is 1e-5 N m off.
    assert table["bending stiffness, course"] == ["2e-05", "1e-05", "N m"]
    assert table["bending stiffness at first, wale"] == ["3e-05", "3e-05", "N m"]
    # From 250 to 50 1/m the way back is straight: at 100 it has lost three quarters of 1e-4 N; at -100 the way home has
    # gained 0.6 of 3e-4 N. Again the mean.
    assert table["bending hysteresis, course"] == ["0.0001275", "1e-05", "N"]
    assert table["bending loss of a cycle, course"] == ["0.2", "0.016", "J/m2"]
    assert table["curling moment at rest, wale"] == ["0.001", "8e-05", "N"]


def test_bending_that_ends_early_has_the_numbers_of_the_front_and_says_so():
    ahead = bent(1e-5, cycle=False)
    table = {row[0]: row[1:] for row in rows.bending_rows([ahead], 0.0, None)}
    assert table["bending stiffness, course"] == [
        "1e-05",
        "not known",
        "N m",
        "50 to 150 1/m, of the front alone",
    ]
    assert table["bending hysteresis, course"][:2] == ["not known", "not known"]
    none = ahead.assign(curvature=np.nan * ahead["curvature"])
    table = {row[0]: row[1:] for row in rows.bending_rows([none], 0.0, None)}
    assert table["bending stiffness at first, wale"] == ["not known", "not known", "N m", rows.SLACK]


def test_a_moment_of_rounding_is_none():
    still = bent(1e-5)
    flat = still.assign(moment_per_width=still["moment_per_width"] - 1e-3 + 1e-15)
    table = {row[0]: row[1] for row in rows.bending_rows([flat], 0.1, None)}
    assert table["curling moment at rest, course"] == "0"


@pytest.mark.parametrize(
    ("changes", "given"),
    [
        ({}, {*rows.SPACINGS}),  # drawn: the spacings are the scene's, the loop length is not
        (
            {"pattern.loop_length": 4.6e-3},
            {*rows.SPACINGS, rows.LENGTH, "tightness factor", "mass per area"},
        ),
        (
            {"pattern.loop_length": 4.6e-3, "load.start": "rest"},
            {rows.LENGTH, "tightness factor"},
        ),
        ({"load.start": "rest"}, set()),
    ],
)
def test_given_is_what_the_scene_says(coarse_jersey, changes, given):
    assert rows.given_numbers(coarse_jersey.vary(changes)) == given


def test_a_thickness_is_no_surer_than_beams_are_fine():
    """Plates that hardly press leave the thickness: forces that are 11 % off then change it by nanometres."""
    curve = pd.DataFrame({"thickness [mm]": [1.0, 0.9], "pressure [Pa]": [0.0, 1e6], rows.ENERGY: [0.0, 1.0]})
    thickness, _ = rows.thickness_rows([curve, curve.assign(**{"pressure [Pa]": [0.0, 1.1e6]})], [49.0])
    assert thickness[:3] == ["thickness at 49 Pa", "1", "0.012"]


def test_small_pressures_have_increments_of_their_own():
    """Pressure grows as a power of how far plates have closed; sums over increments have its work to 4 %."""
    ends = [0.0]
    for stop in sheets.CLOSE:
        end, step = stop if isinstance(stop, list) else (stop, np.inf)
        ends += np.linspace(ends[-1], end, 1 + max(1, round((end - ends[-1]) / step)))[1:].tolist()
    closed = np.array(ends)
    for exponent in (1.0, 1.5, 2.0):
        pressure = 5e7 * closed**exponent
        work = 5e7 * closed ** (exponent + 1) / (exponent + 1)
        curve = pd.DataFrame(
            {"thickness [mm]": 1 - closed, "pressure [Pa]": pressure, rows.ENERGY: 1e-3 * work}
        )
        for pressed in (49.0, 1000.0):
            exact = 1e-3 * 5e7 * (pressed / 5e7) ** (1 + 1 / exponent) / (exponent + 1)
            found = rows.energy_to(curve, "thickness [mm]", "pressure [Pa]", pressed)
            assert found == pytest.approx(exact, rel=0.04)


def test_slack_shear_has_no_stiffness():
    """Loops that do not touch are resisted by the drag on loose yarns, whose size belongs to the increments."""
    energy = np.zeros((3, 6))
    energy[1:, [1, 5]] = [1e-15, 1e-13]  # internal; stabilisation
    sheared = cell([0.0, 0.01, 0.02], [0.0, 1e-5, 2e-5], axis=2)
    forms = {"form": FORMS}
    loose = sheared.assign(energy=xr.DataArray(energy, dims=("increment", "form"), coords=forms))
    assert rows.is_slack(loose)
    assert not rows.is_slack(loose.assign(energy=loose["energy"][:, ::-1].assign_coords(forms)))
    assert not rows.is_slack(loose.isel(increment=slice(1)))  # not reached
    curves = {load: [curve_table(THERE_AND_BACK)] for load in ("course", "wale")}
    curves["shear"] = [curve_table(loose)]
    row = rows.load_rows(curves, 10.0, slack=True)[-1]
    assert row[:4] == ["shear stiffness at 0.01 rad", "0", "0.001", "N/m"]


def test_forces_in_both_directions_are_off_on_their_own():
    """The wale force at a course force would be exact if both were wrong by one factor."""
    curve = curve_table(THERE_AND_BACK).assign(**{rows.PULL("wale"): 100.0})
    off = sheets._with_errors_of_model(curve, unlike=True)
    ends = [(each[rows.PULL("course")].iloc[2], each[rows.PULL("wale")].iloc[0]) for each in off]
    assert sorted(ends) == [pytest.approx(end) for end in ((17.8, 89), (17.8, 111), (22.2, 89), (22.2, 111))]
    low, high = sheets._with_errors_of_model(curve, unlike=False)
    assert [each[rows.ENERGY].iloc[2] for each in (low, high)] == pytest.approx([1.78, 2.22])


def test_notes_of_a_sheet_say_what_a_fabric_has_left_and_what_its_cell_hides():
    known = {
        "lowest_stiffness": 0.03,
        "saddles": 1,
        "saddle_stiffness": -0.5,
        "change_from_saddle": [-0.28, 0.025, 0.37],
        "lowest_wave_stiffness": -0.1,
        "lowest_wave": [1, 4],
    }
    left, hidden = sheets._of_rest("rest", xr.Dataset(attrs=known))
    assert "width -28 %, height +2.5 %, thickness +37 %" in left
    assert "waves of 1 loops and 4 rows" in hidden
    stable = {"lowest_stiffness": 0.03, "saddles": 0, "lowest_wave_stiffness": 0.1, "lowest_wave": [4, 1]}
    assert sheets._of_rest("rest", xr.Dataset(attrs=stable)) == []
    assert sheets._of_rest("drawn", xr.Dataset()) == []


def test_soft_yarns_start_from_rest_with_and_without_friction(monkeypatch, tmp_path):
    """The largest difference is the uncertainty, that to loops drawn otherwise as well; ends are notes."""
    scene = load_scene("fabric-acrylic-stockinette-course-free")

    def history(self, step):
        if step.stage.name != "simulation":
            return (
                bent(1e-5, cycle=bool(step.scene.load.turns))
                if step.stage.name == "bending"
                else xr.Dataset()
            )
        load = step.scene.load
        axis = {"course": 0, "wale": 1, "biaxial": 0, "shear": 2, "press": 2}[load.deformation]
        stiff = 1000.0 if load.start == "rest" else 1100.0
        if step.scene.pattern.wale_spacing > scene.pattern.wale_spacing:
            stiff = 1300.0
        strain = np.array([0.0, 0.005, 0.01, 0.05, 0.1, 0.12])
        size = {"cell_width": 3e-3, "cell_height": 2e-3, "load": load}
        made = cell(strain, stiff * strain, axis=axis).assign_attrs(size)
        if load.deformation == "press":
            energy = xr.DataArray(np.zeros((6, 1)), dims=("increment", "form"), coords={"form": ["external"]})
            thickness = ("increment", 1e-3 * (1 - strain))
            return made.assign(
                thickness=thickness, pressure=("increment", 100 * stiff * strain), energy=energy
            )
        if load.deformation == "shear" and load.start != "rest":
            error = ConvergenceError("snaps")
            error.history = made.isel(increment=slice(3))
            raise error
        return made

    monkeypatch.setattr(Store, "get", history)
    sheet = fabric_sheet(scene)
    table = sheet.numbers.set_index("quantity")
    assert table.loc["course strain at 100 N/m", ["value", "uncertainty"]].tolist() == ["9.091", "1.4"]
    assert table.loc["thickness at 1000 Pa", ["value", "uncertainty"]].tolist() == ["0.9909", "0.012"]
    length = float(table.loc["length of yarn in a stitch", "value"])  # mm
    assert float(table.loc["tightness factor", "value"]) == pytest.approx(
        np.sqrt(500) / (0.1 * length), rel=1e-3
    )
    without = fabric_sheet(Scene.from_dict(scene.to_dict(), "scene")).numbers.set_index("quantity")
    assert without.loc["tightness factor"].tolist() == [
        "not known",
        "not known",
        "",
        "needs the tex of the yarn",
    ]
    counts = sheet.histories["course"].attrs["load"]
    assert counts.start == "rest_with_friction"
    assert counts.turns == pytest.approx((1.03 * 0.11,))
    assert f"The path {scene.name}-sheet-shear ended early: snaps" in sheet.notes
    assert any(note.startswith("Bending of tied yarns is not known: ") for note in sheet.notes)
    assert table.loc["length of yarn in a stitch", "uncertainty"] == "given"
    of_yarn = "friction 0.095, yarn.stretching 50 N, yarn.bending 4.5e-08 N m2, yarn.twisting 3.4e-08 N m2, "
    changes = "as a share of itself: pattern.loop_length +0 %, yarn.diameter +0 %, yarn.bending +0 %."
    assert any(note.endswith(changes) for note in sheet.notes)  # all paths are the same here
    assert any(f"{of_yarn}yarn.pressing 63 N, tex 500." in note for note in sheet.notes)
    monkeypatch.setattr("knitstudy.use.sheet_page.loss_of_cycle", lambda curve: None)
    sheet.write(tmp_path)
    deck = (tmp_path / "shell.abaqus.inp").read_text()
    *_, numbers = re.split(r"\*SHELL GENERAL SECTION.*", deck)
    section = dict(zip(SHELL_ENTRIES, map(float, re.split("[,\\n]+", numbers.strip())), strict=True))
    bends = {name: section.pop(name) for name in ("D44", "D55", "D66")}
    assert bends == {"D44": 2e-5, "D55": 2e-5, "D66": 1e-5}
    assert {name for name, value in section.items() if value} <= {"D11", "D12", "D22", "D13", "D23", "D33"}
    assert 500 < section["D11"] < 2000
    assert "D66 is not known" in deck.replace("\n** ", " ")
    row = sheet.numbers["quantity"] == "bending stiffness, wale"
    curls = replace(sheet, numbers=sheet.numbers.assign(value=sheet.numbers["value"].mask(row, "-1e-05")))
    page = curls.write(tmp_path / "curls")[0].read_text()
    assert not (tmp_path / "curls" / "shell.abaqus.inp").exists()
    assert "these are 2e-05 and -1e-05 N m (course, wale)" in page


def test_a_path_that_falls_short_of_the_force_goes_farther(coarse_jersey, monkeypatch):
    """From another size at rest the force is reached at a larger strain than the first path has found."""
    ran = []

    def run(self, name, keys):
        far = keys["load.strain"] if not keys.get("load.turns") else keys["load.turns"][0]
        ran.append((name, far))
        strain = np.linspace(0, 0.1 if name.endswith("found") else far, 6)
        stiff = 1100.0 if name.endswith("found") else 700.0
        return cell(strain, stiff * strain, axis=1)

    monkeypatch.setattr(sheets._Maker, "_run", run)
    maker = sheets._Maker(coarse_jersey, ("drawn",), 110.0, None, None)
    made = maker.history("wale", {"load.deformation": "wale", "load.ratio": 1.0})
    assert [name for name, _ in ran] == ["wale-found", "wale", "wale farther"]
    assert ran[-1][1] == pytest.approx(110.0 / 700.0)
    assert made["force_per_width"].to_numpy()[-1, 1] == pytest.approx(110.0)


def test_both_yarns_of_a_fabric_are_named():
    two = load_scene("fabric-acrylic-stockinette-course-free").vary(
        {"pattern.rows": 2, "yarn_b.diameter": 0.5e-3, "yarn_b.stretching": 20.0}
    )
    note = sheets._of_yarns(two, np.array([500.0, 100.0]))
    assert note.endswith("yarn_b.stretching 20 N, tex 500 and 100.")
    assert sheets._each(2e3 * two.radius) == "0.841 and 0.5"


def test_a_knit_of_solids_is_a_cell_of_beams_and_a_pair_has_no_sheet():
    made = sheets.cell_of(load_scene("yarns-tie-course"))
    assert (made.fidelity, made.interaction, made.pattern.loops, made.load.lateral) == (
        "beam",
        "isotropic",
        1,
        "free",
    )
    with refusal("specimen is pair but must be made of loops"):
        sheets.cell_of(load_scene("pair-slid-90"))
