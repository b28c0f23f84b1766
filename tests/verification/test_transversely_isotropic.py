"""Transversely isotropic elasticity: closed forms in hexahedra and solid yarns, and Hencky's law as a special case."""

import numpy as np
import pytest
from hexahedral_block import block, with_middles
from polynomial_rods import INERTIA, RADIUS, Rod
from refusals import REFUSED, refusal

from knitstudy.mechanics.core.rotation import exp
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.materials.transversely_isotropic import TransverselyIsotropic
from knitstudy.mechanics.solids.elements.hexahedron import OnePointHexahedron, QuadraticHexahedron

YARN = TransverselyIsotropic(1300.0, 400.0, 0.42, 0.25, 150.0)
LENGTH = 6.0


def test_of_equal_constants_it_is_hencky(verify):
    isotropic = Hencky(1.3, 0.42)
    same = TransverselyIsotropic(1.3, 1.3, 0.42, 0.42, isotropic.shear_modulus)
    rng = np.random.default_rng(1)
    strain = 0.15 * rng.normal(size=(40, 3, 3))
    strain = 0.5 * (strain + np.swapaxes(strain, 1, 2))
    actual, expected = (
        same.respond(strain, True, exp(rng.normal(size=(40, 3)))),
        isotropic.respond(strain, True),
    )
    for name in ("energy", "stress", "tangent"):
        error = (
            np.abs(getattr(actual, name) - getattr(expected, name)).max()
            / np.abs(getattr(expected, name)).max()
        )
        verify.at_most(f"transversely isotropic of equal constants against Hencky: {name}", error, 1e-12)


ACROSS = YARN.poisson_ratio * YARN.transverse_modulus / YARN.youngs_modulus
STRAINED = {
    "tension along the yarn": (2, YARN.youngs_modulus, (-YARN.poisson_ratio, -YARN.poisson_ratio, 1.0)),
    "pressure across it": (0, YARN.transverse_modulus, (1.0, -YARN.transverse_poisson_ratio, -ACROSS)),
}


@pytest.mark.parametrize("element", [OnePointHexahedron, QuadraticHexahedron])
@pytest.mark.parametrize("case", STRAINED)
def test_hexahedra_in_one_direction(case, element, verify):
    """Of a logarithmic strain e along one line and -nu e across it the force of a unit cube is E e / exp(e)."""
    along, modulus, shares = STRAINED[case]
    nodes, hexahedra, _ = block(2)
    if element is QuadraticHexahedron:
        nodes, hexahedra, _ = with_middles(nodes, hexahedra)
    strain = {0: -0.2, 2: 0.2}[along]
    stretch = np.exp(strain * np.array(shares))
    turn = exp(np.array([0.4, -0.9, 0.3]))  # of the undeformed block: axes come from its elements
    answer = element((nodes @ turn.T)[hexahedra], YARN).respond(
        slice(None), (nodes @ (np.diag(stretch) - np.eye(3)) @ turn.T)[hexahedra], False
    )
    force = np.zeros(nodes.shape)
    np.add.at(force, hexahedra, answer.force @ turn)
    expected = modulus * strain * np.exp(-strain)
    pulled = force[nodes[:, along] > 1 - 1e-9].sum(axis=0)
    verify.within(f"{case}, {element.__name__}: force", pulled[along], expected, 1e-9)
    assert np.abs(np.delete(pulled, along)).max() < 1e-9 * abs(expected)
    side = force[nodes[:, (along + 1) % 3] > 1 - 1e-9].sum(axis=0)
    assert np.abs(side).max() < 1e-9 * abs(expected)


@pytest.fixture(scope="module")
def rod():
    """A straight yarn that lies askew in space."""
    turn = exp(np.array([0.8, 0.3, -0.5]))

    def askew(s):
        axes = np.multiply.outer(np.ones_like(s), turn.T)
        return np.multiply.outer(s, turn[:, 2]), axes[:, 0], axes[:, 1]

    return Rod(askew, np.linspace(0, LENGTH, 7), 3, law=YARN), turn


def moment(rod, nodes, force):
    return np.cross(rod.nodes[nodes], force[nodes]).sum(axis=0)


def test_a_yarn_in_torsion(rod, verify):
    rod, turn = rod
    ends, angle = [rod.end(False), rod.end(True)], 1e-3
    twist = np.cross(turn[:, 2], rod.nodes[ends[1]]) * angle
    prescribed = np.concatenate(ends)
    values = np.concatenate([np.zeros((len(ends[0]), 3)), twist])
    _, force = rod.solve(prescribed, values)
    torque = moment(rod, ends[1], force) @ turn[:, 2]
    expected = YARN.axial_shear_modulus * 2 * INERTIA * angle / LENGTH
    verify.within("solid yarn, transversely isotropic: torsion", torque, expected, 1e-6)


def test_the_axis_follows_a_bent_yarn(verify):
    """A quarter of a circle whose angle opens at constant radius is strained by as much everywhere along itself."""
    bend = 20 * RADIUS

    def curve(s):
        t, zero = s / bend, 0 * s
        centre = bend * np.stack([np.cos(t), zero, np.sin(t)], axis=-1)
        return centre, np.stack([np.cos(t), zero, np.sin(t)], axis=-1), np.tile([0.0, 1.0, 0.0], (len(s), 1))

    rod = Rod(curve, np.linspace(0, 0.5 * np.pi * bend, 25), 3, law=YARN)
    share, volume = 1e-6, sum(group.elements.volume.sum() for group in rod.groups)
    stretch = rod.project(
        lambda x: share * np.arctan2(x[:, 2], x[:, 0])[:, None] * np.cross(x, [0.0, -1.0, 0.0])
    )
    _, stored = rod.respond(stretch)
    # Sections keep their shape: the energy is that of strain along the axis alone, by c_11.
    expected = 0.5 * YARN.stiffness[0, 0] * share**2 * volume
    verify.within("bent yarn, stretched around: energy", stored, expected, 0.01)


@pytest.mark.parametrize(("constants", "message"), REFUSED["constants"])
def test_constants_that_store_no_energy_are_refused(constants, message):
    with refusal(message):
        TransverselyIsotropic(*constants)
