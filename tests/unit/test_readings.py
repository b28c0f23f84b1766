"""Readings of the paper: which scenes judge, what is judged under each, and what verdicts follow."""

from pathlib import Path

import pandas as pd
import pytest
import study
import synthetic

from knitstudy.contacts.contacts import extract
from knitstudy.errors import DataFileError
from knitstudy.files import read_table
from knitstudy.geometry.fabric import plain_knit
from knitstudy.geometry.lay_out import initial_loop
from knitstudy.measures.claims.verdicts import INPUT, READING, Reading, conclude, findings, readings_of
from knitstudy.measures.discretisation import problem_of
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import Reference, transferred_uncertainty
from knitstudy.measures.response import FORCE, LARGEST_U_Z
from knitstudy.study.configuration import load_scenes

RESOURCES = Path(__file__).resolve().parents[2] / "resources" / "reference"


def table(kind=READING, against=""):
    """Return readings as a table: of friction, of the clearance, and one without scenes."""
    rows = [
        Reading(
            "slippery", kind, "less friction", "friction", against, "^yarns-iso", "inputs-friction010-iso"
        ),
        Reading("loose", kind, "loose yarns", "tight yarns", against, "^yarns-", "inputs-clearance0040-"),
        Reading("whole", kind, "whole yarns", "cut cells", against, "^", "reading-whole-"),
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
    }


def found_with(sources, factors=None, readings=None):
    """Return findings by the names of readings, with factors of force and motion by scene."""
    histories = dict(sources["histories"])
    for name, (force, lift) in (factors or {}).items():
        kind = name.split("-")[-2]
        histories[name] = study.in_contact(histories[name], kind, force, lift)
    found = findings(table() if readings is None else readings, **sources | {"histories": histories})
    return {each.reading.name: each for each in found}


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
    assert {each.kind for each in readings} == {READING, INPUT}
    judging = {each.name: {each.scene_of(name) for name in scenes} & scenes.keys() for each in readings}
    meant = {name for name in scenes if name.startswith(("inputs-", "reading-"))}
    assert not meant - set.union(*judging.values())
    for each in readings:
        own = [name for name in judging[each.name] if each.becomes and name.startswith(each.becomes)]
        assert own or not each.changes or each.name == "surface", each.name
    with pytest.raises(DataFileError, match="no column 'held'"):
        readings_of(table().drop(columns="held"))


def test_claim_is_judged_by_the_scenes_of_the_reading(sources):
    """11 N of rough contact and 10 N with friction, each within 2 %: 10 % less is open, 30 % more the other order."""
    loose, slippery = "inputs-clearance0040-rough-course", "inputs-friction010-isotropic-course"
    found = found_with(sources, {loose: (0.92, 1.0), slippery: (1.3, 1.0)})
    assert {name: each.judged["K5"].verdict for name, each in found.items()} == {
        "base": "reproduced",
        "slippery": "not reproduced",
        "loose": "not decidable",
        "whole": "not yet run",
    }
    assert found["slippery"].turned == ("K5",)
    assert found["loose"].turned == found["whole"].turned == ()
    assert "K5" in found["loose"].touched
    assert "K1" not in found["loose"].touched


@pytest.mark.parametrize(
    ("base", "slippery", "readings", "verdict", "condition"),
    [
        (1.0, 1.0, table(), "reproduced", ""),
        (1.0, 0.3, table(), "reproduced if", "friction"),
        (1.0, 0.3, table(against="Table 1"), "reproduced", ""),
        (1.0, 0.3, table(INPUT), "reproduced", ""),
        (0.3, 1.0, table(), "reproduced if", "less friction"),
        (0.3, 1.0, table(against="Table 1"), "not reproduced", ""),
        (0.3, 1.0, table(INPUT), "not reproduced", ""),
    ],
)
def test_verdict_follows_from_all_readings(sources, base, slippery, readings, verdict, condition):
    """With 0.3 of its motion friction moves less far than ties, against K6."""
    factors = {
        "yarns-isotropic-course": (1.0, base),
        "inputs-clearance0040-isotropic-course": (1.0, base),
        "inputs-friction010-isotropic-course": (1.0, slippery),
    }
    reference = sources["reference"].copy()
    here = reference["problem"] == problem_of(sources["scenes"]["yarns-isotropic-course"])
    reference.loc[here & (reference["quantity"] == LARGEST_U_Z), ["value", "uncertainty"]] *= base
    found = found_with(sources | {"reference": reference}, factors, readings)
    concluded = conclude("K6", "", list(found.values()))
    assert (concluded.verdict, concluded.condition) == (verdict, condition), concluded
    assert ("less friction" in concluded.hangs_on) == (base != slippery)
