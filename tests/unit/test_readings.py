"""Readings of the paper: their scenes, the claims that they touch, and the verdicts that follow."""

from pathlib import Path

import pandas as pd
import pytest
import study
import synthetic
from refusals import refusal

from knitstudy.datasets import read_table, write_table
from knitstudy.errors import ConfigurationError
from knitstudy.knit.contacts.contacts import extract
from knitstudy.knit.geometry.lay_out import initial_loop
from knitstudy.knit.geometry.specimens import plain_knit
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import Reference, problem_of, transferred_uncertainty
from knitstudy.measures.response import FORCE, LARGEST_U_Z
from knitstudy.paper.claims import CLAIMS
from knitstudy.paper.claims.evidence import evidence_of
from knitstudy.paper.claims.verdicts import (
    INPUT,
    PRINTED,
    READING,
    Reading,
    as_printed,
    both_of,
    conclude,
    counted,
    findings,
    readings_of,
    under_readings,
)
from knitstudy.paper.tables.joints import RESULTS
from knitstudy.run.catalogue import TABLES
from knitstudy.run.configuration import load_scenes

SIZE_MISSED = "direction holds, size does not"
RESOURCES = Path(__file__).resolve().parents[2] / "resources" / "reference"


def table(kind=READING, against=""):
    """Return readings as a table: of friction, of the clearance, and one without scenes."""
    rows = [
        Reading(
            "slippery",
            kind,
            "friction",
            "less friction",
            "friction",
            "Table 1",
            "^yarns-iso",
            "inputs-friction010-iso",
        ),
        Reading("loose", kind, "clearance", "loose", "tight", against, "^yarns-", "inputs-clearance0040-"),
        Reading("whole", kind, "specimen", "whole yarns", "cut cells", against, "^", "reading-whole-"),
    ]
    return pd.DataFrame([vars(each) for each in rows])


@pytest.fixture(scope="module")
def sources(plain_scene, knit, paper, cases):
    """Sources of table and figure: the reference is of the base alone, and all histories are as there."""
    history, scenes = synthetic.contact_history(knit), study.varied(plain_scene)
    contacts = synthetic.with_kinematics(extract(knit, history))
    return {
        "histories": {name: study.in_contact(history, scene.interaction) for name, scene in scenes.items()},
        "contacts": dict.fromkeys(scenes, contacts),
        "geometry": synthetic.geometry(plain_knit(initial_loop(plain_scene), 2, 2)),
        "scenes": scenes,
        "paper": paper,
        "reference": study.reference(cases),
        "counted_unknowns": study.counted(),
    }


def found_with(sources, factors=None, readings=None):
    """Return findings by the names of readings, with factors of force and motion by scene."""
    histories = dict(sources["histories"])
    for name, (force, lift) in (factors or {}).items():
        kind = name.split("-")[-2]
        histories[name] = study.in_contact(histories[name], kind, force, lift)
    readings = table() if readings is None else readings
    found = findings(evidence_of(**sources | {"histories": histories}).named(), readings)
    return found, {each.reading.name: each for each in under_readings(found, readings)}


def test_estimate_is_as_uncertain_as_the_discretisation_is_off():
    """10.3 N beside 10 +- 0.1: off by 4 %."""
    known = Reference({(FORCE, 0.05): Estimate(10.0, 0.1), (LARGEST_U_Z, 0.08): Estimate(1e-3, 1e-4)})
    base, history = (synthetic.history(force=(0, 5, end), lift=1e-4) for end in (10.3, 20.0))
    transferred = transferred_uncertainty(known, base, history)
    assert transferred.at(FORCE, 0.05).value == 20.0
    assert transferred.at(FORCE, 0.05).uncertainty == pytest.approx(0.8)
    assert not transferred.at(LARGEST_U_Z, 0.08).known  # neither history gets there
    assert not transferred_uncertainty(Reference(), base, history).known


def test_readings_and_scenes_of_the_study_agree():
    """Scenes of varied inputs and of other specimens all judge claims, each in place of one of the base."""
    scenes = load_scenes()
    readings = readings_of(read_table(RESOURCES / "readings.csv"))[1:]
    assert {each.kind for each in readings} == {READING, INPUT, PRINTED}
    judging = {each.name: {each.scene_of(name) for name in scenes} & scenes.keys() for each in readings}
    meant = {name for name in scenes if name.startswith(("inputs-", "reading-"))}
    of_joints = {scene.name for scene in RESULTS["networks"].scenes(scenes)}
    assert not meant - set.union(*judging.values()) - of_joints
    for each in readings:
        own = [name for name in judging[each.name] if each.becomes and name.startswith(each.becomes)]
        assert own or not each.changes or each.name in ("surface", "global"), each.name
    with refusal("no column 'held'"):
        readings_of(table().drop(columns="held"))


def test_a_reading_within_another_changes_names_after_it():
    """A row of the table may build on rows above it alone."""
    rows = table().assign(name=["outer", "inner", "last"], within=["", "outer", ""])
    rows.loc[rows["name"] == "inner", ["changes", "becomes"]] = "^inputs-friction010-", "inputs-both-"
    outer, inner = readings_of(rows)[1:3]
    assert outer.scene_of("yarns-isotropic-course") == "inputs-friction010-isotropic-course"
    assert inner.scene_of("yarns-isotropic-course") == "inputs-both-isotropic-course"
    with refusal("reading 'inner' is within 'none', which no row before it has as its name"):
        readings_of(rows.assign(within=["", "none", ""]))


def test_claim_is_judged_by_the_scenes_of_the_reading(sources):
    """11 N of rough contact and 10 N with friction, each within 2 %: 10 % less is open, 30 % more the other order."""
    loose, slippery = "inputs-clearance0040-rough-course", "inputs-friction010-isotropic-course"
    _, actual = found_with(sources, {loose: (0.92, 1.0), slippery: (1.3, 1.0)})
    assert {name: each.verdicts["K5"] for name, each in actual.items()} == {
        "base": "reproduced",
        "slippery": "contradicted",
        "loose": "undecidable",
        "whole": "not yet run",
    }
    assert actual["slippery"].turned == ("K5",)
    assert actual["loose"].turned == actual["whole"].turned == ()
    assert "K5" in actual["loose"].touched
    assert "K1" not in actual["loose"].touched


@pytest.mark.parametrize(
    ("base", "slippery", "verdict", "under"),
    [
        (1.0, 1.0, "reproduced", "1 of 1"),
        (1.0, 0.3, "reproduced", "1 of 2"),
        (0.3, 1.0, "contradicted", "1 of 2"),
    ],
)
def test_verdict_says_under_how_many_readings_it_stands(sources, base, slippery, verdict, under):
    """With 0.3 of its motion friction moves less far than ties, against K6."""
    found, actual = moved(sources, base, slippery)
    concluded = conclude("K6", "", found, [*actual.values()])
    assert (concluded["verdict"], concluded["readings"]) == (verdict, under), concluded
    assert ("less friction" in concluded["depends on"]) == (base != slippery)


def test_findings_say_the_same_from_their_file(sources, tmp_path):
    """Texts of numbers alone, and of nothing, are read from the table as they are."""
    readings, claims = table(), read_table(RESOURCES / "paper_claims.csv")
    found, _ = moved(sources, 1.0, 0.3)
    write_table(found, path := tmp_path / "findings.csv")
    known = {"claims": claims, "readings": readings}
    for name in ("verdicts", "readings"):
        made = (TABLES.make(name, **known, findings=each) for each in (found, read_table(path)))
        pd.testing.assert_frame_equal(*made)


def moved(sources, base, slippery):
    """Return findings with factors of the motion with friction, at the base and with less friction."""
    factors = {
        "yarns-isotropic-course": (1.0, base),
        "inputs-clearance0040-isotropic-course": (1.0, base),
        "inputs-friction010-isotropic-course": (1.0, slippery),
    }
    reference = sources["reference"].copy()
    own = reference["problem"] == problem_of(sources["scenes"]["yarns-isotropic-course"])
    reference.loc[own & (reference["quantity"] == LARGEST_U_Z), ["value", "uncertainty"]] *= base
    return found_with(sources | {"reference": reference}, factors)


def test_claims_are_counted_in_plain_words():
    """Verdicts may be older than rules; what is true by construction counts nowhere."""
    rules = pd.DataFrame(
        [
            ("A", "before", "yes", "reproduced"),
            ("B", "after", "yes", "not reproduced"),
            ("C", "after", "yes", "reproduced"),
            ("D", "after", "true by construction: a gate", "reproduced"),
            ("E", "before", "yes", ""),
        ],
        columns=["id", "dated", "counts", "older verdict"],
    )
    grades = {"A": "reproduced", "B": "reproduced", "C": "contradicted", "D": "reproduced"}
    verdicts = pd.DataFrame(grades.items(), columns=["id", "verdict"])
    hold = (
        "Of 5 claims of the paper, 2 hold in our converged simulations; of 0 the direction holds and the size does "
        "not, 1 do not hold, and 0 cannot be decided, since the paper does not print what they depend on or the "
        "uncertainty is too large. 1 do not count: they are true by construction, or no claim of the paper. For 1 of "
        "the 2 that hold the test was written after the numbers."
    )
    missing = " No verdict yet (run `make verdicts`): E."
    assert counted(verdicts, rules) == hold + missing
    printed = verdicts.assign(**{"as printed": ["contradicted", "reproduced", "reproduced", "reproduced"]})
    assert counted(printed, rules) == (
        f"{hold} With the elements, the penalty, the beams and the joints that the paper prints 2 hold; 1 hold in "
        f"both.{missing}"
    )


@pytest.mark.parametrize(
    ("against", "verdict", "printed"),
    [("Table 1", "reproduced", "reproduced"), ("", "undecidable", "undecidable")],
)
def test_an_input_that_is_not_printed_and_turns_the_direction_leaves_a_claim_open(
    sources, against, verdict, printed
):
    """With less friction rough contact carries less, against K5; where Table 1 prints the friction, K5 stands."""
    readings = table()
    readings.loc[readings["name"] == "slippery", "against"] = against
    found, under = found_with(sources, {"inputs-friction010-isotropic-course": (1.3, 1.0)}, readings)
    concluded = conclude("K5", "", found, [*under.values()])
    assert concluded["verdict"] == verdict
    assert ("less friction: contradicted" in concluded["note"]) == (verdict == "undecidable")
    assert concluded["depends on"] == "less friction: contradicted"


def test_readings_gain_and_lose_claims_that_count(sources):
    """Friction moves less far than ties at the base, further with less friction: K6, unless it counts nowhere."""
    found, _ = moved(sources, 0.3, 1.0)
    claims = read_table(RESOURCES / "paper_claims.csv")

    def readings(**counts):
        known = claims.assign(counts=[counts.get(name, "yes") for name in claims["id"]])
        return TABLES.make("readings", claims=known, readings=table(), findings=found).set_index("name")

    usual, other = readings(), readings(K6="true by construction: a gate")
    assert "K6" in usual.loc["slippery", "gained"].split(", ")
    assert "K6" not in other.loc["slippery", "gained"].split(", ")
    assert usual.loc["slippery", "reproduced [1]"] == other.loc["slippery", "reproduced [1]"] + 1
    assert usual.loc["base", ["gained", "lost"]].tolist() == ["", ""]


PLUGIN = '''
from knitstudy.paper.claims import CLAIMS, Remark, at_least
from knitstudy.paper.columns import FORCE, SCENE, Column, rows_of, tabulated
from knitstudy.run.catalogue import TABLES, several

WORK = Column("work", "J", lambda history: 1.0)


@CLAIMS.add("X1")
def stronger(evidence):
    """Yield that ties hold more than friction."""
    tie, isotropic = (evidence.row(kind)[FORCE] for kind in ("tie", "isotropic"))
    yield at_least("force, ties over friction", tie / isotropic, "> 1", 1.0)
    yield Remark("a claim of a test", (evidence.direct["tie"],))


@TABLES.add("works", "Work of every simulation", results={"every": several("simulation", "*")})
def tabulate(every, scenes):
    return tabulated(rows_of(scenes, every).values(), [SCENE, FORCE, WORK])
'''


def test_a_claim_and_a_table_are_one_file(sources, plugin):
    """A claim has its row of the rules beside the file."""
    rules = read_table(RESOURCES / "paper_claims.csv").head(1).assign(id="X1", seen="twice")

    def made():
        known = {"claims": rules, "readings": table(), "mechanisms": study.mechanisms()} | sources
        return TABLES.make("verdicts", **known, findings=TABLES.make("findings", **known))

    with pytest.raises(ConfigurationError, match="claim 'X1' has no rule"):
        made()
    plugin(CLAIMS, TABLES, more_claims=PLUGIN)
    verdicts = made()
    assert verdicts.loc[0, ["id", "verdict", "ours"]].tolist() == ["X1", "reproduced", "1.20"]
    assert verdicts.loc[0, "note"].startswith("a claim of a test; DNS of")
    assert (verdicts.columns[-1], verdicts.loc[0, "seen"]) == ("seen", "twice"), (
        "also new columns of the rules"
    )
    works = TABLES.make("works", every=sources["histories"], scenes=sources["scenes"])
    assert list(works.columns) == ["scene", "force [N]", "work [J]"]
    assert len(works) == len(sources["histories"])


@pytest.mark.parametrize(
    ("factor", "verdict", "both"),
    [
        (1.0, "reproduced", "holds in both"),
        (0.8, "contradicted", "holds resolved alone: missed by the paper's own model"),
    ],
)
def test_claims_have_a_verdict_as_printed_beside_the_resolved_one(sources, factor, verdict, both):
    """Rough contact with 0.8 of its force carries less than friction; histories of its own are its reference."""
    printed = Reading("own", PRINTED, "everything", "as printed", "resolved", "", "^", "reading-whole-")
    own = {
        f"reading-whole-{name}": scene
        for name, scene in sources["scenes"].items()
        if name.startswith("yarns-")
    }
    of_base = {name: name.removeprefix("reading-whole-") for name in own}
    more = {
        "scenes": sources["scenes"] | {name: scene.labelled({"name": name}) for name, scene in own.items()},
        "histories": sources["histories"]
        | {name: sources["histories"][base] for name, base in of_base.items()},
        "contacts": sources["contacts"] | {name: sources["contacts"][base] for name, base in of_base.items()},
    }
    readings = pd.concat([table(), pd.DataFrame([vars(printed)])])
    rough = {"reading-whole-yarns-rough-course": (factor, 1.0)}
    found, under = found_with(sources | more, rough, readings)
    concluded = conclude("K5", "", found, [*under.values()], as_printed(found, readings))
    assert "own" not in under
    assert (concluded["verdict"], concluded["as printed"]) == ("reproduced", verdict)
    assert concluded["both"] == both
    assert "as printed" not in concluded["depends on"]
    for claim in ("S1", "S2", "S3", "R5"):  # by counts of the paper's own mesh, whatever is simulated
        counted = conclude(claim, "", found, [*under.values()], as_printed(found, readings))
        assert (counted["as printed"], counted["both"]) == ("reproduced", "holds in both")
    without = conclude("K5", "", found, [*under.values()])
    assert (without["as printed"], without["both"]) == ("not yet run", "")


@pytest.mark.parametrize(
    ("printed", "resolved", "both"),
    [
        ("reproduced", "reproduced", "holds in both"),
        ("contradicted", "contradicted", "holds in neither"),
        (SIZE_MISSED, SIZE_MISSED, "direction holds in both, size in neither"),
        ("reproduced", "contradicted", "holds as printed alone: an artefact of its mesh, penalty or joints"),
        ("contradicted", SIZE_MISSED, "direction holds resolved alone: missed by the paper's own model"),
        (
            "reproduced",
            SIZE_MISSED,
            "direction holds in both, size as printed alone: an artefact of its mesh, penalty or joints",
        ),
        ("undecidable", "reproduced", ""),
        ("reproduced", "not yet run", ""),
    ],
)
def test_both_verdicts_say_together_where_a_claim_holds(printed, resolved, both):
    assert both_of(printed, resolved) == both
