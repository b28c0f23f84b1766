"""Solid yarns as polynomials times splines against exact solutions; elements alone, without contact and ties."""

import numpy as np
import pytest
from hexahedral_block import ISOTROPIC, LAWS
from polynomial_rods import (
    AREA,
    INERTIA,
    LENGTH,
    MIXED,
    POISSON,
    RADIUS,
    SHEAR,
    UNEVEN,
    YOUNG,
    Rod,
    arc,
    bent_rod,
    straight,
)

from knitstudy.mechanics.core.rotation import exp

laws = pytest.mark.parametrize("law", LAWS)


@pytest.mark.parametrize("law", ISOTROPIC)
def test_patch(law, verify):
    """An affine motion has the energy and the stress of the law, all over a bent yarn with spans of all kinds."""
    rod = bent_rod(law)
    gradient = np.array([[0.05, 0.02, -0.03], [0.04, -0.06, 0.01], [0.02, 0.03, 0.08]])
    affine = rod.nodes @ gradient.T
    force, energy = rod.respond(affine)
    # Of a constant stress P the internal force of a node is P times the integral of its gradient, and W times volume.
    volume = sum(group.elements.volume.sum() for group in rod.groups)
    patch = rod.groups[0].elements.material.respond(
        0.5 * (gradient + gradient.T + gradient.T @ gradient)[None], False
    )
    verify.at_most(
        f"patch test, solid yarn, {law}: energy", abs(energy / (volume * patch.energy[0]) - 1), 1e-10
    )
    stress = (np.eye(3) + gradient) @ patch.stress[0]
    # The work of the forces on any other affine motion is that of the stress.
    other = np.random.default_rng(0).normal(size=(3, 3))
    work = np.einsum("ai,ai->", force, rod.nodes @ other.T)
    verify.at_most(
        f"patch test, solid yarn, {law}: stress", abs(work / (volume * np.sum(stress * other)) - 1), 1e-10
    )


@laws
def test_rigid_rotation(law, verify):
    """A rotation and a translation alone give no force, and superposed on a deformation they only turn the forces."""
    rod = bent_rod(law)
    rotation = exp(np.array([1.1, -0.7, 2.0]))
    shift = np.multiply.outer(rod.space.unity, [1.0, -2.0, 3.0])
    force, _ = rod.respond(rod.nodes @ rotation.T + shift - rod.nodes)
    verify.at_most(
        f"rigid motion, solid yarn, {law}: force over E R^2", np.abs(force).max() / (YOUNG * RADIUS**2), 1e-10
    )
    moved = 0.005 * np.random.default_rng(1).normal(size=rod.nodes.shape)
    before, energy = rod.respond(moved)
    after, same = rod.respond((rod.nodes + moved) @ rotation.T + shift - rod.nodes)
    error = np.abs(after - before @ rotation.T).max() / np.abs(before).max()
    verify.at_most(f"superposed motion, solid yarn, {law}: force", error, 1e-10)
    assert same == pytest.approx(energy, rel=1e-10)


def test_straight_step_that_turns(verify):
    """Of a yarn that a straight step has turned, which stretches it, the tangent lets it turn on all the same.

    The step has no strain to first order, so that there is no stress in the tangent: to turn on, which strains the yarn
    no more, takes no force. In the derivative of the force it takes that of the stretch.
    """
    rod = bent_rod("st_venant_kirchhoff")
    spin = np.array([[0.0, -0.2, 0.1], [0.2, 0.0, -0.15], [-0.1, 0.15, 0.0]])
    step = rod.nodes @ spin.T
    further = (rod.nodes + step) @ np.cross(np.eye(3), [0.3, -0.5, 0.8])
    scale = YOUNG * RADIUS * np.abs(further).max()
    knowing, derivative = (
        np.abs(rod.stiffness(step, way) @ further.ravel()).max() / scale for way in (step, None)
    )
    assert derivative > 1e-3
    verify.at_most("straight step that turns a solid yarn: force of turning on over E R u", knowing, 1e-13)


def tension(x):
    """Displacement of a rod along z that is stretched by 1."""
    return np.stack([-POISSON * x[:, 0], -POISSON * x[:, 1], x[:, 2]], axis=-1)


def bending(x):
    """That of a rod bent to a curvature of 1 about y."""
    side = x[:, 2] ** 2 + POISSON * (x[:, 0] ** 2 - x[:, 1] ** 2)
    return np.stack([-0.5 * side, -POISSON * x[:, 0] * x[:, 1], x[:, 0] * x[:, 2]], axis=-1)


def torsion(x):
    """That of a rod twisted by 1 a length."""
    return np.stack([-x[:, 1] * x[:, 2], x[:, 0] * x[:, 2], 0 * x[:, 0]], axis=-1)


RODS = {  # field, component of the resultant (force, then moment), what it is
    "tension": (tension, 2, YOUNG * AREA),
    "bending": (bending, 4, YOUNG * INERTIA),
    "torsion": (torsion, 5, 2 * SHEAR * INERTIA),
}


def stiffness_of(rod, field):
    """Return force and moment (6,) of the last section when both ends are moved as a field says."""
    ends = np.concatenate([rod.end(last=False), rod.end(last=True)])
    exact = rod.project(field)
    _, force = rod.solve(ends, exact[ends])
    end = rod.end(last=True)
    # Of a virtual translation and of a virtual rotation of the section.
    return np.concatenate(
        [rod.space.unity[end] @ force[end], np.cross(rod.nodes[end], force[end]).sum(axis=0)]
    )


@pytest.mark.parametrize("degree", [2, 4])
@pytest.mark.parametrize("name", RODS)
def test_straight_rod(name, degree, verify):
    """St Venant's solutions lie in the space, on uneven spans and where the degree changes as well."""
    field, component, expected = RODS[name]
    actual = stiffness_of(Rod(straight, UNEVEN, np.maximum(MIXED, degree)), field)
    verify.at_most(
        f"straight solid yarn in {name}, p >= {degree}", abs(abs(actual[component]) / expected - 1), 1e-6
    )


def energy_of(degree, poisson, push, turn):
    """Return the energy of a bent yarn whose last section is pushed and turned about the origin, first one held."""
    rod = Rod(arc(0.5 / RADIUS), np.linspace(0, LENGTH, 8), degree, poisson=poisson)
    ends, last = np.concatenate([rod.end(last=False), rod.end(last=True)]), rod.end(last=True)
    moved = np.zeros_like(rod.nodes)
    moved[last] = rod.space.unity[last, None] * push + np.cross(turn, rod.nodes[last])
    _, force = rod.solve(ends, moved[ends])
    return 0.5 * np.vdot(moved, force)


@pytest.mark.parametrize("poisson", [0.42, 0.499])
@pytest.mark.parametrize("component", [0, 1, 2, 4, 5])
def test_low_degrees_do_not_lock(component, poisson, verify):
    """Spans as long as those of knits, against degree 6; without a mean dilatation up to 88 % are too much."""
    motion = np.split(np.eye(6)[component], 2)
    ratio = energy_of(2, poisson, *motion) / energy_of(6, poisson, *motion)
    name = f"bent solid yarn of degree 2, nu = {poisson}, motion {component}"
    verify.at_most(name, abs(ratio - 1), 0.04, "over degree 6")
