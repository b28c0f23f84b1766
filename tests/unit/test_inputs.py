"""One input at a time: which scenes belong together, what is judged at each value, and what hangs on an input."""

import pytest
import study
import synthetic

from knitstudy.contacts.contacts import extract
from knitstudy.errors import ConfigurationError
from knitstudy.geometry.fabric import plain_knit
from knitstudy.geometry.lay_out import initial_loop
from knitstudy.measures.claims.evidence import Evidence
from knitstudy.measures.claims.verdicts import findings, hanging, variations
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import Reference, transferred_uncertainty
from knitstudy.measures.response import FORCE, LARGEST_U_Z


@pytest.fixture(scope="module")
def scenes(plain_scene):
    return study.varied(plain_scene)


@pytest.fixture(scope="module")
def sources(plain_scene, knit, scenes, paper, cases):
    """Sources of table and figure: the reference is of the base alone, and all histories are as there."""
    history = synthetic.contact_history(knit)
    contacts = synthetic.with_kinematics(extract(knit, history))
    return {
        "variations": {name: study.in_contact(history, scene.interaction) for name, scene in scenes.items()},
        "variations_contacts": dict.fromkeys(scenes, contacts),
        "geometry": synthetic.geometry(plain_knit(initial_loop(plain_scene), 2, 2)),
        "scenes": scenes,
        "paper": paper,
        "reference": study.reference(cases),
    }


def changed(sources, factors):
    """Return histories, some with factors of force and lift by what is changed and the interaction."""
    histories = dict(sources["variations"])
    for (what, kind), (force, lift) in factors.items():
        name = f"inputs-{what}-{kind}-course"
        histories[name] = study.in_contact(histories[name], kind, force, lift)
    return histories


def found_with(sources, factors=None):
    """Return findings by key and value."""
    histories, contacts = changed(sources, factors or {}), sources["variations_contacts"]
    names = ("geometry", "paper", "reference", "scenes")
    found = findings(Evidence(*(sources[name] for name in names), histories, contacts))
    return {(each.variation.key, each.variation.value): each for each in found}


def test_every_value_of_an_input_is_a_variation_of_the_base(scenes):
    found = variations(scenes.values())
    named = {
        (each.key, each.value): {kind: scene.name for kind, scene in each.scenes.items()} for each in found
    }
    assert list(named) == [
        ("", None),
        ("contact.friction", 0.1),
        ("contact.friction", 1.5),
        ("contact.friction", "rough"),
        ("contact.tied_edges", "none"),
        ("pattern.clearance", 0.04),
        ("load.lateral", "free"),
    ]
    base = {kind: f"yarns-{kind}-course" for kind in ("tie", "rough", "isotropic")}
    assert named["", None] == base
    assert named["contact.friction", 0.1] == base | {"isotropic": "inputs-friction010-isotropic-course"}
    assert named["contact.friction", "rough"] == {"isotropic": "yarns-rough-course"}
    assert named["pattern.clearance", 0.04]["tie"] == "inputs-clearance0040-tie-course"
    assert found[1].varied == ("isotropic",)
    assert found[1].described.standing == "stated"
    assert variations([scenes["yarns-tie-course"], scenes["yarns-rough-course"]]) == []
    same = scenes["yarns-tie-course"].replace("name", "inputs-same-tie-course")
    with pytest.raises(ConfigurationError, match=r"'inputs-same-tie-course' changes none of"):
        variations([*scenes.values(), same])


def test_estimate_is_as_uncertain_as_the_discretisation_is_off():
    """10.3 N beside 10 +- 0.1: off by 4 %."""
    known = Reference({(FORCE, 0.05): Estimate(10.0, 0.1), (LARGEST_U_Z, 0.08): Estimate(1e-3, 1e-4)})
    base, history = (synthetic.history(force=(0, 5, end), lift=1e-4) for end in (10.3, 20.0))
    transferred = transferred_uncertainty(known, base, history)
    assert transferred.at(FORCE, 0.05).value == 20.0
    assert transferred.at(FORCE, 0.05).uncertainty == pytest.approx(0.8)
    assert not transferred.at(LARGEST_U_Z, 0.08).known  # neither history gets there
    assert not transferred_uncertainty(Reference(), base, history).known


def test_claim_hangs_on_the_input_that_turns_its_verdict(sources):
    """11 N of rough contact and 10 N with friction, each within 2 %: 10 % less is open, 30 % more the other order."""
    factors = {
        ("clearance0040", "rough"): (0.92, 1.0),
        ("friction010", "isotropic"): (1.3, 1.0),
        ("lateral-free", "isotropic"): (1.0, 0.3),
    }
    found = found_with(sources, factors)
    verdicts = {place: each.judged["K5"].verdict for place, each in found.items() if "K5" in each.judged}
    assert verdicts["pattern.clearance", 0.04] == "not decidable"
    assert verdicts["contact.friction", 0.1] == "not reproduced"
    assert verdicts["load.lateral", "free"] == "reproduced"
    assert found["load.lateral", "free"].turned == ("K6",)
    hang = hanging(found.values())
    assert hang["contact.friction"] == hang["pattern.clearance"] == ("K5",)
    assert hang["contact.tied_edges"] == ()
