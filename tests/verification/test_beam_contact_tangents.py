"""Contact of beams: tangents against central differences, balance of forces and moments, rotation of everything."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from crossing_beams import Beams, curved_yarns, hairpin

from knitstudy.mechanics.contact.friction import OPEN, SLIP, STICK
from knitstudy.mechanics.rotation import exp

LAWS = ("rigid", "hertz")
YARNS = {"curved": curved_yarns, "hairpin": hairpin}
FRICTION = {"stick": 1e4, "slip": 0.05, "rough": np.inf, "frictionless": 0.0}


def moved(model, shift, seed):
    """State with the nodes of the upper yarn, the last ones, shifted and all nodes disturbed, spins included."""
    noise = np.random.default_rng(seed).normal(size=(model.size // 6, 6)) * [1, 1, 1, 20, 20, 20]
    step = 2e-6 * noise
    contact = model.contact
    step[contact.node[contact.curves.first[1]] :, :3] += shift
    return model.advance(model.begin(model.start(), 0.0, 1.0), step.ravel())


def on_the_way(model, shift=(20e-6, 8e-6, -31e-6)):
    """Model, and its state in an increment that begins where the yarns were pressed on each other."""
    first = model.commit(moved(model, [1e-6, 2e-6, -30e-6], 0))
    return model, replace(moved(model, shift, 1), contact=first.contact)


def without_contact(model):
    alone = copy(model)
    alone.contact = None
    return alone


def tangent_error(model, state):
    """Difference of the tangent of contact from central differences, over their size."""
    direction = np.random.default_rng(3).normal(size=(model.size // 6, 6)) * [1, 1, 1, 100, 100, 100]
    direction = direction.ravel()
    step = 2e-9
    ways = [model.advance(state, sign * step * direction) for sign in (1, -1)]
    replies = [model.respond(way, False) for way in ways]
    alone = without_contact(model)
    beams = [alone.respond(way, False).force for way in ways]
    assert replies[0].same_status(replies[1])
    slope = (replies[0].force - beams[0] - replies[1].force + beams[1]) / (2 * step)
    exact = model.respond(state, True).stiffness - alone.respond(state, True).stiffness
    return np.abs((slope - exact @ direction) / model.scale).max() / np.abs(slope / model.scale).max()


def contact_forces(model, state):
    """Internal forces and moments (N, 6) of contact alone."""
    full, beams = model.respond(state, False).force, without_contact(model).respond(state, False).force
    return (full - beams).reshape(-1, 6)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", FRICTION)
def test_tangent_beside_a_tie_and_at_the_bound_of_a_piece(law, kind, verify):
    """Beams whose closest points are nearer to the crossing than the piece of the upper one reaches."""
    case = Beams(law=law, angle=70.0, friction=FRICTION[kind], gap=0.0, carried=3e-6, reach=0.05e-3)
    model, state = on_the_way(case.model())
    points = model.contact.points(state)
    assert points.approach.free.tolist() == [[True, False]]
    assert points.status[0] == (STICK if kind in ("stick", "rough") else SLIP)
    verify.at_most(f"tangent beside a tie, at a bound: {law}, {kind}", tangent_error(model, state), 1e-6)


SHIFTS = {"over a node": [1.2e-3, 0.4e-3, -31e-6]}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", FRICTION)
@pytest.mark.parametrize("shift", SHIFTS)
def test_tangent_of_beams_in_contact(law, kind, shift, verify):
    model = Beams(law=law, angle=70.0, friction=FRICTION[kind], gap=0.0).model()
    first = model.commit(moved(model, [1e-6, 2e-6, -30e-6], 0))
    state = replace(moved(model, SHIFTS[shift], 1), contact=first.contact)
    points = model.contact.points(state)
    assert first.contact.force.max() > 0
    touching = points.status[points.status != OPEN]
    assert (STICK if kind in ("stick", "rough") else SLIP) in touching
    verify.at_most(f"tangent of beams in contact: {law}, {kind}, {shift}", tangent_error(model, state), 1e-6)


@pytest.mark.parametrize("yarns", YARNS)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", ["stick", "slip"])
def test_tangent_of_curved_yarns(yarns, law, kind, verify):
    """Two hooked yarns, the stations of the contact carried by nodes beside them; yarns that touch a second time."""
    model, state = on_the_way(YARNS[yarns](law, FRICTION[kind]))
    assert np.sum(model.contact.points(state).status != OPEN) == {"curved": 1, "hairpin": 2}[yarns]
    verify.at_most(f"tangent of beams in contact, {yarns}: {law}, {kind}", tangent_error(model, state), 1e-6)


@pytest.mark.parametrize("yarns", YARNS)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", ["stick", "slip"])
def test_forces_and_moments_balance(yarns, law, kind, verify):
    """Exactly: what friction exerts on both yarns acts in one point, half way between their centrelines."""
    model, state = on_the_way(YARNS[yarns](law, FRICTION[kind]))
    force = contact_forces(model, state)
    lever = np.cross(state.position, force[:, :3])
    assert np.abs(force[:, 3:]).sum() > 1e-3 * np.abs(lever).sum()  # friction does exert couples
    error = max(
        np.abs(force[:, :3].sum(axis=0)).max() / np.abs(force[:, :3]).sum(),
        np.abs((lever + force[:, 3:]).sum(axis=0)).max() / np.abs(lever).sum(),
    )
    verify.at_most(f"beams in contact: balance of forces and moments, {yarns}, {law}, {kind}", error, 1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_rotation_of_everything_turns_the_forces(law, verify):
    """Of a state in the middle of an increment that slips, by 30 degrees: its history stays as it is."""
    model, state = on_the_way(curved_yarns(law, FRICTION["slip"]))
    turn = exp(np.radians(30) * np.array([2, -1, 2]) / 3)
    turned = replace(state, position=state.position @ turn.T, rotation=turn @ state.rotation)
    force = contact_forces(model, state).reshape(-1, 2, 3)
    error = np.abs(contact_forces(model, turned).reshape(-1, 2, 3) - force @ turn.T)
    level = np.abs(force).max(axis=(0, 2))
    verify.at_most(
        f"beams in contact: all turned by 30 degrees, {law}", (error.max(axis=(0, 2)) / level).max(), 1e-10
    )
