"""Affine maps of the sections at crossings: exact where the motion is affine, and blind to what is far away."""

import numpy as np
import pytest
import synthetic

from knitstudy.contacts.contacts import extract
from knitstudy.contacts.kinematics import section_motion
from knitstudy.geometry.fabric import yarn_pair
from knitstudy.mechanics.rotation import exp
from knitstudy.mesh.mesher import mesh_fabric
from knitstudy.models.simulate import build, solve

SIZE = 0.45e-3


@pytest.fixture(scope="module")
def knitted(plain_scene, knit_of):
    """Crossings and mesh of a knit of two rows."""
    knit = knit_of(plain_scene.replace("pattern.loops", 1).replace("pattern.rows", 2))
    return knit.crossings, mesh_fabric(knit, SIZE)


@pytest.mark.parametrize(
    "gradient",
    [exp([0.4, -1.1, 0.3]), np.eye(3) + 0.1 * np.random.default_rng(0).normal(size=(3, 3))],
    ids=["rotation", "deformation"],
)
def test_affine_motions_are_exact(knitted, gradient):
    crossings, mesh = knitted
    shift = np.array([1e-3, -2e-3, 5e-4])
    motion = section_motion(crossings, mesh, mesh.nodes, mesh.nodes @ (gradient - np.eye(3)).T + shift)
    count = len(crossings.row)
    np.testing.assert_allclose(motion.gradient, np.tile(gradient, (count, 2, 1, 1)), atol=1e-12)
    expected = crossings.point @ (gradient - np.eye(3)).T + shift
    np.testing.assert_allclose(motion.displacement, expected, atol=1e-15)


def test_twist_of_a_straight_yarn_is_that_of_its_middle():
    """Both yarns twist uniformly about their axes: sections turn, and neither stretch nor tilt."""
    pair = yarn_pair(0.9e-3, 90.0, 5e-3, 0.01)
    mesh = mesh_fabric(pair, SIZE, 1.0)
    rate, axes, middles = 40.0, np.array([[1.0, 0, 0], [0, 1.0, 0]]), pair.crossings.point[0]
    displacement = np.empty_like(mesh.nodes)
    for yarn in range(2):
        here = np.repeat(mesh.yarn_of_slice == yarn, mesh.section.size)
        arm = mesh.nodes[here] - middles[yarn]
        along = arm @ axes[yarn]
        turned = exp((0.3 + rate * along)[:, None] * axes[yarn])
        displacement[here] = np.einsum("nij,nj->ni", turned, arm) - arm
    motion = section_motion(pair.crossings, mesh, mesh.nodes, displacement)
    for yarn in range(2):
        # Fibres across shrink by the mean of cos(rate s), by 3e-4 within the layers around the crossing.
        np.testing.assert_allclose(motion.gradient[0, yarn], exp(0.3 * axes[yarn]), atol=6e-4)
    np.testing.assert_allclose(motion.displacement, 0, atol=1e-9)


def test_history_of_a_simulation_holds_the_motion_of_sections(plain_scene):
    """Tied yarns, the upper one pushed along the lower: the maps are those of its displacements at full load."""
    scene = synthetic.pair_scene(plain_scene, [[2e-5, 0.0, -1e-5]], interaction="tie")
    scene = scene.vary({"outputs": ["fields"], "solver.increments": 1, "gates.elements_across": 4})
    pair = yarn_pair(0.9e-3, 90.0, scene.pair.length, 0.01)
    mesh = mesh_fabric(pair, SIZE, 2.0)
    history = solve(scene, pair, mesh=mesh)
    assert history["section_gradient"].dims == ("increment", "crossing", "side", "xyz", "undeformed_xyz")
    assert not history["section_displacement"][0].any()
    nodes = build(scene, pair, mesh=mesh).observers[0].yarns.parts.nodes
    motion = section_motion(pair.crossings, mesh, nodes, history["node_displacement"].to_numpy())
    np.testing.assert_allclose(history["section_gradient"][-1], motion.gradient, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(
        history["section_displacement"][-1], motion.displacement, rtol=1e-9, atol=1e-15
    )
    contacts = extract(pair, history)
    assert 1e-5 < contacts["centreline_relative_displacement"][-1, 0, 0] < 2e-5, "most of the push"
    # The tie holds the lower face of the upper yarn back, which turns that about its own axis, y.
    assert np.argmax(np.abs(contacts["section_rotation"].to_numpy()[-1, 0, 1])) == 1
