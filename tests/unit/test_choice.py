"""A question chooses a model: the cheapest with a promise that is good enough, or a message with the nearest ones."""

from dataclasses import asdict
from itertools import islice

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from refusals import REFUSED, refusal
from sample_points import drawn, points_of

from knitstudy.datasets import write_table
from knitstudy.errors import ConfigurationError
from knitstudy.run import advice as choice
from knitstudy.run.advice import Requirements, choose
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.advice.sample import SampleCase, load_trade
from knitstudy.run.commands.main import main
from knitstudy.run.configuration import asked_of, load_scene, load_scenes
from knitstudy.run.plan import Plan

MEASURED = {  # error, seconds and memory of model settings; beams fail on every third knit
    ("cut_knit", "tied"): {
        "honeycomb": (3.0, 1, 4),
        "network": (0.04, 2, 15),
        "yarns2": (0.02, 10, 60),
        "yarns3": (0.02, 10, 60),
    },
    ("cut_knit", "touching"): {"beams": (0.03, 5, 20), "yarns2": (0.02, 10, 60)},
    ("cell", "tied"): {"yarns2": (0.01, 0.5, 9)},
}


TIED = SampleCase("cut_knit", "tied")


def row(problem, setting, measured, scatter=1.0):
    columns = (choice.ERROR, choice.SECONDS, choice.MEMORY)
    values = dict(zip(columns, np.multiply(scatter, measured), strict=True)) | asdict(problem.inputs)
    about = {"knit": problem.scene.name, "problem": problem.digest, "case": str(problem.case)}
    about |= {"model setting": setting}
    return (
        dict.fromkeys((*choice.COLUMNS, *choice.OF_OWN), 0)
        | about
        | {"question": "force", "reason": ""}
        | values
    )


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    return made(tmp_path_factory.mktemp("kept") / "trade.csv", 48)


def made(path, count):
    """Write a table of so many knits, and of one without a reference value."""
    trade, random = load_trade(), np.random.default_rng(1)
    rows = []
    for number, (inputs, _) in enumerate(islice(points_of(trade), count)):
        for (specimen, yarns), settings in MEASURED.items():
            problem = PhysicalProblem(trade.scene(SampleCase(specimen, yarns), inputs, f"k{number}"), trade)
            scatter = random.uniform(0.95, 1.0)
            rows += [row(problem, name, each, scatter=scatter) for name, each in settings.items()]
            if number % 3 == 0 and yarns == "touching":
                rows[-2] |= {"error [1]": np.inf}
    nothing = row(problem, "", (np.nan, np.nan, np.nan))
    rows.append(nothing | {"knit": "open", "case": str(TIED)})
    write_table(pd.DataFrame(rows), path)
    return path


LOOP = {"pattern.course_spacing": 5e-3, "pattern.wale_spacing": 6e-3, "yarn.diameter": 1e-3}


@pytest.fixture
def ask(kept, monkeypatch, tmp_path):
    """Function that chooses for a scene with changed keys by the made-up table."""
    monkeypatch.setattr(choice, "TRADE_KEPT", kept)
    monkeypatch.chdir(tmp_path)

    def asked(changes=(), scene="yarns-tie-course", **asks):
        problem = PhysicalProblem(load_scene(scene).vary(LOOP | dict(changes)))
        return choose(problem, Requirements(question="force", **asks), f"scene {scene!r}")

    return asked


@pytest.mark.parametrize(("accuracy", "setting"), [(5.0, "honeycomb"), (0.05, "network"), (0.021, "yarns2")])
def test_the_cheapest_that_is_promised_is_taken(ask, accuracy, setting):
    """Yarns of degrees 2 and 3 tie in price and error: the name decides."""
    actual = ask(accuracy=accuracy)
    assert actual.setting.name == setting
    assert 0.9 * MEASURED["cut_knit", "tied"][setting][0] < actual.setting.error <= accuracy
    assert actual.promises.basis.startswith("on 75 % of the knits in the box")
    assert actual.promises.basis.endswith(
        "by 48 that were measured and without 1 on which solid yarns did not end"
    )
    assert {each.name for each in actual.settings} == set(MEASURED["cut_knit", "tied"])


def test_a_model_that_fails_too_often_is_not_promised(ask):
    assert [each.name for each in ask(scene="yarns-isotropic-course", accuracy=0.05).settings] == ["yarns2"]


def test_errors_of_slip_are_promised_by_knits_that_slip():
    case, trade = SampleCase("cut_knit", "touching"), load_trade()
    points = [drawn(trade, case, *point) for point in islice(points_of(trade), 48)]
    problems = [PhysicalProblem(trade.scene(case, inputs), trade) for inputs in points]
    rows = [
        row(each, "yarns2", (0.01 if np.isinf(each.inputs.friction) else 0.3, 1, 1)) | {"question": question}
        for each in problems
        for question in ("contact", "force")
    ]
    for each in problems[:8]:  # of both kinds
        promised = {of: choice.Promises(each, rows).settings(of)[0].error for of in ("contact", "force")}
        assert promised == {"contact": 0.01 if np.isinf(each.inputs.friction) else 0.3, "force": 0.3}


@pytest.mark.parametrize(("key", "value", "message"), REFUSED["outside"])
def test_outside_of_the_box_nothing_is_promised(ask, key, value, message):
    with pytest.raises(ConfigurationError) as raised:
        ask({key: value}, accuracy=5.0)
    assert message in str(raised.value)
    assert key in str(raised.value) or key == "yarn.diameter"
    assert "`knitstudy measure yarns-tie-course`" in str(raised.value)


def test_a_loop_of_control_points_counts_by_its_length(ask):
    """That of the study is 30.8 diameters long, 3.4 % over that of Peirce; not 1."""
    problem, _, _ = asked_of("yarns-tie-course", {})
    assert problem.length == pytest.approx(1.034, abs=1e-3)
    actual = choose(problem, Requirements(question="force", accuracy=0.05), "").promises.basis
    assert actual.endswith("drawn for spacings and length, and this one has control points")


def test_measurements_of_a_knit_are_of_its_loop_its_cells_and_its_cycle():
    own, _, _ = asked_of("yarns-isotropic-course", {})
    assert own.digest != PhysicalProblem(own.scene.vary({"geometry.alpha": 7.0})).digest
    keys = LOOP | {
        "fidelity": "spline_yarns",
        "interaction": "isotropic",
        "load.turns": [0.2],
        "load.strain": 0.03,
    }
    cell = load_scene("cell-course").vary(keys)
    others = (
        {},
        {"load.strain": 0.05},
        {"load.turns": [0.2, 0.1, 0.2]},
        {"pattern.loops": 2, "pattern.rows": 2},
    )
    assert len({PhysicalProblem(cell.vary(changes)).digest for changes in others}) == len(others)


def test_a_cycle_has_one_turn_and_comes_back(ask):
    cell = LOOP | {"interaction": "isotropic", "load.strain": 0.03, "load.turns": [0.2]}
    there = PhysicalProblem(load_scene("cell-course").vary({"fidelity": "spline_yarns"} | cell))
    assert (str(there.case), there.inputs.strain, there.outside) == ("cell-touching-cycle", 0.2, "")
    for changes, message in (
        ({"load.turns": [0.2, 0.03, 0.2]}, "load.turns is [0.2, 0.03, 0.2]"),
        ({"load.strain": 0.1}, "load.strain 0.1, but models were measured with one turn and back to 30%"),
        ({"load.turns": [0.7]}, "load.turns is 0.7, but models were measured from 0.05 to 0.6"),
    ):
        assert message in PhysicalProblem(there.scene.vary(changes)).outside


def test_stops_of_the_load_have_their_price(ask):
    """Networks were measured in five increments: 50 that a scene asks for take ten times as long."""
    one, other = (
        ask(changes, accuracy=0.05) for changes in ({}, {"load.stops": [1e-3 * k for k in range(1, 50)]})
    )
    assert one.setting.name == other.setting.name == "network"
    assert other.setting.seconds == pytest.approx(10 * one.setting.seconds)
    assert other.setting.most_seconds == pytest.approx(10 * one.setting.most_seconds)


def test_cells_of_several_loops_have_no_promise(ask):
    """Their price is not that of one loop."""
    with refusal(r"pattern\.loops is 10, but models were measured on cells of one"):
        ask({"pattern.loops": 10, "pattern.rows": 10}, scene="cell-course", accuracy=5.0)


def test_a_knit_of_ones_own_takes_its_own_measurements(ask):
    changes = {"yarn.poisson_ratio": 0.49}
    mine = PhysicalProblem(load_scene("yarns-tie-course").vary(LOOP | changes).scaled(1e-2, 1e3))
    rows = [row(mine, "network", (0.3, 2, 9)), row(mine, "yarns2", (np.inf, 2, 9))]
    other = ", by other physics: measure it again (measured.csv)"
    recorded = mine.trade.behaviours(mine.case)
    now = [recorded[each["model setting"]] for each in rows]
    for made_by, remark in ((now, ""), ("older", other)):
        write_table(pd.DataFrame(rows).assign(behaviour=made_by), choice.OWN)
        actual = ask(changes, accuracy=0.5)
        assert (actual.setting.name, actual.setting.error) == ("network", 0.3)
        assert actual.promises.basis == f"on this very knit{remark}"
    with refusal(r"yarn\.poisson_ratio is 0\.48"):
        ask({"yarn.poisson_ratio": 0.48}, accuracy=0.5)
    for text in (b"error [1]\nlarge\n", ",".join(choice.COLUMNS[:-1]).encode(), "Länge".encode("latin-1")):
        choice.OWN.write_bytes(text)
        with refusal(r"measured\.csv: is not a table of errors and prices"):
            ask(accuracy=0.5)


@pytest.mark.parametrize(("asks", "message"), REFUSED["questions"])
def test_a_question_without_an_answer_names_the_nearest_choices(ask, asks, message, monkeypatch):
    monkeypatch.setattr(choice, "without_edges", lambda *_: "if no edges matter, a cell")
    asks = {name: tuple(value) if name == "among" else value for name, value in asks.items()}
    with refusal(message):
        ask(**asks)


def test_the_endless_cell_is_offered_where_a_knit_has_no_promise(ask):
    with refusal(r"pattern\.loops is 30.*; if no edges matter, specimen: cell by yarns2"):
        ask({"pattern.loops": 30}, accuracy=0.05)


def planned(accuracy, **size):
    """Return what the command said of the made-up knit at an accuracy, with other numbers of cells."""
    arguments = ["plan", "yarns-tie-course", "--question", "force", "--accuracy", accuracy]
    changes = LOOP | {f"pattern.{name}": count for name, count in size.items()}
    arguments += [each for key, value in changes.items() for each in ("--set", f"{key}={value}")]
    return CliRunner().invoke(main, arguments)


def test_the_command_names_the_choice_and_where_too_few_were_measured(ask, kept, monkeypatch, tmp_path):
    asked, taken, offer, *rest = planned("0.05").stdout.splitlines()
    assert asked == "yarns-tie-course: force within 5 %, tie"
    assert taken.startswith("take network: error of the simulation at most ")
    assert offer.startswith("if no edges matter, specimen: cell by yarns2")
    assert sum(line.endswith("\ttaken") for line in rest) == 1
    assert rest[-1] == "--set fidelity=rom3d --set rom.joint=patch --set solver.increments=5"
    monkeypatch.setattr(choice, "TRADE_KEPT", made(tmp_path / "few.csv", 5))
    (message,) = planned("0.05").stderr.splitlines()
    assert "5 knits have been measured of cut-knit-tied (few.csv): a promise takes 12" in message


def test_of_a_large_knit_the_command_says_the_cell_first_and_what_the_whole_costs(ask):
    """Costs of 30 x 30 cells by the laws of jobs, errors of 4 x 4 cells by the sample."""
    offer, without, head, *rows = planned("0.05", loops=30, rows=30).stdout.splitlines()
    assert offer.startswith("if no edges matter, specimen: cell by yarns2: error of the simulation at most ")
    assert without.startswith("no error is promised of 30 x 30 cells")
    assert head.split("\t") == ["model", "seconds", "MB", "error at most on 4 x 4 cells [%]"]
    costs = {
        name: (float(seconds), float(error)) for name, seconds, _, error in (row.split("\t") for row in rows)
    }
    assert costs["yarns2"][0] > 5 * costs["network"][0]
    assert costs["honeycomb"][1] > costs["network"][1] > costs["yarns2"][1]


def test_a_large_knit_that_was_measured_itself_is_chosen_for_as_any_other(ask):
    knit = LOOP | {"pattern.loops": 30, "pattern.rows": 30}
    problem, _, _ = asked_of("yarns-tie-course", knit)
    write_table(pd.DataFrame([row(problem, "network", (0.03, 2, 9))]), choice.OWN)
    assert "take network: error of the simulation at most 3 %" in planned("0.05", loops=30, rows=30).stdout
    message = planned("0.01", loops=30, rows=30)
    assert message.exit_code == 1
    assert "ask.accuracy is 0.01, but nearest comes network" in message.stderr


@pytest.mark.parametrize(
    "changes",
    [
        {"pattern.courses_per_metre": 200.0, "pattern.wales_per_metre": 150.0},
        {"yarn.tex": 100.0, "yarn.density": 900.0},
        {"specimen": "cell"},
        {"interaction": "tie"},
        {"load.lateral": "free"},
    ],
    ids=lambda changes: " ".join(changes),
)
def test_a_question_is_about_the_scene_that_a_run_with_the_same_options_simulates(changes):
    """Counts per metre take the place of spacings, and keys that another kind does not have are left out."""
    for name in ("yarns-isotropic-course", "stitches-plain-course"):
        run = load_scene(name, changes={"fidelity": "spline_yarns"} | changes)
        problem, _, _ = asked_of(name, changes)
        for part in ("yarn", "pattern", "load"):
            assert problem.scene.sections[part] == run.sections[part]


def test_a_chosen_model_is_named_once(ask, caplog):
    changes = {**LOOP, "fidelity": "auto", "ask.question": "force", "ask.accuracy": 0.05}
    with caplog.at_level("INFO", "knitstudy.run"):
        scene = load_scene("yarns-tie-course", changes=changes)
    assert (scene.fidelity, scene.yarn.diameter) == ("rom3d", 1e-3)
    (message,) = caplog.messages
    assert message.startswith("force within 0.05: take network: error of the simulation at most ")
    caplog.clear()
    load_scene("yarns-tie-course", changes=LOOP)
    assert caplog.messages == []


def test_a_scene_whose_question_no_model_answers_can_be_simulated_by_a_named_one(config):
    """Its error offers to name a fidelity."""
    keys = "fidelity: auto, ask.question: force, ask.accuracy: 0.05, load.strain: 0.04"
    family = f"studies: []\nkeys: {{knit: plain}}\nscenes:\n- name: mine\n  keys: {{{keys}}}\n"
    (config / "scenes" / "9-asks.yaml").write_text(family)
    for changes in ({}, {"load.strain": 0.03}):
        with refusal("scene 'mine': specimen is 'knit', but models were measured on cut_knit and cell"):
            load_scene("mine", config, changes)
    mine = load_scene("mine", config, {"fidelity": "rom3d", "rom.contacts_from": None})
    assert (mine.fidelity, mine.load.strain) == ("rom3d", 0.04)
    named = Plan.of(config).labelled(mine).name
    assert named == f"mine-{mine.hash[:8]}", "the file has another scene of this name"
    with refusal("unknown key 'ask.accuracy' where fidelity is not auto"):
        load_scene("mine", config, {"fidelity": "rom3d", "ask.accuracy": 0.1})


def test_scenes_of_a_family_may_ask(ask, config):
    """Read as everything reads them: an ordinary scene; keys of a model are refused."""
    family = config / "scenes" / "9-asks.yaml"
    keys = "fidelity: auto, ask.question: force, ask.accuracy: 0.05, load.strain: 0.04"
    family.write_text(f"studies: []\nkeys: {{knit: plain}}\nscenes:\n- name: mine\n  keys: {{{keys}}}\n")
    problem, _, _ = asked_of("mine", {}, config)
    write_table(pd.DataFrame([row(problem, "network", (0.03, 2, 9))]), choice.OWN)
    mine = load_scenes(config)["mine"]
    assert (mine.fidelity, mine.value("rom.joint"), mine.load.strain) == ("rom3d", "patch", 0.04)
    assert load_scene("mine", config) == mine
    family.write_text(family.read_text().replace("load.strain", "solver.increments: 4, load.strain"))
    with refusal(r"solver\.increments is 4 but must be left out"):
        load_scenes(config)
