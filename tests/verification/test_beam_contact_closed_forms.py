"""Two crossing beams pressed, dragged, reversed, spun and rolled, against beam theory and Coulomb's law."""

from dataclasses import replace

import numpy as np
import pytest
from crossing_beams import (
    LAWS,
    MODULUS,
    POISSON,
    RADIUS,
    SECTION,
    Beams,
    contact_forces,
    hairpin,
    on_the_way,
    pair_friction,
)
from half_spaces import overlap
from scipy.optimize import brentq

from knitstudy.knit.loading.history import FORMS
from knitstudy.mechanics.beams.laws import Power
from knitstudy.mechanics.core.rotation import exp

LENGTH, FRICTION, PRESS, DRAG = 30e-3, 0.3, 0.2e-3, 0.6e-3

# What one newton at the middle of a beam with clamped ends does there.
BEND = LENGTH**3 / (192 * SECTION.EI) + LENGTH / (4 * SECTION.kGA)
STRETCH = LENGTH / (4 * SECTION.EA)
TILT = LENGTH / (16 * SECTION.EI)
TWIST = LENGTH / (4 * SECTION.GJ)
# Of friction across the upper beam: that bends sideways and twists, the lower one is stretched and tilted.
ACROSS = BEND + RADIUS**2 * TWIST + STRETCH + RADIUS**2 * TILT


def beams(**changes):
    return Beams(**({"length": LENGTH, "friction": FRICTION} | changes))


def pressed(normal):
    """Force of two beams whose ends come nearer by PRESS, from their compliance and that of the contact."""
    approach = lambda force: 2 * BEND * force + overlap(normal, force)  # noqa: E731
    return brentq(lambda force: approach(force) - PRESS, 0, PRESS / (2 * BEND))


@pytest.mark.parametrize(
    ("name", "normal"),
    {
        "stiff penalty": LAWS["rigid"],
        "layers as soft as the beams": Power(2 / (BEND * PRESS), 2.0),
        "Hertz": LAWS["hertz"],
    }.items(),
)
def test_force_of_pressed_beams(name, normal, verify):
    """The stiff penalty overlaps less than points resolve, and yields a hundredth of a radius more at most."""
    case = beams(normal=normal)
    force = -case.contact_force(case.trace([[0, 0, -PRESS]])[-1])[2]
    verify.within(f"crossing beams pressed: force, {name}", force, pressed(normal), 0.01)


@pytest.mark.parametrize("law", LAWS)
def test_yarns_that_touch_twice_carry_both_forces(law, verify):
    """A hairpin over a straight yarn, undeformed, pressed by delta: the law's force and gap at both crossings."""
    model, depth = hairpin(law), 0.05 * RADIUS
    state = model.start()
    upper = state.position[:, 2:] > 0
    actual = model.commit(replace(state, position=state.position - [0, 0, depth] * upper)).contact
    force = LAWS[law].force(np.array(depth))[0]
    for k, side in enumerate(("first", "second")):
        verify.within(f"hairpin on a yarn: {side} force, {law}", -actual.force[k, 2], force, 0.01)
    np.testing.assert_allclose(actual.gap[:-1], -depth, rtol=1e-9)


def at(increments, load):
    return next(each for each in increments if abs(each.load - load) < 1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_friction_and_slip_of_dragged_beams(law, verify):
    """Pressed, dragged along the lower beam and back.

    Slip is the way of the ends less what the beams give way, forwards; less what they give way again, twice that, back.
    Forces follow the pattern of points where the contact is no longer than a few of them: a mean over the way counts.
    Points that part lose their elastic slip, 1.7 % of the way by Hertz (mu delta / share on the length of the patch).
    """
    legs = [[0, 0, -PRESS], [DRAG, 0, -PRESS], [0, 0, -PRESS]]
    case = beams(law=law)
    increments = case.trace(legs, increments=60)
    force, load = (
        np.array([case.contact_force(each) for each in increments]),
        [each.load for each in increments],
    )
    there, back = (np.abs(np.subtract(load, middle)) < 0.12 for middle in (0.54, 0.88))
    name = "crossing beams dragged"
    for way, part in (("forwards", there), ("back", back)):
        ratio = np.abs(force[part, 0]).mean() / -force[part, 2].mean()
        verify.within(f"{name} {way}: friction over force, {law}", ratio, FRICTION, 0.01)
    first, both = (at(increments, load).state.contact.slip[0] for load in (2 / 3, 1.0))
    give = FRICTION * pressed(LAWS[law]) * ACROSS
    verify.within(f"{name} forwards: slip, {law}", first, DRAG - give, 0.03)
    verify.within(f"{name} back: slip, {law}", both - first, DRAG - 2 * give, 0.03)


@pytest.mark.parametrize("law", LAWS)
def test_work_of_dragged_beams(law, verify):
    """The work at the ends is stored or lost to friction; where slip begins, its trapezoid takes many increments."""
    case = beams(law=law)
    increments = case.trace([[0, 0, -PRESS], [DRAG, 0, -PRESS]], increments=150)
    nodes = case.ends(1)
    force = np.array([each.response.force.reshape(-1, 6)[nodes, :3].sum(axis=0) for each in increments])
    place = np.array([each.state.position[nodes[0]] for each in increments])
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(place, axis=0))
    energy = sum(increments[-1].response.energy.get(form, 0.0) for form in FORMS)
    verify.within(f"crossing beams dragged: energy, {law}", energy, work, 0.01)


def test_beams_stick_before_they_slip(verify):
    """Half of the way to slip is elastic, of beams and of the patch where they touch, and goes back to nothing.

    The patch of two cylinders that cross at a right angle gives way by (2 - nu) / (4 a G) [m/N], a its radius (Johnson
    1985, section 7.2). Its rim slips even so: what slips in the mean is small against that.
    """
    case, law = beams(law="hertz", per_station=16), LAWS["hertz"]
    force = pressed(law)
    give = ACROSS + (2 - POISSON) * (1 + POISSON) / (2 * np.sqrt(RADIUS * overlap(law, force)) * MODULUS)
    half = 0.5 * FRICTION * force * give
    increments = case.trace([[0, 0, -PRESS], [half, 0, -PRESS], [0, 0, -PRESS]], increments=9)
    friction = case.contact_force(at(increments, 2 / 3))[0]
    verify.within("crossing beams dragged half way to slip: friction", friction, half / give, 0.01)
    assert increments[-1].state.contact.slip[0] < 2e-3 * half
    assert abs(case.contact_force(increments[-1])[0]) < 5e-3 * friction


def test_spin_in_place_slips(verify):
    """The surface of a yarn that turns about its axis slips by R times the angle."""
    case, angle = beams(law="hertz", per_station=16), DRAG / RADIUS
    last = case.trace([[0, 0, -PRESS], [0, 0, -PRESS]], increments=20, spins=[0.0, angle])[-1]
    force = case.contact_force(last)
    verify.within("crossing beams, one spun: friction over force", force[0] / force[2], FRICTION, 0.01)
    give = FRICTION * pressed(LAWS["hertz"]) * ACROSS
    verify.within("crossing beams, one spun: slip", last.state.contact.slip[0], RADIUS * angle - give, 0.01)


def test_rolling_does_not_slip(verify):
    """A yarn that moves by R times the angle of its spin rolls: what is left of friction is second order."""
    case, angle = beams(law="hertz", per_station=16), DRAG / RADIUS
    last = case.trace([[0, 0, -PRESS], [DRAG, 0, -PRESS]], increments=20, spins=[0.0, angle])[-1]
    force = case.contact_force(last)
    verify.at_most(
        "crossing beams, one rolled: friction over mu N", abs(force[0] / force[2]) / FRICTION, 0.05
    )
    assert last.state.contact.slip[0] < 1e-3 * DRAG


def integral_beside(law, tie, angle, fine=0.004):
    """Force on the upper of two straight beams and its couple about the tie, from pieces beyond 2 a of the crossing.

    The upper one has turned about the tie; lengths are over R.
    """
    s, t = np.meshgrid(*[np.arange(-2.0, 2.0, fine) * RADIUS + 0.5 * fine * RADIUS] * 2, indexing="ij")
    upper = t[..., None] * [0, np.cos(angle), np.sin(angle)]
    upper = upper + RADIUS * np.array([0, -np.sin(angle), np.cos(angle)])
    way = upper - s[..., None] * [1, 0, 0] + [0, 0, RADIUS]
    r = np.linalg.norm(way, axis=2)
    force, stiffness, _ = law.force(2 * RADIUS - r)
    push = (stiffness + force / r) / (2 * np.pi * r**2) * (fine * RADIUS) ** 2
    push[np.maximum(np.abs(s), np.abs(t)) < 2 * tie * RADIUS] = 0.0
    push = push[..., None] * way
    return push.sum(axis=(0, 1)), np.cross(upper, push).sum(axis=(0, 1))


@pytest.mark.parametrize("law", LAWS)
def test_beams_that_roll_over_their_tie_touch_beside_it(law, verify):
    """The upper beam, undeformed, turns over the lower one about the point where a tie of radius a R holds them.

    Pieces repel each other by V(r) = F(2 R - r) / 2 pi r (Kaldor et al. 2008), but not those within 2 a R of the
    crossing on both beams: straight beams that overlap by up to a^2 R touch nowhere else (Hertz: a is their patch).
    """
    tie, angle = 6 / 16 * 0.75e-3 / RADIUS / 2, 0.35  # discs end between two points
    model = beams(law=law, tie=tie, per_station=16, friction=0.0).model()
    rest = model.start()
    upper = rest.position[:, 2] > 0

    def carried(angle, depth):
        turn = exp(np.array([angle, 0, 0]))
        place = np.where(upper[:, None], rest.position @ turn.T - [0, 0, depth * RADIUS], rest.position)
        force = model.contact.respond(replace(rest, position=place))[0]
        couple = np.cross(place, force[:, :3]) + force[:, 3:]
        return -force[upper, :3].sum(axis=0), -couple[upper].sum(axis=0)

    (force, couple), (expected, about) = carried(angle, 0.0), integral_beside(LAWS[law], tie, angle)
    name = f"tied beams, one rolled: {{}}, {law}"
    verify.within(name.format("force"), np.linalg.norm(force), np.linalg.norm(expected), 0.01)
    verify.within(name.format("couple about the tie"), couple[0], about[0], 0.01)
    np.testing.assert_allclose(carried(-angle, 0.0)[1], -couple, atol=1e-9 * abs(couple[0]))
    assert not np.any(carried(0.0, 0.99 * tie**2))
    assert np.any(carried(0.0, 2 * tie**2))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", ["frictionless", "slip", "stick"])
def test_forces_and_moments_balance(law, kind, verify):
    """Forces exactly, and moments without friction.

    Friction acts on both yarns where their points met, which have parted by the slip u of the increment: that leaves
    at most the moment u x t of every pair.
    """
    model, state = on_the_way(law, kind)
    force, friction = contact_forces(model, state), pair_friction(model, state)
    lever = np.cross(state.position, force[:, :3])
    name = f"beams in contact: {{}}, {law}, {kind}"
    error = np.abs(force[:, :3].sum(axis=0)).max() / np.abs(force[:, :3]).sum()
    verify.at_most(name.format("balance of forces"), error, 1e-12)
    moment = np.abs((lever + force[:, 3:]).sum(axis=0)).max()
    parted = np.linalg.norm(friction.traction, axis=1) @ np.linalg.norm(friction.slip, axis=1)
    level = np.abs(lever).sum()
    verify.at_most(name.format("balance of moments"), moment / level, parted / level + 1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_rotation_of_everything_turns_the_forces(law, verify):
    """Of a state in the middle of an increment that slips, by 30 degrees: its history stays as it is."""
    model, state = on_the_way(law, "slip")
    turn = exp(np.radians(30) * np.array([2, -1, 2]) / 3)
    turned = replace(state, position=state.position @ turn.T, rotation=turn @ state.rotation)
    force = contact_forces(model, state).reshape(-1, 2, 3)
    error = np.abs(contact_forces(model, turned).reshape(-1, 2, 3) - force @ turn.T)
    level = np.abs(force).max(axis=(0, 2))
    error = (error.max(axis=(0, 2)) / level).max()
    verify.at_most(f"beams in contact: all turned by 30 degrees, {law}", error, 1e-10)
