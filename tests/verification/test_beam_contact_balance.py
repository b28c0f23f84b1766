"""Contact of beams: balance of forces and moments, rotation of everything."""

from dataclasses import replace

import numpy as np
import pytest
from crossing_beams import LAWS, contact_forces, on_the_way, pair_friction

from knitstudy.mechanics.rotation import exp


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
