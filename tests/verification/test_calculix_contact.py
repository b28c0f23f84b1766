"""What CalculiX's contact of surfaces computes (docs/decks.md), from two crossing yarns."""

from dataclasses import replace
from functools import partial

import calculix
import numpy as np
import pytest

from knitstudy.errors import ConvergenceError
from knitstudy.exchange.deck import specimen_deck
from knitstudy.exchange.inp import write_inp
from knitstudy.geometry.fabric import yarn_pair
from knitstudy.mesh.mesher import mesh_fabric
from knitstudy.study.configuration import load_scene

pytestmark = [
    pytest.mark.ccx,
    pytest.mark.skipif(not calculix.available(), reason="CalculiX (ccx) is not installed"),
]

SIZE, FRICTION = 0.45e-3, 0.76
DOWN = -45e-6
ACROSS = 100e-6


def pulled(folder, path, increments, interaction="isotropic", rests=True):
    """Forces (i, 3) of the upper yarn at all increments but those of rest."""
    scene = load_scene("pair-pressed-90").replace("contact.friction", FRICTION)
    scene = scene.vary({"mesh.size": SIZE, "gates.elements_across": 4})
    scene = scene.replace("load.path", path).replace("solver.increments", increments)
    scene = scene.replace("interaction", interaction)
    pair = yarn_pair(scene.yarn.radius, scene.pair.angle, scene.pair.length, scene.pair.clearance)
    mesh = mesh_fabric(pair, SIZE, scene.mesh.growth)
    deck = replace(specimen_deck(scene, pair, mesh), fields=False, rests=rests)
    write_inp(deck, folder / "deck.inp", "calculix")
    run = calculix.run(folder / "deck.inp")
    assert not run.warnings
    return run.force[run.step > rests]


@pytest.fixture
def pull(tmp_path):
    return partial(pulled, tmp_path)


def test_after_a_step_of_rest_the_pressed_yarns_do_not_depend_on_the_increments(pull):
    coarse, fine = (pull([[0, 0, DOWN]], increments)[:, 2] for increments in (5, 20))
    assert coarse[3] < -1.0
    np.testing.assert_allclose(coarse[3:], fine[15::4], rtol=0.002)


def test_in_the_first_step_pressures_are_too_small_until_it_ends(pull):
    rested, first = (pull([[0, 0, DOWN]], 20, rests=rests)[:, 2] for rests in (True, False))
    assert first[-1] == pytest.approx(rested[-1], rel=1e-3)
    assert 0.9 < first[17] / rested[17] < 0.95
    assert first[13] == pytest.approx(rested[13], rel=1e-3)  # the increment in which they first touch


def test_friction_acts_against_what_yarns_moved_before_they_touched(pull):
    """Pressed straight down, they should carry no force along the way that they came."""
    force = pull([[ACROSS, 0, 0], [ACROSS, 0, DOWN]], 8)
    touching = np.flatnonzero(force[:, 2] < -0.1)
    first = force[touching[0]]
    assert first[0] == pytest.approx(-FRICTION * first[2], rel=1e-3)


def test_rough_contact_meets_motion_before_touching_at_full_stiffness(pull):
    """Its stand-in is a friction coefficient that nothing exceeds."""
    straight = pull([[0, 0, DOWN]], 5, "rough")
    np.testing.assert_allclose(straight[-1], pull([[0, 0, DOWN]], 5)[-1], rtol=1e-3, atol=1e-3)
    with pytest.raises(ConvergenceError, match="diverge"):
        pull([[ACROSS, 0, 0], [ACROSS, 0, DOWN]], 8, "rough")
