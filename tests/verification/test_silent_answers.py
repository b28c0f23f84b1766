"""What gave a wrong answer in silence is refused in one line, and estimates of errors against errors."""

import numpy as np
import pytest

from knitstudy.errors import ConvergenceError, MeshError
from knitstudy.knit.yarns.network import RING
from knitstudy.measures.summary import summarise
from knitstudy.mechanics.beams.beam import BeamSection
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.run.configuration import load_scene
from knitstudy.run.store import simulate

PRESSED = {
    "mesh.size": 0.5,
    "gates.elements_across": 2.5,
    "pair.length": 3.7e-3,
    "load.path": [[0, 0, -4e-5]],
    "solver.increments": 2,
    "gates.ledger": 1,
}
KNIT = {"pattern.loops": 1, "load.strain": 0.002, "load.stops": [], "solver.increments": 2}


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        (
            "pair-slid-90",
            {"contact.tangential_stiffness": 1e-3},
            r"tangential_stiffness is 0\.001: .* 0\.28 or more",
        ),
        (
            "pair-slid-90",
            {"contact.tangential_stiffness": 0.1, "contact.normal_stiffness": 0.1, "contact.points": 1},
            r"contact\.tangential_stiffness is 0\.1: contact would be softer",
        ),
        (
            "pair-slid-90",
            {"contact.normal_stiffness": 1.0},
            r"have taken 1\d\.\d% of the work.*gates\.penalty allows",
        ),
        ("pair-slid-90", {"contact.points": 2}, r"contact\.points is 2: yarns penetrate .*use an odd number"),
        (
            "beam-isotropic-course",
            KNIT | {"beam.stiffness": 0.01},
            r"beam\.stiffness is 0\.01: contact would be softer",
        ),
        (
            "beam-isotropic-course",
            KNIT | {"mesh.beam_size": 10 / 3},
            r"mesh\.beam_size is 3\.33.*: use 2\.\d or less",
        ),
    ],
    ids=["tangential", "both", "normal", "points", "beams", "beam_size"],
)
def test_silent_answers_are_refused(name, changes, message):
    base = PRESSED if name.startswith("pair") else {}
    with pytest.raises((ConvergenceError, MeshError), match=message) as refused:
        simulate(load_scene(name).vary(base | changes))
    assert "\n" not in str(refused.value)


def force_of(stiffness):
    soft = PRESSED | {"gates.penalty": 1.0, "gates.hourglass": 1.0, "contact.augmentations": 0}
    keys = {"contact.normal_stiffness": stiffness, "contact.penetration": 0.2}
    return simulate(load_scene("pair-slid-90").vary(soft | keys)).history


def test_energy_of_a_penalty_is_what_it_takes_from_the_force(verify):
    """At least, and at most twice as much; the gate that was opened for it stands in the result."""
    soft, hard = force_of(1.0), force_of(300.0)
    share = float(soft["energy"].sel(form="penalty")[-1] / soft["energy"].sel(form="external")[-1])
    lost = 1 - float(soft["force"][-1] / hard["force"][-1])
    verify.within(
        "pressed pair, stiffness E / h: energy of the penalty over the force lost", share / lost, 1.0, 0.3
    )
    text = {each.name: each.value for each in summarise(soft)}["loosened"]
    assert "gates.penalty 1 instead of 0.05" in text
    assert "gates.elements_across 2.5 instead of 7" in text


def pulled(count, radius=1e-3):
    """Return the stiffness of a quarter of a ring of radius 1 m, pulled across."""
    angle = np.linspace(0, np.pi / 2, count + 1)
    nodes = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    ends = np.column_stack([np.arange(count), np.arange(count) + 1])
    model = BeamModel(nodes, ends, BeamSection.circular(2 * radius, 1e9, 0.3, np.ones(count)), radius)
    stiffness = model.respond(model.start(), stiffness=True).stiffness.toarray()
    # Both ends stay in their planes of symmetry; the last one is moved by 1.
    given = np.r_[1:6, 6 * count + np.arange(6)]
    moved = np.zeros(model.size)
    moved[6 * count + 1] = 1.0
    free = np.setdiff1d(np.arange(model.size), given)
    moved[free] = np.linalg.solve(stiffness[np.ix_(free, free)], -stiffness[free] @ moved)
    return (stiffness @ moved)[6 * count + 1]


def test_a_ring_of_straight_beams_is_too_stiff(verify):
    exact = 1e9 * np.pi * 1e-12 / 4 / (np.pi / 4 - 2 / np.pi)  # Timoshenko: EI / R^3 (pi / 4 - 2 / pi)
    verify.within(
        "ring of 32 beams: error over phi^2", (pulled(8) / exact - 1) / (np.pi / 16) ** 2, RING, 0.03
    )
