"""Contact along yarns that repeat themselves: Hertz and Mindlin at angles and bends, tangent, cycles of load."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from crossing_beams import MODULUS, POISSON
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from scipy.special import ellipe, ellipk
from test_point_contact import curvatures, hertz_ellipse, surface

from knitstudy.mechanics.beam import Section
from knitstudy.mechanics.beam_contact import Power, hertz
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.contact.indentation import Crossing
from knitstudy.mechanics.endless_beams import ContactPoints, EndlessBeams
from knitstudy.mechanics.hertz import LAYERS, Patch
from knitstudy.mechanics.line_contact import LineContact, Repulsion
from knitstudy.mechanics.line_friction import LineHistory, PairFriction
from knitstudy.mechanics.periodic import Lattice
from knitstudy.mechanics.rotation import exp

D = 1.0
FAR_AWAY = 100 * np.eye(2, 3)


def straight(angle, apart, spacing=0.05, length=4.0):
    """Two straight yarns at an angle, and their points."""
    s = np.arange(-length / 2, length / 2, spacing) + 0.3 * spacing
    lower = s[:, None] * [1, 0, 0]
    upper = s[:, None] * [np.cos(angle), np.sin(angle), 0] + [0, 0, apart]
    return np.concatenate([lower, upper]), np.repeat([0, 1], len(s)), np.tile(s, 2)


def contact(yarn, s, exponent, friction=0.0, spacing=0.05):
    law = Repulsion(Power(3.0, exponent), D, onset=2 * spacing**2 / D)
    return LineContact(yarn, s, np.full(len(s), spacing), np.full(2, 100.0), law, friction, closed=False)


def forces(model, points, stiffness=False):
    state = BeamState(points, np.tile(np.eye(3), (len(points), 1, 1)))
    return model.respond(state, FAR_AWAY, np.zeros((2, 3, 3)), LineHistory.none(), stiffness)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.4])
@pytest.mark.parametrize("angle", [90, 50])
def test_crossed_yarns_carry_the_law_over_the_sine_of_their_angle(exponent, angle):
    points, yarn, s = straight(np.radians(angle), 0.8)
    found = forces(contact(yarn, s, exponent), points)[0][:-3].reshape(-1, 6)
    upper = -found[yarn == 1, :3].sum(axis=0)
    wanted = 3.0 * 0.2**exponent / np.sin(np.radians(angle))
    # Points 0.05 apart see a contact 0.6 long; the linear law ends in a jump of the pieces' force.
    np.testing.assert_allclose(upper, [0, 0, wanted], atol=(0.03 if exponent == 1 else 0.01) * wanted)
    np.testing.assert_allclose(found[:, :3].sum(axis=0), 0, atol=1e-12)


def test_parallel_yarns_carry_the_integral_of_the_potential():
    points, yarn, s = straight(0.0, 0.8)
    model = contact(yarn, s, 2.4)

    def energy(apart):
        inside = np.sqrt(model.repulsion.diameter**2 - apart**2)
        return quad(lambda t: model.repulsion.of(np.array([np.hypot(apart, t)]))[0][0], -inside, inside)[0]

    wanted = -(energy(0.801) - energy(0.799)) / 0.002
    middle = (yarn == 1) & (np.abs(s) < 0.5)
    found = -forces(model, points)[0][:-3].reshape(-1, 6)[middle, 2]
    np.testing.assert_allclose(found / 0.05, wanted, rtol=1e-3)


def two_rows(friction, ramps=False, per_node=1):
    """Two waved yarns across each other in a cell of 4 x 4, each touching the other and its image."""
    n, own = 40, 4.0
    s = np.arange(n) * own / n
    wave = 0.45 * np.cos(2 * np.pi * s / own)
    rows = [np.column_stack([s, 0.4 * np.sin(2 * np.pi * s / own) + 2 * k, (-1) ** k * wave]) for k in (0, 1)]
    position = np.concatenate(rows)
    owner = np.append(np.arange(2 * n), [0, n])
    image = np.zeros((2 * n + 2, 2), dtype=int)
    image[-2:, 0] = 1
    lattice = Lattice(np.array([[own, 0, 0], [0, 2.6, 0]]))
    nodes = position[owner] + image @ lattice.vectors
    ends = np.concatenate(
        [np.column_stack([np.arange(n), np.append(np.arange(1, n), -1)]) + k * n for k in (0, 1)]
    )
    ends[n - 1, 1], ends[-1, 1] = 2 * n, 2 * n + 1
    natural = np.random.default_rng(3).standard_normal((2 * n, 3)) * 0.1
    inner = BeamModel(nodes, ends, Section(50.0, 20.0, 1.0, 0.7), D / 2, natural=natural)
    yarn = np.repeat([0, 1], n)
    law = Repulsion(Power(3.0, 1.5), D, 0.02)
    points = ContactPoints.of(yarn, per_node)
    s = np.tile(s, 2)[points.node] + points.place * own / n
    weight = np.full(len(s), own / n / per_node)
    model = LineContact(yarn[points.node], s, weight, np.full(2, own), law, friction, 1.6)
    return EndlessBeams(inner, owner, image, lattice, model, points, ramps=ramps)


def disturbed(model, size=0.01, seed=0):
    """A state with contact that slides at some pairs and sticks at others."""
    rng = np.random.default_rng(seed)
    state = model.advance(model.start(), size * rng.standard_normal(model.size))
    state = model.commit(model.commit(state))
    return model.advance(state, 1.5 * size * rng.standard_normal(model.size))


@pytest.mark.parametrize("patch", [LAYERS, Patch(0.3)], ids=["layers", "half spaces"])
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_tangent_is_the_derivative(friction, patch):
    model = two_rows(friction, per_node=2)
    model.contact.repulsion = replace(model.contact.repulsion, patch=patch)
    state = disturbed(model)
    tangent = model.respond(state, stiffness=True).stiffness.toarray()
    contact = model.contact
    points = model.at_points(state)
    pairs = contact.pairs(points, model.vectors(state))
    rubs = PairFriction.of(contact, points, pairs, state.contact)
    assert len(pairs.i) > 50
    assert friction == 0 or 0 < rubs.slides.mean() < 1
    assert friction == 0 or 0 < (rubs.rate != 0).mean() < 1  # some close
    way, h = np.random.default_rng(1).standard_normal(model.size), 1e-6
    ahead, behind = (model.respond(model.advance(state, sign * h * way), False).force for sign in (1, -1))
    wanted = (ahead - behind) / (2 * h)
    # Central differences of contact that begins softly within 0.02
    np.testing.assert_allclose(tangent @ way, wanted, atol=5e-6 * np.abs(wanted).max())


def test_an_image_is_the_yarn_itself():
    """A cell of two periods has twice the energy and the same force at every node."""
    model = two_rows(0.0)
    state = disturbed(model)
    found = model.respond(state, False)
    shift = model.vectors(state)[0]
    position, n = state.beams.position, 40
    twice = np.concatenate([position[:n], position[:n] + shift, position[n:], position[n:] + shift])
    s = np.concatenate([np.arange(2 * n) * 0.1, np.arange(2 * n) * 0.1])
    own = replace_contact(
        model.contact, yarn=np.repeat([0, 1], 2 * n), arc_length=s, weight=np.full(4 * n, 0.1)
    )
    own.period = np.full(2, 8.0)
    vectors = np.array([2 * shift, model.vectors(state)[1]])
    beams = BeamState(twice, np.tile(np.eye(3), (4 * n, 1, 1)))
    force, energy, _ = own.respond(beams, vectors, model.moves, LineHistory.none(), False)
    one, whole, _ = model.contact.respond(
        state.beams, model.vectors(state), model.moves, state.contact, False
    )
    assert energy["penalty"] == pytest.approx(2 * whole["penalty"])
    np.testing.assert_allclose(force[: 6 * n], one[: 6 * n], atol=1e-12 * np.abs(one).max())
    assert found.energy["internal"] > 0


def replace_contact(contact, **changes):
    return LineContact(
        **{
            "yarn": contact.yarn,
            "arc_length": contact.arc_length,
            "weight": contact.weight,
            "period": contact.period,
            "repulsion": contact.repulsion,
            "friction": contact.friction,
            "beside": contact.beside,
        }
        | changes
    )


@pytest.mark.parametrize("way", [[1, 0, 0], [0, 1, 0], [0.6, 0.8, 0]])
def test_crossed_yarns_slide_at_mu_times_their_force_and_store_what_is_not_dissipated(way):
    points, yarn, s = straight(np.pi / 2, 0.85)
    model, mu = contact(yarn, s, 2.0, friction=0.3), 0.3
    turn, history, work, before = np.tile(np.eye(3), (len(yarn), 1, 1)), LineHistory.none(), 0.0, 0.0
    for step in np.linspace(0, 0.1, 41):
        moved = BeamState(points + step * (yarn == 1)[:, None] * np.array(way), turn)
        force, energy, _ = model.respond(moved, FAR_AWAY, np.zeros((2, 3, 3)), history, False)
        history = model.commit(moved, FAR_AWAY, history)
        pull = force[:-3].reshape(-1, 6)[yarn == 1, :3].sum(axis=0)
        work += 0.5 * (pull @ way + before) * 0.0025
        before = pull @ way
    normal = 3.0 * 0.15**2
    assert pull @ way == pytest.approx(mu * normal, rel=0.02)
    # Pairs that come within reach while yarns slide begin without friction: 2 % of the force
    moments = force[:-3].reshape(-1, 6)[:, 3:] + np.cross(moved.position, force[:-3].reshape(-1, 6)[:, :3])
    np.testing.assert_allclose(moments.sum(axis=0), 0, atol=0.02 * mu * normal)
    stored = energy["penalty"] - normal * 0.15 / 3  # of elastic slip: that of the approach is that of the law
    assert energy["friction"] == pytest.approx(work - stored, rel=0.01)


def test_natural_curvature_grows_with_the_load():
    model = two_rows(0.0, ramps=True)
    state, alone = model.start(), model.inner
    at = [
        alone.respond(model._all(model.begin(state, load, 0.5)), False).energy["internal"]
        for load in (0, 0.5, 1)
    ]
    bend = alone.elements.natural
    along = np.einsum("ei,ei->e", bend, alone.elements.axis)
    wanted = 0.5 * alone.elements.length @ ((bend**2).sum(axis=1) - 0.3 * along**2)
    np.testing.assert_allclose(at, [0, wanted / 4, wanted], atol=1e-12)


@pytest.mark.parametrize("exponent", [1.5, 2.4])
@pytest.mark.parametrize("angle", [90, 50])
@pytest.mark.parametrize("steps", [2, 8])
def test_yarns_that_slide_while_they_are_pressed_are_sheared_as_mindlin_says(exponent, angle, steps):
    """Q = int k_T du with k_T = share dF/d(delta): for slip in proportion to the approach, share K u / exponent."""
    spacing, share, deep, slide = 0.025, 0.7, 0.15, 0.03
    points, yarn, s = straight(np.radians(angle), 1.0, spacing)
    law = Repulsion(Power(3.0, exponent, share), D, onset=2 * spacing**2 / D)
    model = LineContact(yarn, s, np.full(len(s), spacing), np.full(2, 100.0), law, 100.0, closed=False)
    turn, history = np.tile(np.eye(3), (len(yarn), 1, 1)), LineHistory.none()
    for load in np.linspace(0, 1, steps + 1):
        move = load * (yarn == 1)[:, None] * np.array([slide, 0, -deep])
        state = BeamState(points + move, turn)
        force = model.respond(state, FAR_AWAY, np.zeros((2, 3, 3)), history, False)[0]
        history = model.commit(state, FAR_AWAY, history)
    pull, _, push = force[:-3].reshape(-1, 6)[yarn == 1, :3].sum(axis=0) * [1, 1, -1]
    stiffness = share * exponent * push / deep
    # Points resolve the approach from 0.01 on
    spring = history.spring[history.distance < D].sum()
    assert share * spring == pytest.approx(stiffness, rel=0.02)
    # In two steps pieces close up to 0.1 D later than a parabola says
    assert pull == pytest.approx(stiffness * slide / exponent, rel=0.08 if steps == 2 else 0.04)


NU, DEEP = 0.42, 0.0025  # Poisson's ratio, approach over the diameter: a patch of 0.07 R


def pair(bend=0.0, angle=90.0, spacing=0.025, friction=0.0, deep=DEEP):
    """Two yarns of half spaces, pressed by `deep`, which bend towards each other with kR = `bend`."""
    k, half = 2 * bend / D, 0.6 if bend or angle > 44 else 1.2
    s = np.arange(-half, half, spacing) + 0.3 * spacing
    lower = np.column_stack([np.sin(k * s) / k, 0 * s, (1 - np.cos(k * s)) / k] if k else [s, 0 * s, 0 * s])
    c, n = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    upper = lower @ np.array([[c, n, 0], [-n, c, 0], [0, 0, -1.0]]) + [0, 0, D - deep]
    law = Repulsion(hertz(1.0, NU, D / 2), D, 2 * spacing**2 / D, Patch(NU))
    yarn, weight = np.repeat([0, 1], len(s)), np.full(2 * len(s), spacing)
    model = LineContact(yarn, np.tile(s, 2), weight, np.full(2, 100.0), law, friction, closed=False)
    return model, np.concatenate([lower, upper]), yarn


def pressed(deep, bend, angle):
    """Force that presses them, the mean of four ways in which points may lie."""
    total = 0.0
    for a, b in ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)):
        model, points, yarn = pair(bend, angle, deep=deep)
        # Points move along their yarns; those of the upper one are rotated ones of the lower one.
        shifted = pair_points(model, points, yarn, a, b)
        total -= forces(model, shifted)[0][:-3].reshape(-1, 6)[yarn == 1, 2].sum()
    return total / 4


def pair_points(model, points, yarn, a, b):
    """The same yarns with their points shifted by shares of the spacing."""
    moved = points.copy()
    for number, share in ((0, a), (1, b)):
        mine = points[yarn == number]
        s = np.arange(len(mine))
        moved[yarn == number] = CubicSpline(s, mine)(s + share)
    return moved


def hertzian(bend, angle, deep=DEEP):
    """Force of cylinders at an angle (elliptic integrals of `Crossing`) or of equal hooked ones (Hertz's circle)."""
    modulus = 1 / (2 * (1 - NU**2))
    if bend:
        return 4 / 3 * modulus * np.sqrt(D / 2 * (1 - bend) / (1 - 2 * bend)) * deep**1.5
    R = D / 2
    return modulus * R**2 * (deep / R / Crossing.at(np.radians(angle)).approach) ** 1.5


@pytest.mark.parametrize("angle", [90, 60, 45, 30, 20])
def test_straight_yarns_carry_what_elliptic_hertz_says(angle):
    assert pressed(DEEP, 0.0, angle) == pytest.approx(hertzian(0.0, angle), rel=0.03)


@pytest.mark.parametrize("bend", [0.1, 0.2, 0.3, 0.4, 0.45])
def test_hooked_yarns_carry_what_hertz_says_of_their_surfaces(bend):
    assert pressed(DEEP, bend, 90) == pytest.approx(hertzian(bend, 90), rel=0.03)


@pytest.mark.parametrize(("angle", "bend"), [(60, 0.1), (60, 0.2), (75, 0.35), (45, 0.1), (30, 0.06)])
def test_bent_yarns_at_an_angle_carry_what_elliptic_hertz_says_of_their_surfaces(angle, bend):
    """The ellipse follows from the curvatures of two tori, by differences of their heights."""
    (flat, steep), _ = curvatures(angle, (bend, bend))
    wanted = hertz_ellipse(flat, steep, 2 * DEEP)[0] / MODULUS * (1 - POISSON**2) / (1 - NU**2) * (D / 2) ** 2
    assert pressed(DEEP, bend, angle) == pytest.approx(wanted, rel=0.035)


@pytest.mark.parametrize(
    ("angle", "bend", "deep", "bar"),
    [
        (90, 0.0, 0.05, 0.01),
        (45, 0.0, 0.05, 0.01),
        (90, 0.2, 0.01, 0.01),
        (90, 0.45, 0.01, 0.04),
        (60, 0.2, 0.01, 0.015),
        (90, 0.2, 0.05, 0.03),
        (90, 0.3, 0.05, 0.05),
        (60, 0.2, 0.05, 0.05),
    ],
)
def test_layers_carry_the_pressure_of_their_overlap(angle, bend, deep, bar):
    """Sum of p = C u^1.9 over the overlap u of two tori along their common normal, over that of straight ones at 90."""

    def summed(angle, bend):
        x = np.linspace(-0.98, 0.98, 800)
        x, y = np.meshgrid(x, x, indexing="ij")
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        with np.errstate(invalid="ignore"):
            gap = -surface(x, y, bend) - surface(c * x + s * y, c * y - s * x, bend)
        return np.sum(np.nan_to_num(np.maximum(2 * deep - gap, 0.0)) ** 1.9)

    def carried(angle, bend):
        model, points, yarn = pair(bend, angle, deep=deep)
        model.repulsion = Repulsion(Power(1.0, 2.9), D, model.repulsion.onset)
        return -forces(model, points)[0][:-3].reshape(-1, 6)[yarn == 1, 2].sum()

    wanted = summed(angle, bend) / summed(90, 0.0)
    assert carried(angle, bend) / carried(90, 0.0) == pytest.approx(wanted, rel=bar)


def sheared(bend, angle, way, size=1e-5):
    """Stiffness of stuck yarns along a way."""
    model, points, yarn = pair(bend, angle, 0.0125, friction=1e3)
    turn = np.tile(np.eye(3), (len(yarn), 1, 1))
    history = model.commit(BeamState(points, turn), FAR_AWAY, LineHistory.none())
    pull = np.zeros(2)  # with friction and without it: hooked yarns resist a way by their shape as well
    for sign in (1, -1):
        state = BeamState(points + sign * size * (yarn == 1)[:, None] * np.append(way, 0.0), turn)
        for row, past in enumerate((history, LineHistory.none())):
            force = model.respond(state, FAR_AWAY, np.zeros((2, 3, 3)), past, False)[0]
            pull[row] += sign * force[:-3].reshape(-1, 6)[yarn == 1, :2].sum(axis=0) @ way
    return (pull[0] - pull[1]) / (2 * size)


@pytest.mark.parametrize(
    ("bend", "angle"), [(0, 90), (0, 60), (0, 45), (0, 30), (0, 20), (0.1, 90), (0.3, 90), (0.45, 90)]
)
@pytest.mark.parametrize("side", ["along", "across"])
def test_yarns_that_stick_are_as_stiff_as_mindlin_says(bend, angle, side):
    """Mindlin 1949, of an ellipse of semi-axes b < a: compliances over that of an approach, 1 + nu B / (1 - nu) K."""
    ratio = Crossing.at(np.radians(angle)).ratio if not bend else 1.0
    m = 1 - ratio**2
    K, E = ellipk(m), ellipe(m)
    B = (K - E) / m if m > 1e-6 else np.pi / 4
    part = B if side == "along" else K - B
    share = (1 - NU) * K / ((1 - NU) * K + NU * part)
    half = np.radians(angle) / 2 + (0 if side == "along" else np.pi / 2)
    wanted = share * 1.5 * hertzian(bend, angle) / DEEP
    assert sheared(bend, angle, np.array([np.cos(half), np.sin(half)])) == pytest.approx(wanted, rel=0.05)


@pytest.mark.parametrize("friction", [0.2, 1e3])
@pytest.mark.parametrize("seed", range(5))
def test_no_cycle_of_pressing_and_shearing_gives_work_back(seed, friction):
    """Work of shearing in whatever order of loads that ends where it began; every increment loses energy."""
    model, points, yarn = pair(0.15, 60, spacing=0.05, friction=friction, deep=0.0)
    turn, rng = np.tile(np.eye(3), (len(yarn), 1, 1)), np.random.default_rng(seed)
    corners = np.column_stack([rng.uniform(-0.01, 0.01, (8, 2)), rng.uniform(-0.01, 0.04, 8)])
    corners = np.concatenate([[[0, 0, 0.01]], corners, [[0, 0, 0.01], [0, 0, -0.06]]])
    history, lost, work, before = LineHistory.none(), [], 0.0, None
    for one, other in pairwise(corners):
        for share in np.linspace(0, 1, 6)[1:]:
            at = one + share * (other - one)
            state = BeamState(points + (yarn == 1)[:, None] * (at * [1, 1, -1]), turn)
            force, energy, _ = model.respond(state, FAR_AWAY, np.zeros((2, 3, 3)), history, False)
            force -= model.respond(state, FAR_AWAY, np.zeros((2, 3, 3)), LineHistory.none(), False)[0]
            pull = force[:-3].reshape(-1, 6)[yarn == 1, :3].sum(axis=0)
            if before is not None:
                work += 0.5 * (pull + before[1]) @ ((at - before[0]) * [1, 1, -1])
            before = at, pull
            history = model.commit(state, FAR_AWAY, history)
            lost += [energy["friction"], history.dissipated]
    assert np.diff(lost).min() > -1e-12 * max(lost)
    assert lost[-1] > 0
    assert work == pytest.approx(lost[-1], rel=0.4)  # sums over five increments a leg
    assert history.stored.sum() == 0  # open at the end


def test_yarns_slide_bit_by_bit_as_cattaneo_and_mindlin_say():
    """T = mu F (1 - (1 - u / u_s)^1.5) with u_s = 1.5 mu F / K, Mindlin 1949 (Johnson 1985, section 7.2)."""
    deep, mu = 0.02, 0.3
    model, points, yarn = pair(friction=mu, deep=deep)
    turn, history = np.tile(np.eye(3), (len(yarn), 1, 1)), LineHistory.none()
    force = hertzian(0.0, 90, deep)
    end = 1.5 * mu * force / (2 * (1 - NU) / (2 - NU) * 1.5 * force / deep)
    for slip in np.linspace(0, 1.2, 13):
        state = BeamState(points + (yarn == 1)[:, None] * [slip * end, 0, 0], turn)
        found = model.respond(state, FAR_AWAY, np.zeros((2, 3, 3)), history, False)[0]
        history = model.commit(state, FAR_AWAY, history)
        pull = found[:-3].reshape(-1, 6)[yarn == 1, 0].sum()
        # Coulomb's limit follows the pressure of the potential, which is not quite Hertz's
        assert pull / (mu * force) == pytest.approx(1 - max(0.0, 1 - slip) ** 1.5, abs=0.02)


def test_traction_turns_with_the_yarns():
    model, points, yarn = pair(0.0, 60, friction=1e3)
    turn = np.tile(np.eye(3), (len(yarn), 1, 1))
    history = model.commit(BeamState(points, turn), FAR_AWAY, LineHistory.none())
    moved = points + (yarn == 1)[:, None] * [2e-4, 1e-4, 0]
    history = model.commit(BeamState(moved, turn), FAR_AWAY, history)
    still = model.respond(BeamState(moved, turn), FAR_AWAY, np.zeros((2, 3, 3)), history, False)[0]
    Q = exp(np.array([0.3, -0.5, 0.4]))
    turned, _, _ = model.respond(
        BeamState(moved @ Q.T, Q @ turn), FAR_AWAY, np.zeros((2, 3, 3)), history, False
    )
    one, other = (each[:-3].reshape(-1, 2, 3) for each in (still, turned))
    np.testing.assert_allclose(other, one @ Q.T, atol=1e-9 * np.abs(one).max())
