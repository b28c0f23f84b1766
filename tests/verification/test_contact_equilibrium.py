"""Contact forces in balance, in a rotated frame, and with the yarns exchanged."""

import numpy as np
from contact_bodies import crossed_yarns, law, touching

from knitstudy.mechanics.contact.friction import SLIP, STICK, ContactHistory
from knitstudy.mechanics.contact.interaction import PASS_SHARE
from knitstudy.mechanics.rotation import exp

SIZE = 0.4  # element size of the yarns, whose radius is 1


def sliding(rotation=None):
    """Two yarns with disturbed surfaces in two increments: contact, nodes after each, and the slip history.

    Both configurations are turned by `rotation` (3, 3).
    """
    rotation = np.eye(3) if rotation is None else rotation
    bodies = crossed_yarns(3, 1, gap=0.02, angle=60)
    nodes, _, first, contact = touching(bodies, law(SIZE, 1.0), margin=0.3, overlap=1e-3)
    noise = 0.01 * np.random.default_rng(0).normal(size=nodes.shape)
    upper = (np.arange(len(nodes)) >= first[1])[:, None]
    one, two = (
        (nodes + noise + np.where(upper, shift, 0.0)) @ rotation.T
        for shift in ([0.01, 0.02, -0.08], [0.03, 0.05, -0.09])
    )
    history = contact.commit(contact.points(one, nodes @ rotation.T, ContactHistory.empty()))
    return contact, two, one, history


def test_forces_and_moments_balance(verify):
    """Forces sum up to zero; tractions at both ends of a gap g leave the couple g n x t, and nothing else."""
    contact, nodes, before, history = sliding()
    answer = contact.forces(contact.points(nodes, before, history), stiffness=False)
    points, active = answer.points, answer.points.active
    assert {STICK, SLIP} == set(points.status[active])
    level = np.abs(answer.node_force).sum()
    verify.at_most(
        "contact: sum of forces over their sizes", np.abs(answer.node_force.sum(axis=0)).max() / level, 1e-10
    )
    weight = PASS_SHARE * contact.quadrature.area[points.history.point[active]]
    lever = points.projection.distance[active, None] * points.projection.normal[active]
    couple = weight @ np.cross(lever, points.traction[active])
    moment = np.cross(nodes, answer.node_force).sum(axis=0)
    assert np.abs(couple).max() > 1e-5 * level
    verify.at_most(
        "contact: moment less the couple of gaps and friction, over forces times radius",
        np.abs(moment - couple).max() / level,
        1e-10,
    )


def test_superposed_rotation(verify):
    """Both configurations rotated: the forces turn with them, and so does what friction remembers."""
    contact, nodes, before, history = sliding()
    answer = contact.forces(contact.points(nodes, before, history), stiffness=False)
    rotation = exp(np.array([1.1, -0.7, 2.0]))
    contact, nodes, before, history = sliding(rotation)
    rotated = contact.forces(contact.points(nodes, before, history), stiffness=False)
    turned = answer.node_force @ rotation.T
    error = np.abs(rotated.node_force - turned).max() / np.abs(turned).max()
    verify.at_most("contact, superposed rotation: force", error, 1e-10)
    np.testing.assert_allclose(rotated.energy["friction"], answer.energy["friction"], rtol=1e-10)
