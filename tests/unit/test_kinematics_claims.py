"""The verdict on local kinematics turns with each of its parts."""

from pathlib import Path

import numpy as np
import pytest
import study
import synthetic

from knitstudy.contacts.contacts import extract
from knitstudy.files import read_table
from knitstudy.measures.centre_cell import centre_cell
from knitstudy.measures.claims.contact import judge_kinematics
from knitstudy.measures.claims.evidence import Evidence

RESOURCES = Path(__file__).resolve().parents[2] / "resources" / "reference"


@pytest.fixture(scope="module")
def contacts(knit):
    return synthetic.with_kinematics(extract(knit, synthetic.contact_history(knit)))


@pytest.fixture
def judge(plain_scene, knit):
    """Function that judges contacts with isotropic friction."""
    paper = read_table(RESOURCES / "paper_tables.csv")
    scenes = {"isotropic": plain_scene.vary({"fidelity": "hexahedra", "interaction": "isotropic"})}
    given = {
        "geometry": synthetic.geometry(knit),
        "scenes": scenes,
        "paper": paper,
        "reference": study.NO_REFERENCE,
    }

    def judge(contacts):
        return judge_kinematics(Evidence(**given, contacts={"isotropic": contacts}))

    return judge


def test_all_parts_reproduce_the_claim(judge, contacts):
    judged = judge(contacts)
    assert judged.verdict == "reproduced"
    assert "slide 0.1 to 0.1 mm" in judged.measured
    assert "half of the rotation at 5.00% strain" in judged.measured, (
        "it follows the strain: 1.95% is less than half"
    )


@pytest.mark.parametrize("name", ["section_rotation", "segment_contraction", "sliding", "contact_spin"])
def test_one_crossing_that_stays_is_not_reproduced(judge, contacts, name):
    still = contacts[name].copy(deep=True)
    still[:, centre_cell(contacts)[2]] = 0.0
    assert judge(contacts.assign({name: still})).verdict == "not reproduced"


def test_signs_of_mirrored_crossings_do_not_matter(judge, contacts):
    mirrored = contacts.assign(sliding=-contacts["sliding"], contact_spin=-contacts["contact_spin"])
    assert judge(mirrored).verdict == "reproduced"


def test_crossing_that_is_open_at_the_end_is_not_reproduced(judge, contacts):
    spin = contacts["contact_spin"].copy(deep=True)
    spin[-1, centre_cell(contacts)[0]] = np.nan
    assert judge(contacts.assign(contact_spin=spin)).verdict == "not reproduced"


def test_nothing_is_judged_without_sections_or_short_of_the_papers_strain(judge, contacts):
    assert judge(contacts.drop_vars("section_rotation")).verdict == "not yet run"
    assert judge(contacts.isel(increment=slice(0, 5))).verdict == "not yet run"


def test_lack_of_the_scene_is_named(knit):
    paper = read_table(RESOURCES / "paper_tables.csv")
    judged = judge_kinematics(Evidence(synthetic.geometry(knit), {}, paper, study.NO_REFERENCE))
    assert judged.verdict == "not yet run"
    assert "isotropic" in judged.note
