"""Contact of beams: tangents against central differences, balance of forces and moments, rotation of everything."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from crossing_beams import LAWS, curved_yarns

from knitstudy.mechanics.beams.beam_contact import NO_LATTICE
from knitstudy.mechanics.rotation import exp

FRICTION = {"stick": 1e4, "slip": 0.05, "rough": np.inf, "frictionless": 0.0}


def on_the_way(law, kind):
    """Model of hooked yarns, and its state in an increment that begins where they were pressed on each other.

    Nodes of the upper yarn have moved, and all nodes are disturbed, spins included.
    """
    model = curved_yarns(law, FRICTION[kind])
    upper = model.contact.places(model.start()).position[:, 2] > 0

    def moved(shift, seed):
        step = 2e-6 * np.random.default_rng(seed).normal(size=(len(upper), 6)) * [1, 1, 1, 20, 20, 20]
        step[upper, :3] += shift
        return model.advance(model.begin(model.start(), 0.0, 1.0), step.ravel())

    first = model.commit(moved([1e-6, 2e-6, -40e-6], 0))
    return model, replace(moved([20e-6, 8e-6, -41e-6], 1), contact=first.contact)


def pair_friction(model, state):
    """Friction of the pairs of points that touch."""
    line, points = model.contact.line, model.contact.at_points(state)
    return line.active_pairs(points, NO_LATTICE, state.contact.points, slip=True).friction


def alone(model):
    """The beams without their contact."""
    actual = copy(model)
    actual.contact = None
    return actual


def contact_forces(model, state):
    """Internal forces and moments (N, 6) of contact alone."""
    full, beams = model.respond(state, False).force, alone(model).respond(state, False).force
    return (full - beams).reshape(-1, 6)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", FRICTION)
def test_tangent_of_beams_in_contact(law, kind, verify):
    """Hooked yarns, the stations of the contact carried by nodes beside them."""
    model, state = on_the_way(law, kind)
    assert pair_friction(model, state).slides.any() == (kind in ("slip", "frictionless"))
    direction = np.random.default_rng(3).normal(size=(model.size // 6, 6)) * [1, 1, 1, 100, 100, 100]
    direction, step = direction.ravel(), 2e-9
    ahead, behind = (model.advance(state, sign * step * direction) for sign in (1, -1))
    slope = (contact_forces(model, ahead) - contact_forces(model, behind)).ravel() / (2 * step)
    exact = model.respond(state, True).stiffness - alone(model).respond(state, True).stiffness
    error = np.abs((slope - exact @ direction) / model.scale).max() / np.abs(slope / model.scale).max()
    verify.at_most(f"tangent of beams in contact: {law}, {kind}", error, 1e-6)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", ["frictionless", "slip", "stick"])
def test_forces_and_moments_balance(law, kind, verify):
    """Forces exactly, and moments without friction.

    Friction acts on both yarns where their points met, which have parted by the slip u of the increment: that leaves
    at most the moment u x t of every pair.
    """
    model, state = on_the_way(law, kind)
    force, friction = contact_forces(model, state), pair_friction(model, state)
    lever = np.cross(state.position, force[:, :3])
    name = f"beams in contact: {{}}, {law}, {kind}"
    error = np.abs(force[:, :3].sum(axis=0)).max() / np.abs(force[:, :3]).sum()
    verify.at_most(name.format("balance of forces"), error, 1e-12)
    moment = np.abs((lever + force[:, 3:]).sum(axis=0)).max()
    parted = np.linalg.norm(friction.traction, axis=1) @ np.linalg.norm(friction.slip, axis=1)
    level = np.abs(lever).sum()
    verify.at_most(name.format("balance of moments"), moment / level, parted / level + 1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_rotation_of_everything_turns_the_forces(law, verify):
    """Of a state in the middle of an increment that slips, by 30 degrees: its history stays as it is."""
    model, state = on_the_way(law, "slip")
    turn = exp(np.radians(30) * np.array([2, -1, 2]) / 3)
    turned = replace(state, position=state.position @ turn.T, rotation=turn @ state.rotation)
    force = contact_forces(model, state).reshape(-1, 2, 3)
    error = np.abs(contact_forces(model, turned).reshape(-1, 2, 3) - force @ turn.T)
    level = np.abs(force).max(axis=(0, 2))
    error = (error.max(axis=(0, 2)) / level).max()
    verify.at_most(f"beams in contact: all turned by 30 degrees, {law}", error, 1e-10)
