"""Tangents of all laws and models, and forces of their energies, against central differences: one table.

A central difference differs from the derivative by a share of the square of its step. Where a case has two steps, its
error has to fall by four from the first to the second one.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pytest
from contact_bodies import crossed_yarns, law, touching
from crossing_beams import FRICTION, LAWS, alone, contact_forces, on_the_way, pair_friction
from half_spaces import hertz
from hexahedral_block import LAWS as MATERIALS
from hexahedral_block import made_of, solid
from polynomial_rods import bent_rod
from test_contact_indentation import CrossedYarns
from test_line_contact import D, disturbed, two_rows
from test_membrane import COUPLED, irregular
from test_periodic_cell import stretched, tied_cell
from test_solids import KINDS

from knitstudy.knit.geometry.lay_out import initial_loop
from knitstudy.knit.geometry.optimise import CostFunction
from knitstudy.knit.geometry.spline import CatmullRom
from knitstudy.mechanics.beams.beam import BeamSection, LinearSprings
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.curved_rod import CurvedSection
from knitstudy.mechanics.beams.laws import LAYERS, CrossedCylinders, Mixed, Patch, Power
from knitstudy.mechanics.contact.friction import SLIP, STICK, ContactHistory
from knitstudy.mechanics.contact.indentation import indentation
from knitstudy.mechanics.contact.solid import SolidState
from knitstudy.mechanics.core.rotation import Halfway, exp
from knitstudy.mechanics.materials import VOIGT
from knitstudy.run.configuration import knits_of, load_scenes
from knitstudy.use.membrane_law import MembraneModel, forces_per_width, green


@dataclass(frozen=True)
class Case:
    """A quantity along a line of states, its derivative at 0 as the code has it, and the steps of differences."""

    along: Callable[[float], np.ndarray]
    derivative: np.ndarray
    steps: tuple[float, ...]
    bar: float = 1e-6


def normal(shape, seed=3):
    return np.random.default_rng(seed).normal(size=shape)


def force_of(model, state, *steps, bar=1e-6):
    """The tangent of a model at a state, along a line in which all unknowns move."""
    way = normal(model.size) / model.scale
    return Case(
        lambda t: model.respond(model.advance(state, t * way), False).force / model.scale,
        model.respond(state, True).stiffness @ way / model.scale,
        steps,
        bar,
    )


def energy_of(model, state, step):
    """The force of a model at a state, as the derivative of its energy."""
    way = normal(model.size) / model.scale
    return Case(
        lambda t: model.respond(model.advance(state, t * way), False).energy["internal"],
        model.respond(state, False).force @ way,
        (step,),
    )


def relative(of, derivative, x, step=1e-5, bar=1e-5):
    """A function of one variable at many places; every place counts alike."""
    level = derivative(x) * x
    return Case(lambda t: of((1 + t) * x) / level, np.ones(len(x)), (step,), bar)


def network(offsets, arms_turn=True, springs=False, curved=False):
    """Six nodes, a branch, and a random zigzag; optionally with arms at all ends, and with springs."""
    rng = np.random.default_rng(5)
    nodes = np.cumsum(rng.normal(size=(6, 3)), axis=0)
    ends = np.array([[0, 1], [1, 2], [3, 2], [3, 4], [2, 5], [4, 5]])
    arms = 0.4 * rng.normal(size=(6, 2, 3)) if offsets else None
    arm = 0.4 * rng.normal(size=(2, 2, 3)) * offsets
    stiffness = np.array([np.diag([100.0, 300.0, 900.0]), 50 * np.outer([1, 2, 3], [1, 2, 3])])
    joined = LinearSprings(np.array([[0, 4], [5, 1]]), arm, stiffness)
    section = BeamSection(EA=1e3, kGA=4e2, EI=50.0, GJ=30.0)
    if curved:
        section = CurvedSection(0.7, 1e3, 0.42, 0.4 * rng.normal(size=(6, 3)))
    return BeamModel(nodes, ends, section, 0.7, arms, arms_turn, joined if springs else None)


NETWORKS = {
    "nodes": {"offsets": False},
    "rigid arms": {"offsets": True},
    "springs between nodes": {"offsets": False, "springs": True},
    "springs between rigid arms": {"offsets": True, "springs": True},
    "curved rods": {"offsets": True, "curved": True},
    "curved rods and springs": {"offsets": True, "springs": True, "curved": True},
    "arms that only follow": {"offsets": True, "arms_turn": False},
    "springs between arms that only follow": {"offsets": True, "arms_turn": False, "springs": True},
}
"""Those whose arms only follow have no energy."""


def beams(of, *steps, **keys):
    """A network far from rest, with large rotations."""
    model = network(**keys)
    return of(model, model.advance(model.start(), 0.6 * normal(model.size, 6)), *steps)


class Crossing:
    """Two crossing yarns of radius 1 whose surface nodes go wherever a case puts them."""

    def __init__(self, friction):
        coulomb, bodies = law(0.4, friction, tangential=7.0), crossed_yarns(3, 1, gap=0.02)
        self.nodes, _, first, self.contact = touching(bodies, coulomb, margin=0.3, overlap=1e-3)
        self.upper = np.arange(len(self.nodes)) >= first[1]
        self.noise = 0.01 * normal(self.nodes.shape, 0)

    def moved(self, shift):
        """Nodes with the upper yarn shifted, and all of them disturbed."""
        return self.nodes + self.noise + np.where(self.upper[:, None], shift, 0.0)

    def points(self, shift, before, history):
        return self.contact.points(self.moved(shift), before, history)

    def history(self, shift):
        """What an increment that ends at a shift leaves."""
        return self.moved(shift), self.contact.commit(self.points(shift, self.nodes, ContactHistory.empty()))

    def case(self, shift, before, history):
        """The tangent at a shift, and the points there."""
        way = normal(self.nodes.shape, 1)

        def answer(t, stiffness=False):
            points = self.contact.points(self.moved(shift) + t * way, before, history)
            return self.contact.forces(points, stiffness)

        now = answer(0.0, stiffness=True)
        derivative = now.stiffness @ way.ravel()
        return Case(lambda t: answer(t).node_force.ravel(), derivative, (1e-6,)), now.points


PRESSED = [0.01, 0.02, -0.08]
BRANCHES = {
    "slip": (0.1, {SLIP}),
    "stick": (20.0, {STICK}),
    "stick and slip": (3.0, {STICK, SLIP}),
    "rough": (np.inf, {STICK}),
    "frictionless": (0.0, {SLIP}),
}


def in_contact(name):
    friction, expected = BRANCHES[name]
    crossing = Crossing(friction)
    before, history = crossing.history(PRESSED)
    assert np.count_nonzero(history.pressure) > 20
    case, points = crossing.case([0.03, 0.04, -0.08], before, history)
    old = points.history.pressure[points.active] > 0
    assert set(points.status[points.active][old]) == expected
    return case


def at_first_touch(name):
    """Points that close within the increment have slid in contact only since."""
    friction, expected = BRANCHES[name]
    crossing = Crossing(friction)
    before, history = crossing.history([0.0, 0.0, 0.02])
    assert not history.pressure.any()
    case, points = crossing.case([0.3, 0.1, -0.08], before, history)
    closing = points.slip_share[points.active]
    assert np.all((closing > 0) & (closing < 1))
    assert set(points.status[points.active]) == expected
    return case


def with_multipliers(name):
    crossing = Crossing(BRANCHES[name][0])
    before, history = crossing.history(PRESSED)
    history = crossing.contact.augment(crossing.points([0.03, 0.04, -0.08], before, history))
    case, points = crossing.case([0.03, 0.04, -0.075], before, history)
    assert np.all(points.history.multiplier[points.active] < 0)
    return case


def beams_in_contact(name, kind):
    """Contact of hooked yarns alone, its stations carried by nodes beside them."""
    model, state = on_the_way(name, kind)
    assert pair_friction(model, state).slides.any() == (kind in ("slip", "frictionless"))
    way = (normal((model.size // 6, 6)) * [1, 1, 1, 100, 100, 100]).ravel()
    tangent = model.respond(state, True).stiffness - alone(model).respond(state, True).stiffness
    return Case(
        lambda t: contact_forces(model, model.advance(state, t * way)).ravel() / model.scale,
        tangent @ way / model.scale,
        (2e-9,),
    )


def endless_beams(friction, patch, unlike=False):
    """Beams, and contact that slides at some pairs, sticks at others and begins at some."""
    model = two_rows(friction, per_node=2)
    law = replace(model.contact.repulsion.law, patch=patch)
    model.contact.repulsion = replace(model.contact.repulsion, law=law)
    if unlike:
        other = replace(law, coefficient=0.3 * law.coefficient, exponent=1.8)
        laws, kind = (law, other), model.contact.yarn
        model.contact.repulsion = Mixed.of_yarns(laws, (D, 0.8 * D), 0.02, kind)
    state = disturbed(model)
    active = model.contact.active_pairs(model.at_points(state), model.vectors(state), state.contact)
    assert len(active.pairs.i) > 50
    assert friction == 0 or 0 < active.friction.slides.mean() < 1
    assert friction == 0 or 0 < (active.friction.rate != 0).mean() < 1
    return force_of(model, state, 2e-7, bar=5e-6)


def spline_yarns_in_contact():
    """Yarns that cross askew, pressed and slid from where an increment began; some points slide."""
    yarns = CrossedYarns(3, 0.9, 60, 0.4, friction=0.3)
    model, upper = yarns.model, np.arange(len(yarns.space.unity)) >= len(yarns.space.unity) // 2

    def moved(state, shift):
        step = upper[:, None] * yarns.space.unity[:, None] * shift
        return model.advance(model.begin(state, 0.0, 1.0), step.ravel())

    first = model.commit(moved(model.start(), [0.0, 0.0, -0.05]))
    state = moved(first, [0.01, 0.005, -0.01])
    status = model.contact_points(state).status
    assert {STICK, SLIP} <= set(status)
    return force_of(model, replace(state, step=None), 1e-7)


def material(name, of):
    """Stress as the derivative of energy, or the tangent as that of stress, also at repeated principal strains."""
    material = made_of(name)
    strain, way = (each + np.swapaxes(each, 1, 2) for each in 0.05 * normal((2, 6, 3, 3), 2))
    strain[:3] = 0 * np.eye(3), 0.1 * np.eye(3), np.diag([0.1, 0.1, -0.1])
    axes = exp(normal((6, 3), 6)) if material.directional else None
    now, (i, j) = material.respond(strain, True, axes), VOIGT.T
    if of == "energy":
        derivative = np.einsum("eij,eij->e", now.stress, way)
    else:
        derivative = np.einsum("ecd,ed->ec", now.tangent, way[:, i, j] * np.where(i == j, 1, 2))

    def along(t):
        answer = material.respond(strain + t * way, False, axes)
        return answer.energy if of == "energy" else answer.stress[:, i, j]

    return Case(along, derivative, (1e-4,))


def block_of(kind, name):
    kind = KINDS[kind]
    nodes, hexahedra, _ = kind.block(2, distortion=0.15)
    nodes = nodes + kind.curved * normal(nodes.shape, 5)
    model = solid(nodes, hexahedra, name, kind.build)
    state = SolidState(kind.displacement * model.length * normal(nodes.shape, 1))
    return force_of(model, state, *(0.5 * np.array(kind.steps)))


def spline_yarn(name):
    rod = bent_rod(name)
    u, way = 0.003 * normal((2, *rod.nodes.shape))
    return Case(lambda t: rod.respond(u + t * way)[0].ravel(), rod.stiffness(u) @ way.ravel(), (8e-3, 4e-3))


def membrane(degree, of):
    nodes, elements, _ = irregular(degree)
    return of(MembraneModel(nodes, elements, COUPLED), 0.01 * normal(nodes.shape, 1), 1e-6)


def cell_of_tied_yarns(axis):
    """Forces per width of a cell in balance; moduli change by half over 5 %."""
    cell, at, way = tied_cell(), np.array([0.03, 0.01, 0.02]), np.eye(3)[axis]
    state, _ = stretched(cell, at)
    tangent = cell.stiffness(replace(state, step=None), slice(3))
    return Case(lambda t: stretched(cell, at + t * way)[1], tangent[:, axis], (1e-4,), 1e-4)


OF_MEMBRANES = {
    "stress": (lambda law, x: law.energy(x), lambda law, x, way: (law.stress(x) * way).sum(-1)),
    "tangent": (lambda law, x: law.stress(x), lambda law, x, way: (law.tangent(x) @ way[..., None])[..., 0]),
    "forces per width": (
        lambda law, x: law.energy(green(x)[0]),
        lambda law, x, way: (forces_per_width(law, x) * way).sum(-1),
    ),
}


def law_of_membranes(of):
    law, (function, derivative) = COUPLED, OF_MEMBRANES[of]
    strain, way = 0.1 * normal((2, 8, 3))
    strain[:, :2] += 0.2
    return Case(lambda t: function(law, strain + t * way), derivative(law, strain, way), (1e-5,))


REPULSIONS = {
    "power": Power(3.0),
    "half spaces": hertz(1.3e9, 0.42, 0.9e-3),
    "cylinders": CrossedCylinders.elastic(1.3e9, 0.42, 0.9e-3),
}


def repulsion(name, order):
    law = REPULSIONS[name]
    assert not np.any(law.force(np.array([-3e-6])))
    return relative(lambda x: law.force(x)[order], lambda x: law.force(x)[order + 1], np.array([2e-5, 1e-6]))


def local_indentation(of):
    """Energy, pressure and stiffness of sticking of the law, by the depth and at many angles."""
    law = indentation(3, 0.9, 3, modulus=1300.0, poisson=0.4, radius=0.5, friction=0.3)
    depth = np.concatenate([np.geomspace(1e-6, 0.05, 40), [0.2]]) * 0.5
    angle = np.linspace(0.2, np.pi / 2, len(depth))
    pressure, at = lambda x: law.pressure(-x, 0.0, angle), lambda x: law.at(-x, angle)
    if of == "pressure":
        return relative(lambda x: law.stored(-x, None, angle), pressure, depth, bar=1e-6)
    assert np.all(at(depth).normal > 0)
    if of == "stiffness":
        return relative(pressure, lambda x: at(x).normal, depth, bar=1e-4)
    return Case(lambda t: at((1 + t) * depth).tangential / depth, -at(depth).slope, (1e-5,), 2e-3)


def rotations(of):
    """Maps of finite rotations, at small and large angles."""
    angles = np.array([0.0, 1e-9, 1e-4, 0.3, 1.0, 2.5, 3.1])
    axes, way, m = (each / np.linalg.norm(each, axis=1)[:, None] for each in normal((3, 7, 3)))
    vector, now = angles[:, None] * axes, Halfway.of(angles[:, None] * axes)
    if of == "H":
        derivative = np.einsum("kij,kj->ki", now.dHm(vector, m), way)
        return Case(
            lambda t: np.einsum("kij,kj->ki", Halfway.of(vector + t * way).H(vector + t * way), m),
            derivative,
            (1e-5,),
        )
    return Case(lambda t: Halfway.of(vector + t * way).b, now.db * (vector * way).sum(1), (1e-5,))


def cost_of_a_loop(term, sharp=False):
    """Terms of F; a polygon folded by more than 135 degrees takes the second branch of Eq. (5)."""
    scene = next(iter(knits_of(load_scenes()).values()))
    loop = initial_loop(scene).in_radii()
    function = getattr(CostFunction(loop, scene.geometry), term)
    points = loop.control_points + 0.05 * normal(loop.control_points.shape, 2)
    if sharp:
        number = np.arange(16)
        points = np.column_stack([number % 2 * 5.0, 0.5 * number, 0.1 * number**1.5])
    way = normal(points.shape)
    return Case(lambda t: function(points + t * way)[0], (function(points)[1] * way).sum(), (1e-5,))


def curve(order):
    """A Catmull-Rom curve, away from joints: there its second derivative jumps."""
    points = 0.3 * normal((7, 3), 0) + np.outer(np.arange(7), [1, 0, 0])
    curve, u = CatmullRom(points, [7.0, 0.5, 0.0]), np.linspace(-8, 15, 301)
    u = u[np.abs(u - np.round(u)) > 1e-3]
    functions = curve.value, curve.d1, curve.d2
    return Case(lambda t: functions[order](u + t), functions[order + 1](u), (1e-5,))


CASES = {
    **{f"beams: {name}": partial(beams, force_of, 8e-5, 4e-5, **keys) for name, keys in NETWORKS.items()},
    **{
        f"energy of beams: {name}": partial(beams, energy_of, 1e-5, **keys)
        for name, keys in NETWORKS.items()
        if keys.get("arms_turn", True)
    },
    **{f"contact: {name}": partial(in_contact, name) for name in BRANCHES},
    **{f"first touch: {name}": partial(at_first_touch, name) for name in ("slip", "rough")},
    **{f"multipliers: {name}": partial(with_multipliers, name) for name in ("slip", "rough")},
    **{
        f"beams in contact: {name}, {kind}": partial(beams_in_contact, name, kind)
        for name in LAWS
        for kind in FRICTION
    },
    **{
        f"endless beams: {name}, mu = {mu}{', two yarns' if unlike else ''}": partial(
            endless_beams, mu, patch, unlike
        )
        for name, patch in (("layers", LAYERS), ("half spaces", Patch(0.3)))
        for mu in (0.0, 0.5)
        for unlike in (False, True)
    },
    "spline yarns in contact": spline_yarns_in_contact,
    **{f"{of} of {name}": partial(material, name, of) for name in MATERIALS for of in ("energy", "stress")},
    **{f"{kind}: {name}": partial(block_of, kind, name) for kind in KINDS for name in MATERIALS},
    **{f"spline yarn: {name}": partial(spline_yarn, name) for name in MATERIALS},
    **{
        f"{name} of a membrane, degree {degree}": partial(membrane, degree, of)
        for degree in (1, 2)
        for name, of in (("force", force_of), ("energy", energy_of))
    },
    **{f"tied cell, strain {axis}": partial(cell_of_tied_yarns, axis) for axis in range(3)},
    **{f"{of} of a law of membranes": partial(law_of_membranes, of) for of in OF_MEMBRANES},
    **{
        f"repulsion, {name}: {of}": partial(repulsion, name, order)
        for name in REPULSIONS
        for order, of in enumerate(("stiffness", "stiffening"))
    },
    **{f"indentation: {of}": partial(local_indentation, of) for of in ("pressure", "stiffness", "sticking")},
    **{f"rotation: {of}": partial(rotations, of) for of in "Hb"},
    **{
        f"gradient of F: {term}": partial(cost_of_a_loop, term)
        for term in ("distance", "continuous", "join", "length", "value")
    },
    "gradient of F: sharp join": partial(cost_of_a_loop, "join", sharp=True),
    **{f"curve: order {order + 1}": partial(curve, order) for order in (0, 1)},
}


@pytest.mark.parametrize("name", CASES)
def test_derivative(name, verify):
    case = CASES[name]()
    level, errors = np.abs(case.derivative).max(), []
    for step in case.steps:
        slope = (case.along(step) - case.along(-step)) / (2 * step)
        errors.append(np.abs(slope - case.derivative).max() / level)
    verify.at_most(f"derivative, {name}", errors[-1], case.bar, "central differences")
    if len(errors) > 1:
        assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)


def test_ends_turned_against_each_other_by_almost_half_a_turn_give_nan():
    model = network(offsets=False)
    step = np.zeros(model.size)
    step[9] = 0.97 * np.pi
    assert np.isnan(model.respond(model.advance(model.start(), step), stiffness=False).force).any()
