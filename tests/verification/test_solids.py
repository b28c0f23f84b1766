"""Solids against exact solutions: patch test, rigid rotation, manufactured solution, modes without energy."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from hexahedral_block import ISOTROPIC, LAWS, block, connect, solid, unknowns, with_middles
from refusals import refusal

from knitstudy.mechanics.contact.solid import SolidModel, SolidState
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.model import Memoryless
from knitstudy.mechanics.core.rotation import exp
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.solids.elements import hexahedron
from knitstudy.mechanics.solids.elements.hexahedron import (
    CORNERS,
    GAUSS,
    NATURAL,
    EightPointHexahedron,
    OnePointHexahedron,
    QuadraticHexahedron,
    jacobians,
)


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
KINDS = {
    "one-point": Kind(OnePointHexahedron, *LINEAR),
    "eight-point": Kind(EightPointHexahedron, *LINEAR),
    "quadratic": Kind(QuadraticHexahedron, *QUADRATIC),
}
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
    element = QuadraticHexahedron(nodes, Hencky(1.0, 0.3))
    inside_out = -2 * nodes * [1, 0, 0]
    assert np.isnan(element.respond(slice(None), inside_out, stiffness=True).force).all()
    with refusal("folded"):
        QuadraticHexahedron(nodes * [-1, 1, 1], Hencky(1.0, 0.3))
