"""Ties of a run of beams in contact, and the columns that it records."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal
from scipy.spatial.transform import Rotation

from knitstudy.errors import ConvergenceError
from knitstudy.knit.models.beam import cell as endless_beams
from knitstudy.knit.models.beam.build import beam_knit
from knitstudy.run.configuration import load_scene
from knitstudy.run.store import simulate


@pytest.fixture(scope="module")
def beam_scene(touching_cell):
    keys = {"name": "beam", "mesh.beam_size": 10 / 9, "load.strain": 0.03}
    return touching_cell.vary(keys | {"solver.increments": 3, "gates.ledger": 0.2})


@pytest.fixture
def tied_scene(beam_scene):
    """Scene of a knit whose outer rows are tied."""
    tied = {"pattern.loops": 3, "pattern.rows": 3, "contact.tied_edges": "outer", "beam.tie": "rigid"}
    return beam_scene.vary(tied)


def test_pinned_ties_join_points_and_not_sections(tied_scene, knit):
    """A pin is as stiff as contact that sticks, and leaves both sections free to turn."""
    beams = beam_knit(tied_scene.replace("beam.tie", "pinned"), knit)
    assert np.bincount(beams.network.station_node).max() == 1
    penalty = tied_scene.beam.stiffness * tied_scene.yarn.youngs_modulus * tied_scene.yarn.radius
    springs = beams.network.springs
    np.testing.assert_allclose(springs.stiffness, np.tile(penalty * np.eye(3), (beams.tied.sum(), 1, 1)))
    points = beams.network.nodes[springs.ends] + springs.offsets
    np.testing.assert_allclose(points[:, 0], points[:, 1], atol=1e-12)


def test_crossings_of_a_knit_that_moves_as_a_whole_move_as_it_does(tied_scene, knit):
    """A crossing is displaced as the point where both sections met, which turns with the sections."""
    beams = beam_knit(tied_scene, knit)
    state = beams.model.start()
    turn, shift = Rotation.from_rotvec([0.1, -0.2, 0.3]).as_matrix(), np.array([1e-3, 2e-3, -3e-3])
    rotation = turn @ state.rotation
    moved = replace(state, position=state.position @ turn.T + shift, rotation=rotation)
    points = np.broadcast_to(knit.crossings.point.mean(axis=1)[:, None], (len(knit.crossings), 2, 3))
    displacement = beams.at_crossings(moved)["crossing_displacement"]
    np.testing.assert_allclose(displacement, points @ (turn - np.eye(3)).T + shift, atol=1e-12)


def test_a_way_to_rest_that_ends_says_how_to_draw_the_loops(monkeypatch):
    """In the stage, which sees no key but those it reads."""

    def ends(model, prescribed, settings, solver):
        raise ConvergenceError(f"increment 1 makes no headway. {settings.remedy}")

    monkeypatch.setattr(endless_beams, "trace", ends)
    message = r"way to rest of scene .* finds no balance: increment 1 makes no headway\. Draw .* pattern\.wale_spacing"
    with refusal(message):
        simulate(load_scene("fabric-acrylic-stockinette-course-free"))
