"""Curves of a laboratory are read as they come, and say modulus and friction within the intervals of the fit."""

from time import process_time
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from refusals import READ, REFUSED, refusal

from knitstudy.datasets import read_dataset, read_table
from knitstudy.errors import KnitstudyError
from knitstudy.run.commands.main import main
from knitstudy.use.curve_fit import SIMULATED, fit
from knitstudy.use.measured_curve import Loss, at, loss_of_cycle, read_curve

PLAIN = "strain (%),force_per_width_N_mm\n1,0.1\n2,0.3\n4,0.9\n"


@pytest.mark.parametrize(("text", "named", "only"), READ["curves"])
def test_a_file_is_read_as_it_is(tmp_path, text, named, only):
    path = tmp_path / "lab.csv"
    path.write_text(text, encoding="utf-8-sig")
    for _ in range(2):  # what was said is kept
        curve = read_curve(path, named, only, "course")
        # Texts of true strains and gram-forces have six digits.
        np.testing.assert_allclose(curve.index, [0.01, 0.02, 0.04], rtol=1e-5)
        np.testing.assert_allclose(curve, [100, 300, 900], rtol=1e-5)
        named = {}


@pytest.mark.parametrize(("text", "named", "message"), REFUSED["curves"])
def test_unreadable_files_are_refused_with_a_remedy(tmp_path, text, named, message):
    path = tmp_path / "lab.csv"
    path.write_text(text)
    with pytest.raises(KnitstudyError) as error:
        read_curve(path, named, {}, "course")
    assert str(error.value).startswith(f"{path}: ")
    assert message in str(error.value)
    assert len(str(error.value).splitlines()) == 1
    assert [each.name for each in tmp_path.iterdir()] == ["lab.csv"]


@pytest.mark.parametrize(("rows", "named", "strain", "force", "said"), READ["zeros"])
def test_a_curve_begins_at_its_zero_and_says_so(tmp_path, rows, named, strain, force, said, caplog):
    (tmp_path / "lab.csv").write_text(f"strain (%),force (N/m)\n{rows}")
    for _ in range(2):  # what was said is kept
        caplog.clear()
        curve = read_curve(tmp_path / "lab.csv", named, {}, "course")
        np.testing.assert_allclose(curve.index, strain, atol=1e-12)
        np.testing.assert_allclose(curve, force, atol=1e-9)
        assert said in caplog.text
        assert bool(said) == bool(caplog.text)
        named = {}


TABLES = (
    "load (N),max (N)\n1,1\n2,2\n3,3\n\nraw\n"
    "strain (%),force (N/m)\n1,100\n2,300\n\nnext\nstrain (%),force (N/m)\n3,600\n4,900\n5,1200\n"
)


@pytest.mark.parametrize(
    ("asked", "strain"),
    [
        ({"table": 2, "skip_bad": True}, [0.01, 0.02, 0.03, 0.04, 0.05]),  # parts of one table
        ({"table": 2}, [0.0, 0.01, 0.02]),  # two rows are no table of their own
    ],
)
def test_one_of_several_tables_is_read(tmp_path, asked, strain):
    (tmp_path / "lab.csv").write_text(TABLES)
    curve = read_curve(
        tmp_path / "lab.csv", {"zero": "first"} if len(strain) == 3 else {}, {}, "course", **asked
    )
    np.testing.assert_allclose(curve.index, strain, atol=1e-12)
    with refusal("--table 3: the file has 2"):
        read_curve(tmp_path / "lab.csv", {}, {}, "course", table=3)


@pytest.mark.parametrize(
    ("names", "fields"),
    [
        (",".join(f"c{k}" for k in range(10_000)), ",".join(["1"] * 10_000)),
        (f"strain ({' ' * 3000}%,force [{' ' * 3000}N/m", "1,2"),
        (f"strain{' ' * 3000}x,force{' ' * 3000}", "1,2"),
        ("strain (%),force (N/m)", f"1,{'1' * 100_000}"),
        ("strain (%),force (N/m)", f"1{' ' * 100_000}x,2"),
        ("strain (%),force (N/m)", '1,"2'),
    ],
)
def test_a_file_of_any_size_has_an_answer_soon(tmp_path, names, fields):
    (tmp_path / "lab.csv").write_text("\n".join([names, *[fields] * 40]))
    begin = process_time()
    with refusal("lab.csv: "):
        read_curve(tmp_path / "lab.csv", {}, {}, "course")
    assert process_time() - begin < 5


CYCLES = "strain (%),force (N/m)\n1,100\n2,300\n4,900\n3,500\n2,200\n0,10\n1,60\n2,250\n4,850\n"


@pytest.mark.parametrize(("asked", "strain", "force"), READ["branches"])
def test_a_branch_of_a_cycle_is_taken(tmp_path, asked, strain, force, caplog):
    (tmp_path / "lab.csv").write_text(CYCLES)
    curve = read_curve(tmp_path / "lab.csv", {}, {}, "course", **asked)
    np.testing.assert_allclose(curve.index, strain)
    np.testing.assert_allclose(curve, force)
    assert "rows are left out" in caplog.text
    assert ("hysteresis" in caplog.text) == ("cycle" not in asked)
    with refusal(r"has 3 branches .*: no unloading of cycle 2"):
        read_curve(tmp_path / "lab.csv", {}, {}, "course", cycle=2, branch="unloading")


@pytest.mark.parametrize(
    ("strain", "force", "cycle", "loss"),
    [
        ([0.0, -0.25, -0.5, -0.25, 0.0], [0.0, -2, -4, -1, 0], 1, Loss(1.0, 0.25, 4.0)),
        ([0.0, -0.05, -0.1], [0.0, -1, -2], 1, None),
        ([0.0, 0.05, 0.1, 0.05, 0.0], [0.0] * 5, 1, None),
        ([0.0, 0.05, 0.1], [0.0, 1, 2], 2, None),
        ([0.1, 0.05, 0.0, 0.05], [2.0, 1, 0, 1], 1, None),
    ],
)
def test_the_loss_of_a_cycle_is_that_of_any_first_way(strain, force, cycle, loss):
    assert loss_of_cycle(pd.Series(force, strain), cycle) == loss


@pytest.mark.parametrize(("count", "strain"), [(3, [0.01, 0.05]), (3, [-0.01, 0.01]), (1, [0.01])])
def test_a_curve_is_not_extrapolated(count, strain):
    with refusal("the simulated curve has strains from 0 to"):
        at(pd.Series([0.0, 1.0, 4.0], [0.0, 0.01, 0.02])[:count], strain)


def test_what_is_not_used_is_named(tmp_path, caplog):
    text = "made on Monday\nstrain (%),force (N/m)\n0,50\n1,150\n2,oops\n3,650\n4,950\nend\n"
    (tmp_path / "lab.csv").write_bytes(text.encode("utf-16"))
    curve = read_curve(tmp_path / "lab.csv", {}, {}, "course", skip_bad=True)
    np.testing.assert_allclose(curve, [0, 100, 600, 900])
    for note in (
        "above the table are not used: 1",
        "unreadable are not used: 5",
        "below the table are not used: 8",
    ):
        assert note in caplog.text
    assert "begins at 0 % strain and 50 N/m, which are taken off" in caplog.text


@pytest.mark.parametrize("kept", ["strain: Weg\n", "force: [a, b, c]\n", "width: wide\n"])
def test_columns_that_were_kept_otherwise_are_refused(tmp_path, kept):
    (tmp_path / "lab.csv").write_text(PLAIN)
    (tmp_path / "lab.columns.yaml").write_text(kept)
    with refusal(r"columns\.yaml: is not as knitstudy wrote it; delete it"):
        read_curve(tmp_path / "lab.csv", {}, {}, "course")


STRAIN = np.linspace(0.002, 0.05, 20)


def forces(friction):
    """Forces of a made-up knit: friction raises them, at small strains most, up to where all sticks."""
    return 100 * STRAIN * (1 + 8 * STRAIN) * (1 + 0.8 * np.tanh(2 * friction) * np.exp(-STRAIN / 0.02))


def noisy(seed, proportional, model=forces):
    exact, noise = 1.3 * model(0.4), 0.02 * np.random.default_rng(seed).standard_normal(len(STRAIN))
    return exact * (1 + noise) if proportional else exact + noise * exact.max()


FRICTIONS = np.linspace(0.05, 1.0, SIMULATED)


def finer(friction, share=1.0):
    """Forces of a model that removes a share of the error, which differs by friction."""
    return forces(friction) * (1 + share * (0.05 - 0.3 * friction) * np.exp(-STRAIN / 0.02))


def fitted(measured, model=forces, check=False):
    better = (lambda frictions: {each: finer(each) for each in frictions}) if check else None
    return fit(measured, {each: model(each) for each in FRICTIONS}, better)


def covered(fits):
    """Of 40 intervals of 95 % at least 34 cover the reference value, but for one case in 700 (binomial)."""
    return [
        sum(low <= reference <= high for _, low, high in intervals) >= 34
        for reference, intervals in (
            (1.3, [each.factor for each in fits]),
            (0.4, [each.friction for each in fits]),
        )
    ]


@pytest.mark.parametrize("proportional", [False, True])
def test_intervals_cover_the_truth_as_often_as_they_say(proportional):
    fits = [fitted(noisy(seed, proportional)) for seed in range(40)]
    assert covered(fits) == [True, True]
    assert sum(each.proportional == proportional for each in fits) >= 34
    assert np.mean([each.noise for each in fits]) == pytest.approx(0.02, rel=0.1)
    assert max(each.friction[2] - each.friction[1] for each in fits) < 0.96


@pytest.mark.parametrize("share", [1.0, 1.2])
def test_a_more_accurate_model_brings_the_truth_into_intervals(share):
    """The model is right, or errs in its turn by 0.2 of its correction."""
    curves = [noisy(seed, True, lambda friction: finer(friction, share)) for seed in range(40)]
    assert not all(covered([fitted(each) for each in curves]))
    fits = [fitted(each, check=True) for each in curves]
    assert covered(fits) == [True, True]
    assert np.mean([np.ptp(each.friction) for each in fits]) < 0.5


@pytest.mark.parametrize(
    ("model", "named"),
    [
        (
            lambda friction: forces(0.4),
            "friction cannot be determined from this curve: all such values between",
        ),
        (lambda friction: forces(min(friction, 0.4)), "friction is at least 0."),
        (lambda friction: forces(max(friction, 0.4)), "friction is at most 0.4"),
        (lambda friction: forces(friction) * np.exp(-10 * STRAIN), "neighbours correlate by 0."),
        (forces, "the intervals do not contain the error of the model"),
    ],
)
def test_parameters_that_a_curve_does_not_determine_are_named(model, named):
    (remark,) = [each for each in fitted(noisy(1, True), model).remarks() if named in each]
    assert remark


def test_modulus_of_a_tied_cell_by_the_commands(tmp_path, monkeypatch):
    """Forces are proportional to it: of a curve without noise it is exact, and the factor of the measured one."""
    monkeypatch.chdir(tmp_path)

    def knitstudy(*arguments, code=0):
        ended = CliRunner().invoke(main, [str(each) for each in arguments])
        assert ended.exit_code == code, ended.stderr
        return ended

    keys = ("pattern.loops=1", "pattern.rows=1", "rom.contacts_from=null", "mesh.beam_size=1.5", "name=cell")
    changes = [word for key in keys for word in ("--set", key)]
    knitstudy("run", "rom3d-tie-course", *changes)
    result = tmp_path / "runs" / "simulation" / "cell.nc"
    history = read_dataset(result)
    table = pd.DataFrame({"strain (%)": 100 * history["strain"], "load (N)": 1.25 * history["force"]})
    table.to_csv("lab.csv", index=False)
    geometry = read_dataset(next((tmp_path / "runs" / "geometry").glob("*.nc")))
    size = ("--width", float(geometry["course_spacing"]))
    rows = dict(
        line.split("\t")[:2] for line in knitstudy("compare", result, "lab.csv", *size).stdout.splitlines()
    )
    assert float(rows["nearest Young's modulus"]) == pytest.approx(1.25 * 1.3e9, rel=1e-5)
    assert float(rows["distance"]) == pytest.approx(20, rel=1e-5)
    named = knitstudy("fit", "rom3d-tie-course", "lab.csv", *changes).stderr  # the width is kept
    assert "friction cannot be determined: no yarns of the scene slide with friction" in named
    actual = read_table("runs/fit/cell-lab.csv").iloc[0]
    assert actual["note"].startswith("friction cannot be determined")
    for column in ("value", "95 % from", "to"):
        assert actual[column] == pytest.approx(1.25 * 1.3e9, rel=1e-9)
    assert (tmp_path / "runs" / "fit" / "cell-lab.png").stat().st_size > 10_000
    assert (tmp_path / "runs" / "simulation" / "cell-lab.png").stat().st_size > 10_000
    refused = knitstudy("compare", result, "lab.csv", "--branch", "unloading", code=1).stderr
    assert "no unloading of cycle 1" in refused
    # Of simulations that end early, those points are used that they reach.
    half = history.isel(increment=slice(history.sizes["increment"] * 2 // 3))
    early = SimpleNamespace(
        history=half, geometry=read_dataset(next((tmp_path / "runs" / "geometry").glob("*.nc")))
    )
    monkeypatch.setattr("knitstudy.run.simulations.simulate", lambda *_, **__: early)
    named = knitstudy("fit", "rom3d-tie-course", "lab.csv", *changes).stderr
    assert f"{half.sizes['increment'] - 1} of {len(table)} points" in named
    assert read_table("runs/fit/cell-lab.csv")["value"][0] == pytest.approx(1.25 * 1.3e9, rel=1e-9)
    monkeypatch.setattr("knitstudy.run.simulations.simulate", lambda *_, **__: pytest.fail("simulated"))
    for option, value, message in (
        ("--branch", "unloading", "has no unloading to fit; set load.turns"),
        ("--check", "fidelty=spline_yarns", "did you mean 'fidelity'"),
        ("--check", "load.strain=1e-6", "4 points are needed; set a larger load.strain"),
    ):
        refused = knitstudy("fit", "rom3d-tie-course", "lab.csv", *changes, option, value, code=1)
        assert message in refused.stderr
