"""Solids against exact solutions: patch test, rigid rotation, tangents, manufactured solution."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from hexahedral_block import ISOTROPIC, LAWS, block, connect, made_of, solid, unknowns, with_middles

from knitstudy.mechanics.elements import hexahedron
from knitstudy.mechanics.elements.hexahedron import (
    CORNERS,
    GAUSS,
    OnePointHexahedron,
    QuadraticHexahedron,
    jacobians,
)
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.load_path import trace
from knitstudy.mechanics.materials import VOIGT, Material
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.model import Memoryless
from knitstudy.mechanics.rotation import exp
from knitstudy.mechanics.solid import SolidModel, SolidState


@dataclasses.dataclass(frozen=True)
class Kind:
    """An element, with its nodes in natural coordinates, functions, and gradients at the Gauss points.

    How far nodes of a cube are moved at random, over its edge; how far states are, and `steps` of differences; and how
    far nodes of a block are, so that its edges bend.
    """

    build: Callable
    natural: np.ndarray
    shape: Callable
    gradients: np.ndarray
    distortion: float
    displacement: float
    steps: tuple[float, float]
    curved: float = 0.0

    def block(self, n, distortion=0.0):
        """Nodes, elements and the boundary's node numbers of a block; edges are straight."""
        nodes, elements, outside = block(n, distortion)
        if len(self.natural) == len(CORNERS):
            return nodes, elements, outside
        nodes, elements, _ = with_middles(nodes, elements)
        return nodes, elements, np.flatnonzero(((nodes < 1e-9) | (nodes > 1 - 1e-9)).any(axis=1))


LINEAR = (CORNERS, hexahedron.shape, hexahedron.GRADIENTS, 0.08, 0.05, (4e-4, 2e-4))
QUADRATIC = (
    hexahedron.NATURAL,
    hexahedron.quadratic_shape,
    hexahedron.QUADRATIC_GRADIENTS,
    0.03,
    0.02,
    (1e-4, 5e-5),
    0.02,
)
KINDS = {"one-point": Kind(OnePointHexahedron, *LINEAR), "quadratic": Kind(QuadraticHexahedron, *QUADRATIC)}
elements = pytest.mark.parametrize("name", KINDS)
laws = pytest.mark.parametrize("law", LAWS)
isotropic_laws = pytest.mark.parametrize("law", ISOTROPIC)

EXACT = Settings(increments=1, residual_tolerance=1e-12, correction_tolerance=1e-9, exact=True)


@isotropic_laws
@elements
def test_patch(name, law, verify):
    """An affine motion of the boundary of a distorted block is continued inside, whatever the law."""
    nodes, hexahedra, outside = KINDS[name].block(3, distortion=0.25)
    model = solid(nodes, hexahedra, law, KINDS[name].build)
    gradient = np.array([[0.05, 0.02, -0.03], [0.04, -0.06, 0.01], [0.02, 0.03, 0.08]])
    affine = nodes @ gradient.T
    drive = PrescribedDisplacement(unknowns(outside), affine[outside].ravel())
    *_, end = trace(model, drive, EXACT, LU())
    error = np.abs(end.state.displacement - affine).max() / np.abs(affine).max()
    verify.at_most(f"patch test, {name}, {law}: displacement", error, 1e-10)


@laws
@elements
def test_rigid_rotation(name, law, verify):
    """A rotation alone gives no force, and superposed on a deformation it only turns the forces."""
    kind = KINDS[name]
    nodes, hexahedra, _ = kind.block(2, distortion=0.25)
    nodes = nodes + kind.curved * np.random.default_rng(5).normal(size=nodes.shape)
    model = solid(nodes, hexahedra, law, kind.build)
    rotation = exp(np.array([1.1, -0.7, 2.0]))
    rigid = model.respond(SolidState(nodes @ rotation.T - nodes), stiffness=False)
    level = 1300.0 * model.length**2
    verify.at_most(
        f"rigid rotation, {name}, {law}: force over E h^2", np.abs(rigid.force).max() / level, 1e-10
    )
    shift = kind.displacement * model.length * np.random.default_rng(1).normal(size=nodes.shape)
    before = model.respond(SolidState(shift), stiffness=False)
    after = model.respond(SolidState((nodes + shift) @ rotation.T - nodes), stiffness=False)
    turned = before.force.reshape(-1, 3) @ rotation.T
    error = np.abs(after.force.reshape(-1, 3) - turned).max() / np.abs(turned).max()
    verify.at_most(f"superposed rotation, {name}, {law}: force", error, 1e-10)
    assert after.energy["internal"] == pytest.approx(before.energy["internal"], rel=1e-10)


@laws
def test_material_tangent(law, verify):
    """Stress is the derivative of energy and the tangent that of stress, also at repeated principal strains."""
    material = made_of(law)
    strain = 0.1 * np.random.default_rng(2).normal(size=(6, 3, 3))
    strain = 0.5 * (strain + np.swapaxes(strain, 1, 2))
    strain[0], strain[1], strain[2] = 0, 0.1 * np.eye(3), np.diag([0.1, 0.1, -0.1])
    axes = exp(np.random.default_rng(6).normal(size=(6, 3))) if material.directional else None
    answer = material.respond(strain, True, axes)
    step, error = 1e-5, 0.0
    for column, (i, j) in enumerate(VOIGT):
        change = np.zeros((3, 3))
        change[i, j] += 0.5 * step
        change[j, i] += 0.5 * step
        plus, minus = (material.respond(strain + sign * change, False, axes) for sign in (1, -1))
        slope = (plus.energy - minus.energy) / (2 * step)
        np.testing.assert_allclose(slope, answer.stress[:, i, j], atol=1e-8)
        slopes = (plus.stress - minus.stress)[:, VOIGT[:, 0], VOIGT[:, 1]] / (2 * step)
        error = max(error, np.abs(slopes - answer.tangent[:, :, column]).max())
    verify.at_most(f"tangent, {law}", error / np.abs(answer.tangent).max(), 1e-6, "central differences")


@laws
@elements
def test_element_tangent(name, law, verify):
    """The tangent agrees with central differences of the force, whose error falls with the square of the step."""
    rng = np.random.default_rng(3)
    kind = KINDS[name]
    count = len(kind.natural)
    nodes = 0.5 * (kind.natural + 1) + kind.distortion * rng.normal(size=(4, count, 3))
    element = kind.build(nodes, made_of(law))
    u = kind.displacement * rng.normal(size=nodes.shape)
    direction = rng.normal(size=nodes.shape)
    stiffness = element.respond(slice(None), u, stiffness=True).stiffness.reshape(4, count, count, 3, 3)
    exact = np.einsum("eabik,ebk->eai", stiffness, direction)
    errors = []
    for step in kind.steps:
        forces = [element.respond(slice(None), u + sign * step * direction, False).force for sign in (1, -1)]
        errors.append(np.abs((forces[0] - forces[1]) / (2 * step) - exact).max() / np.abs(exact).max())
    verify.at_most(f"tangent, {name}, {law}", errors[1], 1e-6, "central differences")
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)


class Loaded(Memoryless):
    """A solid under dead nodal loads that starts from a given state."""

    def __init__(self, model, load, start):
        self.model, self.load, self._start = model, load, start
        self.block, self.size, self.scale, self.length = model.block, model.size, model.scale, model.length

    def start(self):
        return self._start

    def advance(self, state, step):
        return self.model.advance(state, step)

    def respond(self, state, stiffness):
        response = self.model.respond(state, stiffness)
        return dataclasses.replace(response, force=response.force - self.load)


def manufactured(x):
    """A smooth motion of the unit cube: displacement (k, 3) and its gradient (k, 3, 3)."""
    a = 0.06
    s, c = np.sin(np.pi * x), np.cos(np.pi * x)
    u = a * np.stack([s[:, 0] * c[:, 1], s[:, 1] * c[:, 2], s[:, 2] * c[:, 0]], axis=1)
    h = np.zeros((len(x), 3, 3))
    for i, j in ((0, 1), (1, 2), (2, 0)):
        h[:, i, i] = a * np.pi * c[:, i] * c[:, j]
        h[:, i, j] = -a * np.pi * s[:, i] * s[:, j]
    return u, h


def consistent_load(model: SolidModel, material: Material, kind: Kind):
    """Nodal loads that hold the manufactured motion, integrated as the element does: work on every shape function."""
    nodes = model.nodes[model.groups[0].connectivity]
    force = np.zeros(nodes.shape)
    for functions, natural in zip(kind.shape(GAUSS), kind.gradients, strict=True):
        determinant, gradient = jacobians(nodes, natural)
        _, h = manufactured(np.einsum("a,eai->ei", functions, nodes))
        strain = 0.5 * (h + np.swapaxes(h, 1, 2) + np.swapaxes(h, 1, 2) @ h)
        first = (h + np.eye(3)) @ material.respond(strain, tangent=False).stress
        force += determinant[:, None, None] * gradient @ np.swapaxes(first, 1, 2)
    return model.assembly.sum_forces([force])


def held(nodes, hexahedra, outside, kind: Kind):
    """Displacement (N, 3) under the loads that hold the manufactured motion, with the boundary where that has it."""
    model = solid(nodes, hexahedra, "hencky", kind.build)
    load = consistent_load(model, Hencky(1300.0, 0.42), kind)
    loaded = Loaded(model, load, SolidState(manufactured(nodes)[0]))
    fixed = unknowns(outside)
    *_, end = trace(loaded, PrescribedDisplacement(fixed, np.zeros(len(fixed))), EXACT, LU())
    return end.state.displacement


def test_manufactured_solution(verify, full):
    """Displacements of a smooth motion at finite strain converge with the second power of the element size."""
    counts, errors = np.array([4, 8, 16] if full else [3, 6]), []
    for n in counts:
        nodes, hexahedra, outside = block(n)
        bulge = 0.04 * np.prod(np.sin(np.pi * nodes), axis=1)
        nodes = nodes + bulge[:, None]  # a smooth distortion that leaves the boundary in place
        error = held(nodes, hexahedra, outside, KINDS["one-point"]) - manufactured(nodes)[0]
        errors.append(np.sqrt(np.mean(error**2)))
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    verify.at_least("manufactured solution, one-point: order of displacements", order, 1.8, "2")


def test_manufactured_solution_of_quadratic_elements(verify, full):
    """Displacements of a smooth motion at finite strain converge with the third power, in the mean square (L2).

    Serendipity functions hold all quadratic ones on parallelepipeds only, so the mesh is one of cubes.
    """
    counts, errors, kind = np.array([2, 4, 8] if full else [2, 4]), [], KINDS["quadratic"]
    for n in counts:
        nodes, hexahedra, outside = kind.block(n)
        moved = held(nodes, hexahedra, outside, kind)
        errors.append(_mean_square_error(nodes[hexahedra], moved[hexahedra]))
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    verify.at_least("manufactured solution, quadratic: order of displacements (L2)", order, 2.8, "3")


def _mean_square_error(corners, displacement):
    """Root of the mean square of the error, by 3 x 3 x 3 points."""
    place, weight = np.polynomial.legendre.leggauss(3)
    natural = np.stack(np.meshgrid(place, place, place, indexing="ij"), axis=-1).reshape(-1, 3)
    weight = np.einsum("i,j,k->ijk", weight, weight, weight).ravel() / 8
    functions = hexahedron.quadratic_shape(natural)
    exact = manufactured((functions @ corners).reshape(-1, 3))[0].reshape(len(corners), -1, 3)
    return np.sqrt(np.mean(((functions @ displacement - exact) ** 2).sum(axis=2) @ weight))


def test_pure_bending(verify, full):
    """A bar six elements high bends as beam theory says, and its hourglass control carries next to nothing."""
    high, count = 6, 60 if full else 36
    nodes, hexahedra = _bar(count, high)
    model = solid(nodes, hexahedra)
    x, y, z = nodes.T
    left, right = np.flatnonzero(x == 0), np.flatnonzero(x == x.max())
    angle = 1e-3
    # The ends stay plane and turn against each other about y; nothing else is held but rigid motions.
    corner, above = left[(y[left] == 0) & (z[left] == 0)], left[(y[left] == 0) & (z[left] == 1)]
    held = np.concatenate([3 * left, 3 * corner + 1, 3 * corner + 2, 3 * above + 1])
    value = np.concatenate([np.zeros(len(held)), -angle * (z[right] - 0.5)])
    # In a long bar the forces that balance are small beside those of the elements: rounding ends at 2e-12.
    settings = dataclasses.replace(EXACT, residual_tolerance=1e-10)
    *_, end = trace(model, PrescribedDisplacement(np.concatenate([held, 3 * right]), value), settings, LU())
    moment = -end.response.force[3 * right] @ (z[right] - 0.5)
    theory = 1300.0 / 12 * angle / x.max()  # E I kappa
    verify.within("pure bending, six one-point elements high: moment", moment, theory, 0.04)
    share = end.response.energy["hourglass"] / end.response.energy["internal"]
    verify.at_most("pure bending, six one-point elements high: hourglass over internal energy", share, 0.05)


def _bar(count, high):
    """Nodes and hexahedra of a bar of cubes with a section of 1 x 1, `high` elements a side."""
    counts = np.array([count, high, high])
    grid = np.stack(np.meshgrid(*map(np.arange, counts + 1), indexing="ij"), axis=-1)
    return grid.reshape(-1, 3) / high, connect(counts)
