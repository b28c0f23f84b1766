"""The quadratic hexahedron against exact solutions: patch test, rigid rotation, tangents, manufactured solution."""

import numpy as np
import pytest
from hexahedral_block import block, connect, solid, unknowns, with_middles
from test_solids import EXACT, Loaded, laws, manufactured

from knitstudy.errors import MeshError
from knitstudy.mechanics.elements.hexahedron import GAUSS, jacobians
from knitstudy.mechanics.elements.quadratic import (
    GRADIENTS,
    NATURAL,
    QuadraticHexahedron,
    shape,
    shape_gradient,
)
from knitstudy.mechanics.increment import PrescribedDisplacement
from knitstudy.mechanics.linear.lu import LU
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.rotation import exp
from knitstudy.mechanics.solid import SolidState


def quadratic_block(n, distortion=0.0):
    """Nodes, elements (E, 20) and the boundary's node numbers of a block; edges are straight."""
    nodes, hexahedra, _ = block(n, distortion)
    nodes, elements, _ = with_middles(nodes, hexahedra)
    return nodes, elements, np.flatnonzero(((nodes < 1e-9) | (nodes > 1 - 1e-9)).any(axis=1))


def test_shape_functions():
    natural = np.random.default_rng(0).uniform(-1, 1, (5, 3))
    np.testing.assert_allclose(shape(NATURAL), np.eye(20), atol=1e-15)
    np.testing.assert_allclose(shape(natural).sum(axis=1), 1, rtol=1e-14)
    np.testing.assert_allclose(shape(natural) @ NATURAL, natural, atol=1e-15)
    step = 1e-6 * np.eye(3)
    slope = [(shape(natural + h) - shape(natural - h)) / 2e-6 for h in step]
    np.testing.assert_allclose(shape_gradient(natural), np.stack(slope, axis=2), atol=1e-9)


@laws
def test_patch(law, verify):
    """An affine motion of the boundary of a distorted block is continued inside, whatever the law."""
    nodes, elements, outside = quadratic_block(3, distortion=0.25)
    model = solid(nodes, elements, law, QuadraticHexahedron)
    gradient = np.array([[0.05, 0.02, -0.03], [0.04, -0.06, 0.01], [0.02, 0.03, 0.08]])
    affine = nodes @ gradient.T
    drive = PrescribedDisplacement(unknowns(outside), affine[outside].ravel())
    *_, end = trace(model, drive, EXACT, LU())
    error = np.abs(end.state.displacement - affine).max() / np.abs(affine).max()
    verify.at_most(f"patch test, quadratic, {law}: displacement", error, 1e-10)


@laws
def test_rigid_rotation(law, verify):
    """A rotation alone gives no force, and superposed on a deformation it only turns the forces."""
    nodes, elements, _ = quadratic_block(2, distortion=0.25)
    nodes = nodes + 0.02 * np.random.default_rng(5).normal(size=nodes.shape)  # curved edges
    model = solid(nodes, elements, law, QuadraticHexahedron)
    rotation = exp(np.array([1.1, -0.7, 2.0]))
    rigid = model.respond(SolidState(nodes @ rotation.T - nodes), stiffness=False)
    level = 1300.0 * model.length**2
    verify.at_most(
        f"rigid rotation, quadratic, {law}: force over E h^2", np.abs(rigid.force).max() / level, 1e-10
    )
    shift = 0.02 * model.length * np.random.default_rng(1).normal(size=nodes.shape)
    before = model.respond(SolidState(shift), stiffness=False)
    after = model.respond(SolidState((nodes + shift) @ rotation.T - nodes), stiffness=False)
    turned = before.force.reshape(-1, 3) @ rotation.T
    error = np.abs(after.force.reshape(-1, 3) - turned).max() / np.abs(turned).max()
    verify.at_most(f"superposed rotation, quadratic, {law}: force", error, 1e-10)
    assert after.energy["internal"] == pytest.approx(before.energy["internal"], rel=1e-10)


@laws
def test_tangent(law, verify):
    """The tangent agrees with central differences of the force, whose error falls with the square of the step."""
    rng = np.random.default_rng(3)
    nodes = 0.5 * (NATURAL + 1) + 0.03 * rng.normal(size=(4, 20, 3))
    element = QuadraticHexahedron(nodes, Material(law, 1.0, 0.42))
    u = 0.02 * rng.normal(size=nodes.shape)
    direction = rng.normal(size=nodes.shape)
    stiffness = element.respond(slice(None), u, stiffness=True).stiffness.reshape(4, 20, 20, 3, 3)
    exact = np.einsum("eabik,ebk->eai", stiffness, direction)
    errors = []
    for step in (1e-4, 5e-5):
        forces = [element.respond(slice(None), u + sign * step * direction, False).force for sign in (1, -1)]
        errors.append(np.abs((forces[0] - forces[1]) / (2 * step) - exact).max() / np.abs(exact).max())
    verify.at_most(f"tangent, quadratic, {law}", errors[1], 1e-6, "central differences")
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)


def test_manufactured_solution(verify, full):
    """Displacements of a smooth motion at finite strain converge with the third power, in the mean square (L2).

    Serendipity functions hold all quadratic ones on parallelepipeds only, so the mesh is one of cubes.
    """
    counts = np.array([2, 4, 8] if full else [2, 4])
    material, errors = Material("hencky", 1300.0, 0.42), []
    for n in counts:
        nodes, elements, outside = quadratic_block(n)
        model = solid(nodes, elements, "hencky", QuadraticHexahedron)
        loaded = Loaded(model, _load(model, material), SolidState(manufactured(nodes)[0]))
        fixed = unknowns(outside)
        *_, end = trace(loaded, PrescribedDisplacement(fixed, np.zeros(len(fixed))), EXACT, LU())
        errors.append(_mean_square_error(nodes[elements], end.state.displacement[elements]))
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    verify.at_least("manufactured solution, quadratic: order of displacements (L2)", order, 2.8, "3")


def _load(model, material):
    """Nodal loads that hold the manufactured motion, integrated as the element does."""
    corners = model.nodes[model.groups[0].connectivity]
    force = np.zeros(corners.shape)
    for functions, natural in zip(shape(GAUSS), GRADIENTS, strict=True):
        determinant, gradient = jacobians(corners, natural)
        _, h = manufactured(np.einsum("a,eai->ei", functions, corners))
        strain = 0.5 * (h + np.swapaxes(h, 1, 2) + np.swapaxes(h, 1, 2) @ h)
        first = (h + np.eye(3)) @ material.respond(strain, tangent=False).stress
        force += determinant[:, None, None] * gradient @ np.swapaxes(first, 1, 2)
    return model.assembly.sum_forces([force])


def _mean_square_error(corners, displacement):
    """Root of the mean square of the error, by 3 x 3 x 3 points."""
    place, weight = np.polynomial.legendre.leggauss(3)
    natural = np.stack(np.meshgrid(place, place, place, indexing="ij"), axis=-1).reshape(-1, 3)
    weight = np.einsum("i,j,k->ijk", weight, weight, weight).ravel() / 8
    functions = shape(natural)
    exact = manufactured((functions @ corners).reshape(-1, 3))[0].reshape(len(corners), -1, 3)
    return np.sqrt(np.mean(((functions @ displacement - exact) ** 2).sum(axis=2) @ weight))


@pytest.mark.parametrize(("counts", "modes"), [((1, 1, 1), 6), ((3, 1, 1), 4), ((2, 2, 1), 0)])
def test_modes_without_energy(counts, modes):
    """Six of one cube alone; where two by two lie side by side, as in the section of a yarn, there are none."""
    nodes = np.stack(np.meshgrid(*(np.arange(n + 1.0) for n in counts), indexing="ij"), axis=-1).reshape(
        -1, 3
    )
    nodes, elements, _ = with_middles(nodes, connect(counts))
    model = solid(nodes, elements, element=QuadraticHexahedron)
    stiffness = np.linalg.eigvalsh(model.respond(model.start(), stiffness=True).stiffness.toarray())
    assert (stiffness < 1e-10 * stiffness[-1]).sum() == 6 + modes  # and rigid motions


def test_folded_elements():
    nodes = NATURAL[None] + 0.0
    element = QuadraticHexahedron(nodes, Material("hencky", 1.0, 0.3))
    inside_out = -2 * nodes * [1, 0, 0]
    assert np.isnan(element.respond(slice(None), inside_out, stiffness=True).force).all()
    with pytest.raises(MeshError, match="folded"):
        QuadraticHexahedron(nodes * [-1, 1, 1], Material("hencky", 1.0, 0.3))
