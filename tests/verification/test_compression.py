"""Compression: what begins as tension does, with the sign changed, and is no longer so the farther it goes."""

import numpy as np
import pytest

from knitstudy.models.simulate import solve
from knitstudy.stages.plan import Plan
from knitstudy.stages.simulate import simulate
from knitstudy.study.configuration import load_scene

STRAINS = (2e-3, 1e-3)


@pytest.fixture(scope="module")
def yarns():
    """History of one tied cell of solid yarns to a strain."""
    scene, plan = load_scene("extreme-yarns-tie"), Plan.of()
    return lambda strain: simulate(scene.replace("load.strain", strain), plan=plan).history


@pytest.fixture
def beams(plain_scene, knit, contacts):
    """History of a spatial network to a strain."""
    scene = plain_scene.replace("fidelity", "rom3d")
    return lambda strain: solve(scene.replace("load.strain", strain), knit, contacts=contacts)


@pytest.mark.parametrize("model", ["yarns", "beams"])
def test_compression_begins_as_tension_does(model, request, verify):
    history = request.getfixturevalue(model)
    odd = []
    for strain in STRAINS:
        pulled, pressed = (float(history(sign * strain)["force"][-1]) for sign in (1, -1))
        assert pulled > 0 > pressed
        odd.append(abs(pulled + pressed) / (pulled - pressed))
    verify.at_most(
        f"compression and tension, {model}: sum of forces over their difference at 0.1%", odd[1], 0.01
    )
    verify.within(f"the same at 0.2% over that at 0.1%, {model}", odd[0] / odd[1], 2.0, 0.05)


def test_a_compressed_cell_gives_way_more_and_more(yarns, verify):
    """Its arms turn away from the load; by energy: what the grips do is stored."""
    history = yarns(-0.1)
    slope = np.diff(history["force"]) / np.diff(history["strain"])
    assert np.all(np.diff(slope) < 0)
    energy = history["energy"][-1]
    verify.at_most(
        "one compressed cell to -10%: ledger of energies over external work",
        float(abs(2 * energy[0] - energy.sum()) / energy[0]),
        0.01,
    )
