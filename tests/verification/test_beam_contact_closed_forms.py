"""Two crossing beams pressed, dragged, reversed, spun and rolled, against beam theory and Coulomb's law."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from crossing_beams import LAWS, MODULUS, POISSON, RADIUS, SECTION, Beams, hairpin
from scipy.optimize import brentq

from knitstudy.loading.history import FORMS
from knitstudy.mechanics.beam_contact import Power
from knitstudy.mechanics.rotation import exp
from knitstudy.models.beams_in_contact import STRIP

BOUNDED = 1e-3  # the factor of the shape is 1 at a right angle but for its smooth bounds
LENGTH, FRICTION, PRESS, DRAG = 30e-3, 0.3, 0.2e-3, 0.6e-3

# What one newton at the middle of a beam with clamped ends does there.
BEND = LENGTH**3 / (192 * SECTION.EI) + LENGTH / (4 * SECTION.kGA)
STRETCH = LENGTH / (4 * SECTION.EA)
TILT = LENGTH / (16 * SECTION.EI)
TWIST = LENGTH / (4 * SECTION.GJ)
# Of friction across the upper beam: that bends sideways and twists, the lower one is stretched and tilted.
ACROSS = BEND + RADIUS**2 * TWIST + STRETCH + RADIUS**2 * TILT


def beams(**changes):
    return Beams(**({"length": LENGTH, "friction": FRICTION, "gap": 0.0} | changes))


def pressed(normal):
    """Force of two beams whose ends come nearer by PRESS, from their compliance and that of the contact."""
    approach = lambda force: 2 * BEND * force + (force / normal.coefficient) ** (1 / normal.exponent)  # noqa: E731
    return brentq(lambda force: approach(force) - PRESS, 0, PRESS / (2 * BEND))


@pytest.mark.parametrize(
    ("name", "normal"),
    {
        "stiff penalty": LAWS["rigid"],
        "penalty as soft as the beams": Power(1 / (2 * BEND)),
        "Hertz": LAWS["hertz"],
    }.items(),
)
def test_force_of_pressed_beams(name, normal, verify):
    case = beams(normal=normal)
    _, increments = case.trace([[0, 0, -PRESS]])
    verify.within(
        f"crossing beams pressed: force, {name}",
        -case.contact_force(increments[-1])[2],
        pressed(normal),
        0.01,
    )


@pytest.mark.parametrize("law", LAWS)
def test_crossing_yarns_of_round_section_follow_the_law(law, verify):
    """Two undeformed beams that overlap."""
    case = beams(law=law)
    model = case.model()
    depth = 0.01 * RADIUS
    step = np.zeros((model.size // 6, 6))
    step[len(step) // 2 :, 2] = -depth
    state = model.advance(model.start(), step.ravel())
    force = model.respond(state, False).force.reshape(-1, 2, 3)[: case.elements + 1, 0, 2].sum()
    hertz = 4 / 3 * MODULUS / (2 * (1 - POISSON**2)) * np.sqrt(RADIUS) * depth**1.5
    expected = {"rigid": 10 * MODULUS * RADIUS * depth, "hertz": hertz}
    verify.within(f"crossing beams, undeformed: force, {law}", force, expected[law], 0.01)


@pytest.mark.parametrize("law", LAWS)
def test_yarns_that_touch_twice_carry_both_forces(law, verify):
    """A hairpin over a straight yarn, pressed by delta, sinks in at both crossings, of which one was known."""
    model, depth = hairpin(law, 0.0), 0.05 * RADIUS
    state, upper = model.begin(model.start(), 0.0, 1.0), model.contact.curves.first[1]
    step = np.zeros((model.size // 6, 6))
    step[upper:, 2] = -depth
    state = model.advance(state, step.ravel())
    force = model.respond(state, False).force.reshape(-1, 6)[:upper, 2].sum()
    verify.within(f"hairpin on a yarn: force, {law}", force, 2 * LAWS[law].force(np.array(-depth)), BOUNDED)
    # The pairs stay, and no point is counted twice.
    again = model.begin(model.commit(state), 0.0, 1.0).contact
    np.testing.assert_allclose(
        again.force, state.contact.force + LAWS[law].force(np.array(-depth)), rtol=BOUNDED
    )
    parted = again.pairs.bounds[1, :, 0] - again.pairs.bounds[0, :, 1]
    assert parted.max() >= STRIP * RADIUS


@pytest.mark.parametrize("law", LAWS)
def test_yarns_do_not_pass_through_each_other(law):
    """Farther than their axes, the force still drives them back."""
    case = beams(law=law)
    model, step = case.model(), np.zeros((2 * (case.elements + 1), 6))
    step[case.elements + 1 :, 2] = -3 * RADIUS
    state = model.advance(model.start(), step.ravel())
    assert model.contact.points(state).gap == pytest.approx(-3 * RADIUS)
    force = model.respond(state, False).force.reshape(-1, 6)[: case.elements + 1, 2].sum()
    assert force == pytest.approx(LAWS[law].force(np.array(-3 * RADIUS)), BOUNDED)


def at(increments, load):
    return next(each for each in increments if abs(each.load - load) < 1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_friction_and_slip_of_dragged_beams(law, verify):
    """Pressed, dragged along the lower beam and back as far beyond.

    Slip is the way of the ends less what the beams give way, forwards; twice that and what they give way anew, back.
    """
    legs = [[0, 0, -PRESS], [DRAG, 0, -PRESS], [-DRAG, 0, -PRESS]]
    case = beams(law=law)
    _, increments = case.trace(legs, increments=30)
    ends = [at(increments, load) for load in (2 / 3, 1.0)]
    forwards, backwards = (case.contact_force(each) for each in ends)
    there, all_the_way = (case.slip(each) for each in ends)
    way = DRAG - FRICTION * pressed(LAWS["rigid"]) * ACROSS
    name = "crossing beams dragged"
    verify.within(f"{name}: friction over force, {law}", -forwards[0] / forwards[2], FRICTION, 0.01)
    verify.within(f"{name} back: friction over force, {law}", backwards[0] / backwards[2], FRICTION, 0.01)
    verify.within(f"{name}: slip, {law}", there, way, 0.01)
    verify.within(f"{name} back: slip, {law}", all_the_way - there, 2 * way, 0.01)


@pytest.mark.parametrize("law", LAWS)
def test_work_of_dragged_beams(law, verify):
    """The work at the ends is stored or lost to friction; where slip begins, its trapezoid takes many increments."""
    case = beams(law=law)
    _, increments = case.trace([[0, 0, -PRESS], [DRAG, 0, -PRESS]], increments=100)
    nodes = case.ends(1)
    force = np.array([each.response.force.reshape(-1, 6)[nodes, :3].sum(axis=0) for each in increments])
    place = np.array([each.state.position[nodes[0]] for each in increments])
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(place, axis=0))
    energy = sum(increments[-1].response.energy.get(form, 0.0) for form in FORMS)
    verify.within(f"crossing beams dragged: energy, {law}", energy, work, 0.01)


@pytest.mark.parametrize("law", LAWS)
def test_beams_stick_before_they_slip(law, verify):
    """Half of the way to slip is elastic, of beams and of the patch where they touch, and goes back to nothing.

    The patch of two cylinders that cross at a right angle gives way by (2 - nu) / (4 a G) [m/N], a its radius (Johnson
    1985, section 7.2); a penalty by one over its stiffness.
    """
    case, force = beams(law=law), pressed(LAWS[law])
    depth = (force / LAWS[law].coefficient) ** (1 / LAWS[law].exponent)
    mindlin = (2 - POISSON) * (1 + POISSON) / (2 * np.sqrt(RADIUS * depth) * MODULUS)
    give = ACROSS + {"rigid": depth / force, "hertz": mindlin}[law]
    half = 0.5 * FRICTION * force * give
    _, increments = case.trace([[0, 0, -PRESS], [half, 0, -PRESS], [0, 0, -PRESS]], increments=9)
    friction = case.contact_force(at(increments, 2 / 3))[0]
    verify.within(f"crossing beams dragged half way to slip: friction, {law}", friction, half / give, 0.01)
    assert case.slip(increments[-1]) == 0
    assert abs(case.contact_force(increments[-1])[0]) < 1e-3 * friction


def test_spin_in_place_slips(verify):
    """The surface of a yarn that turns about its axis slips by R times the angle."""
    case, angle = beams(), DRAG / RADIUS
    _, increments = case.trace([[0, 0, -PRESS], [0, 0, -PRESS]], increments=20, spins=[0.0, angle])
    force = case.contact_force(increments[-1])
    verify.within("crossing beams, one spun: friction over force", force[0] / force[2], FRICTION, 0.01)
    give = FRICTION * pressed(LAWS["rigid"]) * ACROSS
    verify.within("crossing beams, one spun: slip", case.slip(increments[-1]), RADIUS * angle - give, 0.01)


def test_rolling_does_not_slip(verify):
    """A yarn that moves by R times the angle of its spin rolls: what is left of friction is second order."""
    case, angle = beams(), DRAG / RADIUS
    _, increments = case.trace([[0, 0, -PRESS], [DRAG, 0, -PRESS]], increments=20, spins=[0.0, angle])
    force = case.contact_force(increments[-1])
    verify.at_most(
        "crossing beams, one rolled: friction over mu N", abs(force[0] / force[2]) / FRICTION, 0.05
    )
    assert case.slip(increments[-1]) < 1e-3 * DRAG


@pytest.mark.parametrize("law", LAWS)
def test_beams_that_roll_over_their_tie_touch_beside_it(law, verify):
    """The upper beam, undeformed, turns by theta over the lower one, about the point where their surfaces are tied.

    They overlap by R (1 - cos theta), R sin theta away from the tie along the upper beam, and touch where that is more
    than the tie carries. The couple about the tie is the derivative of the energy with respect to theta.
    """
    carried, angle = 0.03 * RADIUS, 0.35
    case = beams(law=law, friction=0.0, carried=carried)
    model, sums = case.model(), []
    for theta in (angle, -angle, 0.2):
        turn, state = exp(np.array([theta, 0, 0])), model.start()
        half = len(state.position) // 2
        position, rotation = state.position.copy(), state.rotation.copy()
        position[half:], rotation[half:] = position[half:] @ turn.T, turn
        state = replace(state, position=position, rotation=rotation)
        force = model.respond(state, False).force.reshape(-1, 6) - without_contact(model, state)
        lever = np.cross(position, force[:, :3]) + force[:, 3:]
        sums.append([force[half:, :3].sum(axis=0), lever[half:].sum(axis=0)])
        assert np.abs(force[:, :3].sum(axis=0)).max() <= 1e-12 * np.abs(force).sum()
    (there, couple), (back, couple_back), (none, _) = sums
    normal = LAWS[law].force(carried - RADIUS * (1 - np.cos([angle])))[0]
    name = f"tied beams, one rolled: {{}}, {law}"
    verify.within(name.format("force"), np.linalg.norm(there), normal, 1e-3)
    verify.within(name.format("couple about the tie"), abs(couple[0]), normal * RADIUS * np.sin(angle), 1e-3)
    np.testing.assert_allclose(back, there * [1, -1, 1], atol=1e-9 * normal)
    np.testing.assert_allclose(couple_back, -couple, atol=1e-9 * normal * RADIUS)
    assert np.all(none == 0)  # the overlap is what the tie carries


def without_contact(model, state):
    """Forces and moments (N, 6) of the beams alone."""
    alone = copy(model)
    alone.contact = None
    return alone.respond(state, False).force.reshape(-1, 6)
