"""Promises from a sample of knits: order statistics, the sample itself, and rows of the table."""

import os
import signal
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
import trade as sample
import xarray as xr
from branches import STOPS, begun_finely
from refusals import refusal
from sample_points import drawn, points_of
from trade import FOUND, measure_sample, sampled

from knitstudy.errors import GeometryError, KnitstudyError
from knitstudy.measures.questions import BEAM_SLIP, LOSS, QUESTIONS, TOTAL, answers, curve_force
from knitstudy.run.advice import ERROR
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.advice.sample import SampleCase, Trade, load_trade
from knitstudy.run.configuration import asked_of
from knitstudy.run.trade import measure, reference_values, rows_of, run

SAMPLE = load_trade().model_copy(update={"coverage": 0.90, "confidence": 0.95})
TIED = SampleCase("cut_knit", "tied")


@pytest.mark.parametrize(("count", "rank"), [(28, None), (29, 29), (45, 45), (46, 45), (48, 47), (100, 96)])
def test_ranks_are_those_of_tables(count, rank):
    """Wilks: 29 values for 90 % at 95 %, the second largest from 46 on; of 100 the fifth (P(Bin <= 94) is 0.942)."""
    assert SAMPLE.bound(range(1, count + 1)) == (np.inf if rank is None else rank)


def errors(random, count, settings=1):
    """Return errors of model settings that fall from one to the next, with heavy tails."""
    common, own = random.standard_t(4, count), random.standard_t(4, (settings, count))
    levels = np.log(0.08) - 0.7 * np.arange(settings)
    return np.exp(levels[:, None] + 0.3 * common + 0.3 * own)


def test_choosing_the_cheapest_does_not_break_promises():
    """Settings are chosen where their bounds look good: 95 % of the accuracies that were asked for still hold."""
    random, held = np.random.default_rng(2), []
    for _ in range(40):
        bounds = np.array([SAMPLE.bound(each) for each in errors(random, 48, settings=6)])
        there = errors(random, 60, settings=6)
        accuracy = np.exp(random.uniform(np.log(0.01), np.log(0.2), 60))
        good = bounds[:, None] <= accuracy
        taken = there[good.argmax(axis=0), np.arange(60)]
        held += list((taken <= accuracy)[good.any(axis=0)])
    assert len(held) > 500
    assert np.mean(held) >= 0.95


@pytest.mark.parametrize(("failed", "promised"), [(0, True), (1, True), (2, False), (48, False)])
def test_runs_that_fail_have_infinite_errors(failed, promised):
    (values,) = errors(np.random.default_rng(4), 48)
    values[:failed] = np.inf
    assert np.isfinite(SAMPLE.bound(values)) == promised


@pytest.fixture(scope="module")
def trade():
    return load_trade()


def test_the_sample_is_the_same_every_time_and_replaces_loops_that_cannot_be_made(trade, monkeypatch):
    def lay_out(scene):
        if scene.pattern.course_spacing < 4 * scene.yarn.diameter:
            raise GeometryError("too narrow")

    monkeypatch.setattr(sample, "lay_out", lay_out)
    table = sampled(trade, 48, {})
    assert table.equals(sampled(trade, 48, {}))
    prefix = sampled(trade, 12, {})
    assert table[: len(prefix)].equals(prefix), "knits do not depend on how many there are"
    knits = table[table["outcome"] == FOUND]
    assert len(knits) == 48 < len(table)
    assert knits["course"].between(4, trade.box["course"][1]).all()
    assert set(knits["direction"]) == {"course", "wale"}
    assert 0.3 < knits["slips"].mean() < 0.7
    known = {inputs: "known" for inputs, _ in islice(points_of(trade), 240)}
    with refusal(r"only 0 of 240 points have a loop"):
        sampled(trade, 12, known)


def test_a_knit_is_its_inputs_at_any_scale(trade):
    for case in trade.cases():
        for point, slips in islice(points_of(trade), 8):
            inputs = drawn(trade, case, point, slips)
            problem = PhysicalProblem(trade.scene(case, inputs), trade)
            assert problem.outside == ""
            assert problem.digest == PhysicalProblem(problem.scene.scaled(1e-3, 1e6), trade).digest
            assert problem.case == case
            there = problem.inputs
            assert (there.course, there.wale) == pytest.approx((inputs.course, inputs.wale))
            assert there.strain == inputs.strain
            if case.specimen == "cut_knit":
                cell = problem.endless()
                assert cell.inputs.direction == inputs.direction
                assert cell.case == replace(case, specimen="cell")


def test_beams_answer_by_the_crossings_of_the_middle_cell(trade):
    """Force and slip are the means of its four crossings; the slip of a tied crossing counts as 0."""
    case = SampleCase("cut_knit", "touching")
    inputs = replace(next(points_of(trade))[0], friction=0.3, loops=3, rows=3)
    scene = trade.scene(case, inputs).vary(trade.settings_of(case)["beams"])
    middle = slice(16, 20)  # of 36 crossings: row by row, column by column, four a cell
    force, slip = np.full((2, 36, 3), 99.0), np.full((2, 36), 99.0)
    force[1, middle] = [[3.0, 0.0, 4.0], [0.0, 1.0, 0.0], [0.0, 0.0, -2.0], [0.0, 0.0, 0.0]]
    slip[1, middle] = [2e-6, np.nan, 4e-6, 6e-6]
    columns = {"crossing_force": (("increment", "crossing", "xyz"), force)}
    columns |= {"crossing_slip": (("increment", "crossing"), slip), "strain": ("increment", [0.0, 0.05])}
    actual = answers(QUESTIONS["contact"], scene, xr.Dataset(columns), None, 0.05)
    assert actual == pytest.approx({TOTAL: 2.0, BEAM_SLIP: 3e-6})


def test_a_cycle_loses_the_work_of_its_turn_less_what_comes_back(trade):
    """3 J up to the turn, 1 J back until the force ends; to press the cell on takes work again."""
    case = SampleCase("cell", "touching", "cycle")
    scene = trade.scene(case, drawn(trade, case, *next(points_of(trade)))).vary({"fidelity": "beam"})
    work = xr.DataArray(
        [[0.0, 1.0, 3.0, 2.0, 2.5]], coords={"form": ["external"]}, dims=("form", "increment")
    )
    history = xr.Dataset({"energy": work, "strain": ("increment", [0.0, 0.1, 0.2, 0.1, 0.06])})
    actual = {name: answers(each, scene, history, None, 0.2) for name, each in QUESTIONS.items()}
    assert {name: each for name, each in actual.items() if each} == {"loss": {LOSS: 2.0}}


def test_yarns_slip_at_large_strains_even_where_they_do_not_at_small_ones(trade):
    point, _ = next(points_of(trade))
    small, large, cycle = (SampleCase("cell", "touching", path) for path in ("small", "large", "cycle"))
    assert np.isinf(drawn(trade, small, point, slips=False).friction)
    assert {drawn(trade, case, point, slips=False).friction for case in (large, cycle)} == {point.friction}


def test_beams_do_not_take_a_cell_whose_yarns_cannot_slip(trade):
    point, _ = next(points_of(trade))
    cells = [
        trade.scene(SampleCase("cell", "touching"), replace(point, friction=each)) for each in (0.3, np.inf)
    ]
    assert ["beams" in PhysicalProblem(cell, trade).settings for cell in cells] == [True, False]


def values(records):
    return {each["model setting"]: each["values"] for each in records}


def record(setting, force, reason=""):
    return {
        "model setting": setting,
        "values": {} if reason else {"force": force},
        "reason": reason,
    } | dict.fromkeys(("seconds", "memory", "unknowns", "increments"), 1)


def test_knits_begin_with_small_increments_to_tell_branches_apart(trade):
    case = SampleCase("cut_knit", "touching")
    fine = begun_finely(trade, case, "yarns2")
    keys = trade.settings_of(case)
    assert fine.settings_of(case) == keys | {"yarns2": keys["yarns2"] | {"load.stops": STOPS}}
    knit = fine.scene(case, next(points_of(trade))[0])
    assert knit.vary(fine.settings_of(case)["yarns2"]).load.stops == tuple(STOPS)


def test_errors_are_to_the_limit_of_the_degrees(trade):
    """8, 9 and 9.5 N tend to 10 N, open by half of the last step; a failed run is infinitely wrong."""
    made = {"honeycomb": 12.0, "yarns2": 8.0, "yarns3": 9.0, "yarns4": 9.5}
    records = [record(*each) for each in made.items()] + [record("network", 0.0, "stopped")]
    (reference,) = reference_values({"a": values(records)}, TIED, trade).values()
    actual = rows_of(records, TIED, {}, trade, reference)
    assert {row["question"] for row in actual} == {"force", "curve"}
    rows = {row["model setting"]: row for row in actual if row["question"] == "force"}
    assert rows["honeycomb"]["uncertainty of the reference value [1]"] == pytest.approx(0.025)
    assert rows["honeycomb"][ERROR] == pytest.approx(12 / 9.75 - 1)
    assert rows["yarns3"][ERROR] == pytest.approx(0.1 + 9 / 9.75 - 0.9)
    assert np.isinf(rows["network"][ERROR])
    assert rows["network"]["reason"] == "stopped"
    (reference,) = reference_values({"a": values(records[:2])}, TIED, trade).values()
    (row,) = rows_of([records[0], record("yarns3", 0.0, "stopped")], TIED, {}, trade, reference)
    assert row["model setting"] == "", "one degree has no limit"
    assert row["reason"].endswith("which did not end: yarns3: stopped")


@pytest.mark.parametrize(("highest", "share"), [(2, 1 / 9), (3, 0.14)])
def test_degree_3_is_the_reference_value_where_degree_4_did_not_run(trade, highest, share):
    """At most 1.2 N of 10, open by half of the last 0.4: 14 %; where only two tell, the last change."""
    runs = {"few": {"yarns2": {"force": 8.0}, "yarns3": {"force": 9.0}}}
    for number, step in enumerate([0.4, 0.2, 0.1][:highest]):
        series = {"yarns2": 10 - 9 * step, "yarns3": 10 - 3 * step, "yarns4": 10 - step}
        runs[f"k{number}"] = {setting: {"force": value} for setting, value in series.items()}
    reference = reference_values(runs, TIED, trade)["few"].at("force", 1.0)
    assert (reference.value, reference.uncertainty / reference.value) == (9.0, pytest.approx(share))


def test_slack_yarns_say_nothing_of_the_uncertainty_of_curves(trade):
    """One knit carries next to nothing at half of its strain, by degree 3 ten times the limit: no curve begins."""
    half = curve_force(0.5)

    def degrees(*curve):
        forces = zip((2, 3, 4), (9.0, 9.1, 9.15), curve, strict=False)
        return {f"yarns{degree}": {"force": force, half: value} for degree, force, value in forces}

    runs = {f"k{number}": degrees(4.5, 4.8, 4.9) for number in range(3)}
    runs |= {"slack": degrees(1e-4, 1e-2, 1e-3), "few": degrees(3.0, 3.1)}
    estimate = reference_values(runs, TIED, trade)["few"].at(half, 1.0)
    assert estimate.uncertainty == pytest.approx(3.1 * 0.175 / 4.95)  # 4.8 of 4.95, open by 0.025


@pytest.mark.parametrize("case", [TIED, SampleCase("cell", "touching")], ids=str)
@pytest.mark.parametrize(
    ("end", "reason"),
    [
        (KnitstudyError("no\nroom"), "no room"),
        (ValueError("nan"), "ValueError: nan"),
        (None, "took more than 60 s"),
    ],
)
def test_a_run_leaves_a_record_however_it_ends(trade, case, end, reason, monkeypatch, tmp_path):
    def simulate(scene, folder, **options):
        raise end if end else os.kill(os.getpid(), signal.SIGXCPU)

    monkeypatch.setattr("knitstudy.run.trade.simulate", simulate)
    hasty = trade.model_copy(update={"limit": 60})
    record = run(PhysicalProblem(trade.scene(case, next(points_of(trade))[0]), hasty), "yarns2", tmp_path)
    assert record["reason"].startswith(reason)
    assert (record["model setting"], record["values"]) == ("yarns2", {})


def test_a_pair_is_no_knit_to_measure(tmp_path):
    pair, *_ = asked_of("pair-slid-coarse", {})
    with refusal("specimen is pair, but models are measured on knits"):
        measure(pair, tmp_path)


@pytest.mark.parametrize("changes", [{"load.strain": -0.02}, {"load.largest_force": 10.0}])
def test_models_are_compared_in_tension_to_a_strain(changes, tmp_path):
    problem, *_ = asked_of("cell-course", {"load.strain": 0.02} | changes)
    with refusal("models are compared in tension and to a strain"):
        measure(problem, tmp_path)


def test_a_campaign_goes_on_where_it_was(trade, monkeypatch, tmp_path):
    """A record a run, kept when killed, and made again where models behave otherwise. Every fourth has degree 4."""
    ran = []

    def run(problem, setting, folder):
        ran.append(f"{problem.scene.name} {setting}")
        if len(ran) == 50:
            raise KeyboardInterrupt
        return record(setting, 1.0)

    monkeypatch.setattr(sample, "run", run)
    monkeypatch.setattr(sample, "lay_out", lambda scene: None)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        measure_sample(5, tmp_path)
    table = measure_sample(5, tmp_path)
    assert len(ran) == len(set(ran)) + 1, "only the killed run again"
    assert set(table["knit"]) == {f"knit{number:03}" for number in range(1, 6)}
    assert set(table.loc[table["model setting"] == "yarns4", "knit"]) == {"knit001", "knit005"}
    assert set(measure_sample(2, tmp_path)["knit"]) == {"knit001", "knit002"}
    before = len(ran)
    recorded = Trade.behaviours
    moved = {"knit spline_yarns touching"}

    def behaviours(self, case):
        return {
            name: f"{digest} moved" if self.group_of(case, name) in moved else digest
            for name, digest in recorded(self, case).items()
        }

    monkeypatch.setattr(Trade, "behaviours", behaviours)
    measure_sample(1, tmp_path)
    assert {name.split()[0] for name in ran[before:]} >= {"knit001-cut-knit-touching"}
