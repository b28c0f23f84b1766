"""Reduced models: balance of forces and moments, energy, joints as rigid bodies, independence of units."""

import numpy as np
import pytest
from dead_loads import balance

from knitstudy.knit.loading.history import load_path
from knitstudy.knit.loading.solve import solve_load_path
from knitstudy.knit.simulate import build
from knitstudy.knit.yarns.network import grips, problem, tension
from knitstudy.mechanics.beams.beam import BeamSection
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.core.increment import Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace


@pytest.fixture(scope="module")
def sprung_contacts(contacts):
    """Contacts whose middle row has springs and whose other rows are tied."""
    count, axes = contacts.sizes["crossing"], ("increment", "crossing", "xyz")
    tied = contacts["row"].to_numpy() != 1
    displacement = np.array([0.0, 1e-5])[:, None, None] * np.ones((count, 3))
    return contacts.assign(
        tied=("crossing", tied),
        zones=(("increment", "crossing"), np.ones((2, count), dtype=int)),
        force=(axes, displacement * [80e3, 60e3, 900e3]),
        relative_displacement=(axes, displacement),
    )


def reactions(ends, model, state):
    """Return resultant force (3,) and moment (3,) about the origin that nodes at the grips carry."""
    force, moment = model.respond(state, stiffness=False).force.reshape(-1, 2, 3)[ends].swapaxes(0, 1)
    levels = np.abs(force).sum(), np.abs(np.cross(state.position[ends], force)).sum()
    return force.sum(axis=0), (np.cross(state.position[ends], force) + moment).sum(axis=0), levels


@pytest.mark.parametrize("direction", ["course", "wale"])
@pytest.mark.parametrize("joint", ["rigid", "printed"])
def test_spring_joints_leave_just_the_couples_that_are_accounted_for(
    plain_scene, knit, sprung_contacts, joint, direction, verify
):
    """Springs at P leave a couple of second order in their stretch, between the points C one of first order."""
    scene = plain_scene.replace("interaction", "isotropic").replace("load.direction", direction)
    scene = scene.replace("rom.joint", joint).replace("mesh.beam_size", 1.2).replace("rom.axes", "global")
    network = build(scene, knit, contacts=sprung_contacts).observer.network
    model = network.model(scene.yarn, scene.mesh.section_law)
    ends = grips(network, knit, direction)
    *_, last = trace(
        model,
        tension(ends, load_path(scene, knit), "fixed"),
        Settings(increments=4, residual_tolerance=1e-10),
        LU(),
    )
    at_ends = np.concatenate([ends.held, ends.driven])
    force, moment, (level_of_force, level_of_moment) = reactions(at_ends, model, last.state)
    couple = model.couples(last.state).sum(axis=0)
    np.testing.assert_allclose(force, 0, atol=1e-9 * level_of_force)
    error = np.abs(moment + couple).max() / level_of_moment
    verify.at_most(f"spring joints, {joint}, {direction}: moments less their couples", error, 1e-9)
    size = np.linalg.norm(model.couples(last.state), axis=1).sum() / level_of_moment
    assert size < 2e-3 if joint == "rigid" else size > 2e-2
    recorded = solve_load_path(problem(scene, knit, network))
    np.testing.assert_allclose(recorded["joint_couple_magnitude"][-1] / level_of_moment, size, rtol=1e-4)
    np.testing.assert_allclose(recorded["joint_couple"][-1], couple, atol=1e-6 * level_of_moment)


def test_arms_are_the_limit_of_stiff_beams():
    """Two crossing yarns joined by an arm eliminated, and by a beam 1e4 times as stiff as they are."""
    rng = np.random.default_rng(11)
    soft, gap = BeamSection(EA=2e3, kGA=1e3, EI=40.0, GJ=30.0), 0.6
    along = np.linspace(-1, 1, 5)
    lower = np.column_stack([along, 0 * along, 0 * along - gap / 2])
    upper = np.column_stack([0 * along, along, 0 * along + gap / 2])
    points = np.concatenate([lower, upper])
    chain = np.column_stack([np.arange(4), np.arange(1, 5)])
    ends = np.concatenate([chain, chain + 5])
    load = np.zeros((10, 6))
    load[[4, 9]] = rng.normal(size=(2, 6)) * [12, 12, 12, 6, 6, 6]

    factor = np.append(np.ones(8), 1e4)
    stiff = BeamSection(2e3 * factor, 1e3 * factor, 40.0 * factor, 30.0 * factor)
    explicit = BeamModel(points, np.concatenate([ends, [[2, 7]]]), stiff, 1.0)
    reference, _ = balance(explicit, load.ravel(), np.arange(6), steps=30, tolerance=1e-6)

    offset = points[ends] - np.where(np.isin(ends, [2, 7])[..., None], 0.0, points[ends])
    kept = np.where(ends == 7, 2, ends)
    kept -= kept > 7
    nodes = np.delete(points, 7, axis=0)
    nodes[2] = 0.0
    joined = BeamModel(nodes, kept, soft, 1.0, offset)
    state, _ = balance(joined, np.delete(load, 7, axis=0).ravel(), np.arange(6), steps=10)
    assert np.abs(state.rotation[-1] - np.eye(3)).max() > 0.25  # some 20 degrees
    # What is left is the stretch of the stiff beam, 1e-4 of the displacements.
    np.testing.assert_allclose(state.position[-1], reference.position[-1], atol=5e-5)
