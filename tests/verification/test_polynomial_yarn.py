"""Solid yarns as polynomials times splines against exact solutions; elements alone, without contact and ties."""

from itertools import pairwise

import numpy as np
import pytest
import scipy.sparse as sp
from hexahedral_block import ISOTROPIC, LAWS
from polynomial_rods import AREA, INERTIA, POISSON, RADIUS, SHEAR, YOUNG, Rod, arc, straight
from scipy.sparse.linalg import splu

from knitstudy.mechanics.rotation import exp
from knitstudy.mechanics.spline_yarn import basis as disc
from knitstudy.mesh.sweep import rotation_minimising

laws = pytest.mark.parametrize("law", LAWS)

LENGTH = 6.0
UNEVEN = np.array([0.0, 1.0, 1.4, 2.0, 3.3, 4.5, LENGTH])
MIXED = [2, 2, 4, 3, 2, 2]


def bent(law="hencky"):
    """A bent yarn with spans and degrees of all kinds."""
    return Rod(arc(0.5 / RADIUS), UNEVEN, MIXED, law=law)


@pytest.mark.parametrize("law", ISOTROPIC)
def test_patch(law, verify):
    """An affine motion has the energy and the stress of the law, all over a bent yarn with spans of all kinds."""
    rod = bent(law)
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
    rod = bent(law)
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
    rod = bent("st_venant_kirchhoff")
    spin = np.array([[0.0, -0.2, 0.1], [0.2, 0.0, -0.15], [-0.1, 0.15, 0.0]])
    step = rod.nodes @ spin.T
    further = (rod.nodes + step) @ np.cross(np.eye(3), [0.3, -0.5, 0.8])
    scale = YOUNG * RADIUS * np.abs(further).max()
    knowing, derivative = (
        np.abs(rod.stiffness(step, way) @ further.ravel()).max() / scale for way in (step, None)
    )
    assert derivative > 1e-3
    verify.at_most("straight step that turns a solid yarn: force of turning on over E R u", knowing, 1e-13)


@laws
def test_tangent(law, verify):
    """The tangent agrees with central differences of the force, whose error falls with the square of the step."""
    rod = bent(law)
    rng = np.random.default_rng(3)
    u, direction = 0.003 * rng.normal(size=(2, *rod.nodes.shape))
    exact = rod.stiffness(u) @ direction.ravel()
    errors = []
    for step in (0.008, 0.004):
        forces = [rod.respond(u + sign * step * direction)[0].ravel() for sign in (1, -1)]
        errors.append(np.abs((forces[0] - forces[1]) / (2 * step) - exact).max() / np.abs(exact).max())
    verify.at_most(f"tangent, solid yarn, {law}", errors[1], 1e-6, "central differences")
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)


def tension(x):
    """Displacement of a rod along z that is stretched by 1."""
    return np.stack([-POISSON * x[:, 0], -POISSON * x[:, 1], x[:, 2]], axis=-1)


def bending(x):
    """That of a rod bent to a curvature of 1 about y."""
    side = x[:, 2] ** 2 + POISSON * (x[:, 0] ** 2 - x[:, 1] ** 2)
    return np.stack([-0.5 * side, -POISSON * x[:, 0] * x[:, 1], x[:, 0] * x[:, 2]], axis=-1)


def flat_bending(x):
    """The same of sections that keep their shape."""
    return np.stack([-0.5 * x[:, 2] ** 2, 0 * x[:, 0], x[:, 0] * x[:, 2]], axis=-1)


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


@pytest.mark.parametrize("degree", [2, 3, 4])
@pytest.mark.parametrize("name", RODS)
def test_straight_rod(name, degree, verify):
    """St Venant's solutions lie in the space, on uneven spans and where the degree changes as well."""
    field, component, expected = RODS[name]
    found = stiffness_of(Rod(straight, UNEVEN, np.maximum(MIXED, degree)), field)
    verify.at_most(
        f"straight solid yarn in {name}, p >= {degree}", abs(abs(found[component]) / expected - 1), 1e-6
    )


def test_linear_sections_lock_in_bending(verify):
    """With p = 1 a bent section cannot widen where it is compressed: its stiffness is that of hindered sides."""
    rod = Rod(straight, UNEVEN, 1, bends=False)
    hindered = (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
    found = abs(stiffness_of(rod, flat_bending)[4]) / (YOUNG * INERTIA)
    verify.within("straight solid yarn in bending, p = 1: too stiff by", found, hindered, 1e-6)


def wave(x):
    """A smooth field that no polynomial is, and its gradient (k, 3, 3)."""
    number = np.array([[0.9, 0.5, 0.7], [-0.6, 1.0, 0.8], [0.4, -0.8, 1.1]])
    phase = x @ number.T + [0.3, 1.0, -0.5]
    return np.sin(phase), np.cos(phase)[..., None] * number


def projection_error(spans, degree, spline_degree):
    """Return the error in energy, over the energy, of the linear solution whose exact one is `wave`."""
    rod = Rod(straight, np.linspace(0, 4.0, spans + 1), degree, spline_degree)
    spline = rod.space.yarns[0].spline
    point, gauss = np.polynomial.legendre.leggauss(spline_degree + 3)
    middle, half = spline.spans.mean(axis=1)[:, None], 0.5 * np.diff(spline.spans, axis=1)
    s, along = (middle + half * point).ravel(), (half * gauss).ravel()
    x, across = disc.quadrature(12)
    s, x = np.repeat(s, len(x)), np.tile(x, (len(s), 1))
    weight = np.multiply.outer(along, across * RADIUS**2).ravel()
    _, gradient = wave(np.column_stack([RADIUS * x, s]))
    lame = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    strain = 0.5 * (gradient + gradient.swapaxes(1, 2))
    stress = 2 * SHEAR * strain + lame * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    load = np.zeros_like(rod.nodes)
    for parent, stretch in enumerate((RADIUS, RADIUS, 1.0)):
        nodes, slope = rod.space.weights(np.zeros(len(s), int), x, s, parent)
        share = (weight[:, None] * slope / stretch)[..., None] * stress[:, None, :, parent]
        for i in range(3):
            load[:, i] += np.bincount(nodes.ravel(), share[..., i].ravel(), len(load))
    # Rigid motions are left open: they have no energy.
    solution = np.linalg.lstsq(rod.stiffness().toarray(), load.ravel(), rcond=1e-12)[0]
    exact = weight @ np.einsum("kij,kij->k", stress, strain)
    return 1 - solution @ load.ravel() / exact


@pytest.mark.parametrize("spline_degree", [2, 3])
def test_rate_in_spans(spline_degree, verify):
    """The error in strains falls with the power of the spline's degree."""
    coarse, fine = (projection_error(spans, 7, spline_degree) for spans in (4, 8))
    rate = 0.5 * np.log2(coarse / fine)
    verify.at_least(
        f"rate of strains in spans, solid yarn, splines of degree {spline_degree}",
        rate,
        spline_degree - 0.15,
        f"{spline_degree}",
    )


def test_rate_in_degree(verify):
    """Every degree over the section divides the error in strains by 3 and more."""
    errors = [np.sqrt(projection_error(12, degree, 3)) for degree in (2, 3, 4, 5)]
    ratio = min(first / second for first, second in pairwise(errors))
    verify.at_least("fall of the error in strains with a degree more, solid yarn", ratio, 3.0, "exponential")


def test_helical_spring(verify):
    """A slender spring under a force on its axis, ends free to turn: a rod bent and twisted (Love 1927, section 271).

    delta = P r^2 l (cos^2 a / G J + sin^2 a / E I) + P l (cos^2 a / G A + sin^2 a / E A), ends rigid.
    """
    radius, rise, turns = 12 * RADIUS, np.radians(12), 1.5
    length = 2 * np.pi * radius * turns / np.cos(rise)

    def helix(s):
        angle = s * np.cos(rise) / radius
        centre = np.stack([radius * np.cos(angle), radius * np.sin(angle), s * np.sin(rise)], axis=-1)
        flat = np.stack([-np.sin(angle), np.cos(angle), 0 * s], axis=-1)
        frames = rotation_minimising(centre, np.cos(rise) * flat + np.sin(rise) * np.array([0, 0, 1.0]))
        return centre, frames[:, 0], frames[:, 1]

    rod = Rod(helix, np.linspace(0, length, 41), 2)
    first, last = rod.end(last=False), rod.end(last=True)
    # The last section moves as a rigid body whose point on the axis is driven by the force.
    rigid = np.zeros((len(last), 3, 6))
    rigid[:, :, :3] = rod.space.unity[last, None, None] * np.eye(3)
    rigid[:, :, 3:] = -np.cross(rod.nodes[last][:, None], np.eye(3)).swapaxes(1, 2)
    inner = np.setdiff1d(np.arange(rod.space.size), np.concatenate([first, last]))
    free = (3 * inner[:, None] + np.arange(3)).ravel()
    size = len(free)
    rows = np.concatenate([free, (3 * last[:, None] + np.arange(3)).ravel()])
    spread = sp.block_diag([sp.identity(size), rigid.reshape(-1, 6)], format="csc")
    stiffness = rod.stiffness()[rows][:, rows]
    load = np.zeros(size + 6)
    load[size + 2] = 1.0
    moved = splu(sp.csc_matrix(spread.T @ stiffness @ spread)).solve(load)[size + 2]
    cosine, sine = np.cos(rise) ** 2, np.sin(rise) ** 2
    exact = radius**2 * length * (cosine / (2 * SHEAR * INERTIA) + sine / (YOUNG * INERTIA))
    exact += length * (cosine / (SHEAR * AREA) + sine / (YOUNG * AREA))
    verify.within("helical spring of a solid yarn, radius 12 R: compliance", moved, exact, 0.01)
