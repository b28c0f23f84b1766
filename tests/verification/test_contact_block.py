"""Bodies in contact: a block on a plane, rings in each other, a yarn dragged over facets, balance of forces."""

import numpy as np
import pytest
from contact_bodies import MODULUS, Body, back, crossed_yarns, drive, law, plate, reaction, together, touching
from hexahedral_block import unknowns
from refusals import refusal

from knitstudy.mechanics.contact.friction import SLIP, STICK, ContactHistory
from knitstudy.mechanics.contact.grids import Grid
from knitstudy.mechanics.contact.indentation import indentation
from knitstudy.mechanics.contact.interaction import PASS_SHARE
from knitstudy.mechanics.contact.solid import Penetration
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.rotation import exp

SIZE = 0.25  # element size that stiffnesses refer to

PRESS = 0.01
FRICTION = 0.3


class Block:
    """A unit cube of `count`^3 elements on a wide rigid plane, its upper face driven.

    The plane's facets end where the block does, so that none of its points leaves the block's face: slip is less
    than the distance of the first point from the edge, 0.11.
    """

    def __init__(self, friction, *, count=4, poisson=0.0, rigid=False, **options):
        block = plate([count] * 3, np.ones(3), up=False).moved([1, 1, 0])
        plane = plate([3, 3, 1], [3, 3, 1], up=True).moved([0, 0, -1])
        self.model, first = together(
            [plane, block], law(SIZE, friction), size=SIZE, poisson=poisson, **options
        )
        self.held = np.arange(first[1])
        block = np.arange(first[1], first[2])
        self.driven = block if rigid else block[self.model.nodes[block, 2] > 1 - 1e-9]

    def trace(self, path, increments, stops=()):
        settings = Settings(
            increments=increments, residual_tolerance=1e-9, correction_tolerance=1e-8, growth=1.0
        )
        return list(trace(self.model, drive(self.held, self.driven, path, stops=stops), settings, LU()))

    def force(self, increment):
        """Force (3,) that the block puts on the plane."""
        return -reaction(increment, self.held)


def work(increments, driven):
    """Work (m,) of the driven nodes up to every increment, by the trapezoidal rule over reactions."""
    force = np.array([reaction(each, driven) for each in increments])
    moved = np.array([each.state.displacement[driven[0]] for each in increments])
    steps = 0.5 * (force[1:] + force[:-1]) * np.diff(moved, axis=0)
    return np.concatenate([[0.0], np.cumsum(steps.sum(axis=1))])


def test_friction_at_prescribed_slip(verify):
    """Wherever it is driven to, the block is held back by mu N, against its motion."""
    block = Block(FRICTION, poisson=0.4)
    path = np.array([[0, 0, -PRESS], [0.08, 0, -PRESS], [-0.06, -0.09, -PRESS]])
    increments = block.trace(path, 6)
    for where, end, way in (("", 4, path[1] - path[0]), (", turned", 6, path[2] - path[1])):
        force = block.force(increments[end])
        along = force @ way / np.linalg.norm(way)
        verify.within(f"block, prescribed slip{where}: friction over N", along / -force[2], FRICTION, 0.005)


@pytest.mark.parametrize("rigid", [True, False], ids=["rigid", "elastic"])
def test_loop_on_reversal(rigid, verify):
    """A block slid to and fro by s does the work 4 mu N (s - mu N / k), k the stiffness while it sticks.

    That of the contact is epsT A; the elastic block's, in series with its shear, is the slope of the first step.
    """
    slide, stick = 0.08, 10 * MODULUS / SIZE
    block = Block(FRICTION, count=2, rigid=rigid)
    # Increments end about where the block comes loose, where the rule of the trapezoid needs them.
    loose = 2 * FRICTION * PRESS if rigid else 0.019
    around = 0.25 * loose / (2 * slide) * (np.array([1.0]) if rigid else np.linspace(0.6, 1.4, 5))
    stops = (0.251, *(0.5 + around), *(0.75 + around))
    increments = block.trace(
        [[0, 0, -PRESS], [slide, 0, -PRESS], [-slide, 0, -PRESS], [slide, 0, -PRESS]], 16, stops
    )
    done = work(increments, block.driven)
    loads = np.array([each.load for each in increments])
    begun, first, last = (int(np.argmin(np.abs(loads - load))) for load in (0.251, 0.5, 1.0))
    normal = -block.force(increments[last])[2]
    if rigid:
        verify.within("rigid block: normal force over eps A g", normal / (stick * PRESS), 1.0, 1e-10)
    else:
        stick = block.force(increments[begun])[0] / increments[begun].state.displacement[block.driven[0], 0]
    area = 4 * FRICTION * normal * (slide - FRICTION * normal / stick)
    name = "rigid" if rigid else "elastic"
    verify.within(f"{name} block, slid to and fro: area of the loop", done[last] - done[first], area, 0.005)
    lost = increments[last].response.energy["friction"] - increments[first].response.energy["friction"]
    verify.within(f"{name} block, slid to and fro: dissipated energy", lost, area, 0.005)


def test_penetration_is_removed_or_refused():
    """Beyond its limit multipliers are updated until it is below, and without them the run stops."""
    press = [[0, 0, -PRESS]]
    limit = 1e-5
    block = Block(FRICTION, count=2, penetration=Penetration(limit, 20))
    *_, end = block.trace(press, 2)
    assert end.state.augmentations > 0
    assert block.model.contact.smallest_gap(block.model.contact_points(end.state)) > -limit
    with refusal("penetrate each other"):
        Block(FRICTION, count=2, penetration=Penetration(limit)).trace(press, 2)


def test_indentation_of_spline_yarns_is_refused_on_hexahedra():
    law = indentation(2, 0.9, 3, modulus=MODULUS, poisson=0.4, radius=1.0, friction=FRICTION)
    bodies = [plate([1, 1, 1], np.ones(3), up=up).moved([0, 0, -up]) for up in (True, False)]
    with refusal("surfaces belong to other elements, which resolve all of it: use"):
        together(bodies, law, size=SIZE)


EXACT = Settings(increments=1, residual_tolerance=1e-11, correction_tolerance=1e-9)
INNER, OUTER, SHRINK = 0.7, 1.4, 0.01
"""Radii of the pair of rings, which touch at 1, and what both are moved by towards each other."""


def ring(angles, radii, *, outward):
    """One layer of elements around z, of height 0.5, whose surface is its outer or its inner one.

    In axial direction the surface is linear, as the elements are: with more layers, the ends of a smooth open grid
    take less of a uniform pressure than the elements there do.
    """
    z, theta, r = np.meshgrid([0, 0.5], angles, radii, indexing="ij")
    number = np.arange(z.size).reshape(z.shape)
    ahead = np.roll(number, -1, axis=1)
    quads = [number[..., 0], number[..., 1], ahead[..., 1], ahead[..., 0]]
    hexahedra = np.stack([quad[0] for quad in quads] + [quad[1] for quad in quads], axis=1)
    nodes = np.stack([r * np.cos(theta), r * np.sin(theta), z], axis=-1).reshape(-1, 3)
    surface = number[..., 1] if outward else number[:, ::-1, 0]
    return Body(nodes, hexahedra, Grid(np.ascontiguousarray(surface)))


def pressures(inner, outer, turn, points):
    """Pressures at all points of two rings with so many facets, turned against each other by an angle [rad]."""
    angles = [2 * np.pi * np.arange(inner) / inner, turn + 2 * np.pi * np.arange(outer) / outer]
    bodies = [ring(angles[0], (INNER, 1.0), outward=True), ring(angles[1], (1.0, OUTER), outward=False)]
    size = 2 * np.pi / max(inner, outer)
    model, _ = together(bodies, law(size), size=size, points=points, overlap=1e-2)
    nodes = model.nodes
    radius = np.hypot(nodes[:, 0], nodes[:, 1])
    moved = np.flatnonzero((radius < INNER + 1e-9) | (radius > OUTER - 1e-9))
    way = nodes[moved] * [1, 1, 0] * (SHRINK * np.where(radius[moved] < 1, 1, -1) / radius[moved])[:, None]
    flat = unknowns(np.setdiff1d(np.arange(len(nodes)), moved))[2::3]
    motion = PrescribedDisplacement(
        np.concatenate([unknowns(moved), flat]), np.concatenate([way.ravel(), np.zeros(len(flat))])
    )
    *_, end = trace(model, motion, EXACT, LU())
    answer = model.contact_points(end.state)
    assert len(answer.active) == len(model.contact.quadrature.area)
    return answer.pressure


def spread(pressure):
    return np.ptp(pressure) / pressure.mean()


def test_patch_where_the_facets_match(verify):
    """Two Gauss points a side lie at one height over the facet, and carry the same."""
    error = spread(pressures(48, 48, 0.0, points=2))
    verify.at_most("contact patch, matching rings of 48 facets: spread of the pressure", error, 1e-10)


def test_patch_where_the_facets_differ(full, verify):
    """48 facets on 64: what is left falls with the number of Gauss points."""
    bars = {2: 0.04, 3: 0.025, 4: 0.015} if full else {2: 0.04, 3: 0.025}
    errors = {points: spread(pressures(48, 64, 0.1, points)) for points in bars}
    assert sorted(errors.values(), reverse=True) == list(errors.values())
    for points, bar in bars.items():
        case = (
            f"contact patch, rings of 48 on 64 facets, {points} Gauss points a side: spread of the pressure"
        )
        verify.at_most(case, errors[points], bar)


COARSE = 0.4  # element size of the yarns, whose radius is 1


SLAVE = {"two passes": {}, "one pass": {"one_pass": True, "meets": np.array([[False, True], [False, False]])}}


def sliding(rotation=None, **options):
    """Two yarns with disturbed surfaces in two increments: contact, nodes after each, and the slip history.

    Both configurations are turned by `rotation` (3, 3).
    """
    rotation = np.eye(3) if rotation is None else rotation
    bodies = crossed_yarns(3, 1, gap=0.02, angle=60)
    nodes, _, first, contact = touching(bodies, law(COARSE, 1.0), margin=0.3, overlap=1e-3, **options)
    noise = 0.01 * np.random.default_rng(0).normal(size=nodes.shape)
    upper = (np.arange(len(nodes)) >= first[1])[:, None]
    one, two = (
        (nodes + noise + np.where(upper, shift, 0.0)) @ rotation.T
        for shift in ([0.01, 0.02, -0.08], [0.03, 0.05, -0.09])
    )
    history = contact.commit(contact.points(one, nodes @ rotation.T, ContactHistory.empty()))
    return contact, two, one, history


@pytest.mark.parametrize("passes", SLAVE)
def test_forces_and_moments_balance(passes, verify):
    """Forces sum up to zero; tractions at both ends of a gap g leave the couple g n x t, and nothing else."""
    contact, nodes, before, history = sliding(**SLAVE[passes])
    answer = contact.forces(contact.points(nodes, before, history), stiffness=False)
    points, active = answer.points, answer.points.active
    assert {STICK, SLIP} == set(points.status[active])
    level = np.abs(answer.node_force).sum()
    verify.at_most(
        f"contact, {passes}: sum of forces over their sizes",
        np.abs(answer.node_force.sum(axis=0)).max() / level,
        1e-10,
    )
    weight = PASS_SHARE * contact.quadrature.area[points.history.point[active]]
    lever = points.projection.distance[active, None] * points.projection.normal[active]
    couple = weight @ np.cross(lever, points.traction[active])
    moment = np.cross(nodes, answer.node_force).sum(axis=0)
    assert np.abs(couple).max() > 1e-5 * level
    verify.at_most(
        f"contact, {passes}: moment less the couple of gaps and friction, over forces times radius",
        np.abs(moment - couple).max() / level,
        1e-10,
    )


def test_one_pass_has_the_points_of_the_slave_alone_which_carry_what_both_do(verify):
    """Two yarns pressed against each other: forces of one pass and of two differ by the mesh alone, a few per cent."""
    forces = {}
    for passes, options in SLAVE.items():
        contact, nodes, before, history = sliding(**options)
        points = contact.points(nodes, before, history)
        own = contact.quadrature.surface(points.history.point[points.active])
        assert set(own.tolist()) == ({0} if options else {0, 1})
        answer = contact.forces(points, stiffness=False)
        forces[passes] = answer.node_force[: len(nodes) // 2].sum(axis=0)
    one, two = (np.linalg.norm(forces[passes]) for passes in ("one pass", "two passes"))
    verify.at_most("contact, one pass: force less that of two passes, relative", abs(one / two - 1), 0.1)


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


@pytest.mark.parametrize(
    ("lower", "friction", "bar", "slow"),
    [
        ("rigid", 0.0, 0.02, False),
        ("rigid", 0.3, 0.02, True),
        # A node or the middle of an element below the contact: the elastic yarn itself is not equally stiff.
        ("elastic", 0.0, 0.03, True),
        ("elastic", 0.3, 0.035, True),
    ],
)
def test_ironing(lower, friction, bar, slow, full, skip_if_long, verify):
    """Two yarns pressed by 5% of the diameter; the upper one is moved along the lower one over four facets or more.

    They are 8 elements across at full resolution, otherwise 5. With friction the force is judged from where the whole
    contact slides.
    """
    skip_if_long(slow)
    core, rings, slide, increments = (4, 2, 1.2, 20) if full else (3, 1, 1.6, 12)
    size = 2 / (core + 2 * rings)
    bodies = crossed_yarns(core, rings, length=5.0)
    model, first = together(bodies, law(size, friction), size=size)
    up = np.array([0, 0, 1.0])
    held = np.arange(first[1]) if lower == "rigid" else back(bodies[0], -up)
    driven = back(bodies[1], up) + first[1]
    settings = Settings(increments=2 * increments, growth=1.0)
    motion = drive(held, driven, [[0, 0, -0.1], [slide, 0, -0.1]])
    begin = 0.7 if friction else 0.5
    force = [reaction(each, driven) for each in trace(model, motion, settings, LU()) if each.load >= begin]
    tangential, _, normal = np.transpose(force)
    case = f"ironing, lower yarn {lower}, mu = {friction}: ripple of the"
    verify.at_most(f"{case} normal force", abs(np.ptp(normal) / normal.mean()), bar)
    mean = tangential.mean() if friction else normal.mean()
    verify.at_most(f"{case} tangential force", abs(np.ptp(tangential) / mean), bar)
