"""What a run of beams in contact refuses, and what it records."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from knitstudy.errors import ConvergenceError, GeometryError
from knitstudy.mechanics.increment import Increment
from knitstudy.models.beams_in_contact import beam_knit
from knitstudy.models.simulate import solve


@pytest.fixture(scope="module")
def beam_scene(touching_cell):
    keys = {"name": "beam", "mesh.beam_size": 10 / 9, "load.strain": 0.03}
    return touching_cell.vary(keys | {"solver.increments": 3, "gates.ledger": 0.2})


@pytest.fixture(scope="module")
def cell(beam_scene, knit_of):
    return knit_of(beam_scene)


@pytest.fixture(scope="module")
def history(beam_scene, cell):
    return solve(beam_scene, cell)


def test_crossings_too_near_for_two_contacts(beam_scene, cell):
    one = cell.crossings[np.array([0, 0])]
    near = replace(one, arc_length=one.arc_length + np.array([[0.0], [0.09]]) * beam_scene.yarn.radius)
    with pytest.raises(GeometryError, match=r"are 0\.09 yarn radii apart, less than 1: beams would count"):
        beam_knit(beam_scene, replace(cell, crossings=near))


def test_touching_crossings_press_and_their_gap_says_how_much(beam_scene, history):
    gap, force = history["crossing_gap"].to_numpy(), history["crossing_force"].to_numpy()
    assert np.all(gap[-1] < 0)
    penalty = beam_scene.beam.stiffness * beam_scene.yarn.youngs_modulus * beam_scene.yarn.radius
    normal = -gap[-1] * penalty
    size = np.linalg.norm(force[-1], axis=1)
    assert np.all(size >= normal * (1 - 1e-9))
    assert np.all(size <= normal * np.hypot(1, beam_scene.contact.friction) * (1 + 1e-9))
    np.testing.assert_allclose(history["smallest_gap"][-1], gap[-1].min(), rtol=1e-6)


@pytest.fixture
def tied_scene(beam_scene):
    """Scene of a knit whose outer rows are tied."""
    return beam_scene.vary({"pattern.loops": 3, "pattern.rows": 3, "contact.tied_edges": "outer"})


def test_outer_rows_are_tied(tied_scene, knit):
    for direction, place in (("course", "row"), ("wale", "column")):
        beams = beam_knit(tied_scene.replace("load.direction", direction), knit)
        at = getattr(knit.crossings, place)
        np.testing.assert_array_equal(beams.tied, (at == 0) | (at == 2))
        assert np.bincount(beams.network.station_node).max() == 2
        assert np.sum(np.bincount(beams.network.station_node) == 2) == beams.tied.sum()


def test_pinned_ties_join_points_and_not_sections(tied_scene, knit):
    """A pin is as stiff as contact that sticks, and leaves both sections free to turn."""
    beams = beam_knit(tied_scene.replace("beam.tie", "pinned"), knit)
    assert np.bincount(beams.network.station_node).max() == 1
    penalty = tied_scene.beam.stiffness * tied_scene.yarn.youngs_modulus * tied_scene.yarn.radius
    springs = beams.network.springs
    np.testing.assert_allclose(springs.stiffness, np.tile(penalty * np.eye(3), (beams.tied.sum(), 1, 1)))
    points = beams.network.nodes[springs.ends] + springs.offsets
    np.testing.assert_allclose(points[:, 0], points[:, 1], atol=1e-12)


def test_penetration_that_contact_does_not_see_is_refused(beam_scene, cell):
    """A flattened knit: before and after contact has been told, and where it was as flat when the increment began."""
    beams = beam_knit(beam_scene, cell)
    rest = beams.model.begin(beams.model.start(), 0.0, 0.1)
    flat = replace(rest, position=rest.position * [1, 1, 0.9])
    moved = beams.network.station_displacement(beams.model, flat)
    grown, as_before = (
        SimpleNamespace(columns={"centreline_displacement": [then, moved]}) for then in (0 * moved, moved)
    )
    with pytest.raises(
        ConvergenceError, match=r"increment 3: yarns . and . at arc lengths .* unseen by the beams"
    ):
        beams.require_seen(Increment(3, 0.5, flat, None, 0.1), grown)
    beams.require_seen(Increment(3, 0.5, beams.model.commit(flat), None, 0.1), grown)
    far = replace(flat, contact=replace(flat.contact, s=flat.contact.s + 1.0))  # no pair of theirs is near
    beams.require_seen(Increment(3, 0.5, far, None, 0.1), as_before)
    with pytest.raises(ConvergenceError, match=r"unseen by the beams"):
        beams.require_seen(Increment(3, 0.5, far, None, 0.1), grown)
