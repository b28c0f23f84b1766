"""Contact along yarns: Hertz and Mindlin at angles and bends, tangent, cycles of load."""

from itertools import pairwise

import numpy as np
import pytest
from half_spaces import curvatures, hertz, hertz_ellipse, stick_stiffness, surface
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from knitstudy.mechanics.beams.beam import BeamSection, BeamState, LineHistory
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.laws import Power, Repulsion
from knitstudy.mechanics.beams.line_contact import LineContact
from knitstudy.mechanics.cells.beams import EndlessBeams
from knitstudy.mechanics.cells.lattice import Lattice
from knitstudy.mechanics.core.rotation import exp

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
    return LineContact(yarn, s, np.full(len(s), spacing), law, friction)


def forces(model, points, stiffness=False):
    state = BeamState(points, np.tile(np.eye(3), (len(points), 1, 1)))
    return model.respond(state, FAR_AWAY, LineHistory.none(), stiffness)


@pytest.mark.parametrize("exponent", [1.5, 2.4])
@pytest.mark.parametrize("angle", [90, 50])
def test_crossed_yarns_carry_the_law_over_the_sine_of_their_angle(exponent, angle):
    points, yarn, s = straight(np.radians(angle), 0.8)
    actual = forces(contact(yarn, s, exponent), points)[0][:-6].reshape(-1, 6)
    upper = -actual[yarn == 1, :3].sum(axis=0)
    expected = 3.0 * 0.2**exponent / np.sin(np.radians(angle))
    # Points 0.05 apart see a contact 0.6 long.
    np.testing.assert_allclose(upper, [0, 0, expected], atol=0.01 * expected)
    np.testing.assert_allclose(actual[:, :3].sum(axis=0), 0, atol=1e-12)


def test_parallel_yarns_carry_the_integral_of_the_potential():
    points, yarn, s = straight(0.0, 0.8)
    model = contact(yarn, s, 2.4)

    def energy(apart):
        inside = np.sqrt(model.repulsion.diameter**2 - apart**2)
        return quad(lambda t: model.repulsion.of(np.array([np.hypot(apart, t)]))[0][0], -inside, inside)[0]

    expected = -(energy(0.801) - energy(0.799)) / 0.002
    middle = (yarn == 1) & (np.abs(s) < 0.5)
    actual = -forces(model, points)[0][:-6].reshape(-1, 6)[middle, 2]
    np.testing.assert_allclose(actual / 0.05, expected, rtol=1e-3)


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
    inner = BeamModel(nodes, ends, BeamSection(50.0, 20.0, 1.0, 0.7), D / 2, natural=natural)
    yarn = np.repeat([0, 1], n)
    law = Repulsion(Power(3.0, 1.5), D, 0.02)
    period = np.full(2, own)
    points = ContactPoints.of(yarn, np.tile(s, 2), per_node, period)
    model = LineContact(points.yarn, points.arc_length, points.weight, law, friction, 1.6, period)
    return EndlessBeams(inner, owner, image, lattice, model, points, ramps=ramps)


def disturbed(model, size=0.01, seed=0):
    """A state with contact that slides at some pairs and sticks at others."""
    rng = np.random.default_rng(seed)
    state = model.advance(model.start(), size * rng.standard_normal(model.size))
    state = model.commit(model.commit(state))
    return model.advance(state, 1.5 * size * rng.standard_normal(model.size))


def test_an_image_is_the_yarn_itself():
    """A cell of two periods has twice the energy and the same force at every node."""
    model = two_rows(0.0)
    state = disturbed(model)
    actual = model.respond(state, False)
    shift = model.vectors(state)[0]
    position, n = state.beams.position, 40
    twice = np.concatenate([position[:n], position[:n] + shift, position[n:], position[n:] + shift])
    s = np.concatenate([np.arange(2 * n) * 0.1, np.arange(2 * n) * 0.1])
    one = model.contact
    yarn = np.repeat([0, 1], 2 * n)
    weight = one.weight.reshape(2, 1, n).repeat(2, axis=1).ravel()
    own = LineContact(yarn, s, weight, one.repulsion, beside=one.search.beside, period=np.full(2, 8.0))
    vectors = np.array([2 * shift, model.vectors(state)[1]])
    beams = BeamState(twice, np.tile(np.eye(3), (4 * n, 1, 1)))
    force, energy, _ = own.respond(beams, vectors, LineHistory.none(), False)
    expected, whole, _ = one.respond(state.beams, model.vectors(state), state.contact, False)
    assert energy["penalty"] == pytest.approx(2 * whole["penalty"])
    np.testing.assert_allclose(force[: 6 * n], expected[: 6 * n], atol=1e-12 * np.abs(expected).max())
    assert actual.energy["internal"] > 0


def test_natural_curvature_grows_with_the_load():
    model = two_rows(0.0, ramps=True)
    state, alone = model.start(), model.inner
    at = [
        alone.respond(model._all(model.begin(state, load, 0.5)), False).energy["internal"]
        for load in (0, 0.45, 0.9)
    ]
    bend = alone.elements.natural
    along = np.einsum("ei,ei->e", bend, alone.elements.axis)
    expected = 0.5 * alone.elements.length @ ((bend**2).sum(axis=1) - 0.3 * along**2)
    np.testing.assert_allclose(at, [0, expected / 4, expected], atol=1e-12)


def walk(model, points, yarn, places, turns=None, history=None):
    """Yield the force (3,) that holds the upper yarn at every place (m, 3), forces on points, energies and history.

    `turns` (m, 3) turn the upper yarn about the crossing.
    """
    history, upper = history or LineHistory.none(), (yarn == 1)[:, None]
    for n, place in enumerate(places):
        turn = np.eye(3) if turns is None else exp(np.asarray(turns[n]))
        position = np.where(upper, points @ turn.T + place, points)
        state = BeamState(position, np.where(upper[..., None], turn, np.eye(3)))
        force, energy, _ = model.respond(state, FAR_AWAY, history, False)
        history = model.commit(state, FAR_AWAY, history)
        force = force[:-6].reshape(-1, 6)
        yield force[yarn == 1, :3].sum(axis=0), force, energy, history


def path(*corners, steps):
    """Places (m, 3) along straight legs from the first corner to the others, each in so many steps."""
    share = (np.arange(steps) + 1)[:, None] / steps
    legs = (one + share * np.subtract(other, one) for one, other in pairwise(corners))
    return np.concatenate([np.atleast_2d(corners[0]), *legs])


@pytest.mark.parametrize("exponent", [1.5, 2.0])
@pytest.mark.parametrize("way", [[1, 0, 0], [0, 1, 0], [0.6, 0.8, 0]])
def test_crossed_yarns_slide_at_mu_times_their_force_and_store_what_is_not_dissipated(way, exponent):
    points, yarn, s = straight(np.pi / 2, 0.85)
    model, mu = contact(yarn, s, exponent, friction=0.3), 0.3
    places = path([0, 0, 0], 0.1 * np.array(way), steps=40)
    steps = list(walk(model, points, yarn, places))
    _, force, energy, _ = steps[-1]
    along = np.array([each @ way for each, *_ in steps])
    normal = 3.0 * 0.15**exponent
    assert along[-1] == pytest.approx(mu * normal, rel=0.02)
    # Pairs that come within reach while yarns slide begin without friction: 2 % of the force
    moved = points + (yarn == 1)[:, None] * places[-1]
    moments = force[:, 3:] + np.cross(moved, force[:, :3])
    np.testing.assert_allclose(moments.sum(axis=0), 0, atol=0.02 * mu * normal)
    work = np.sum(along[1:] + along[:-1]) / 2 * 0.0025
    # Of elastic slip: that of the approach is that of the law
    stored = energy["penalty"] - normal * 0.15 / (exponent + 1)
    assert energy["friction"] == pytest.approx(work - stored, rel=0.01)


@pytest.mark.parametrize("exponent", [1.5, 2.4])
@pytest.mark.parametrize("angle", [90, 50])
@pytest.mark.parametrize("steps", [2, 8])
def test_yarns_that_slide_while_they_are_pressed_are_sheared_as_mindlin_says(exponent, angle, steps):
    """Q = int k_T du with k_T = share dF/d(delta): for slip in proportion to the approach, share K u / exponent."""
    spacing, share, deep, slide = 0.025, 0.7, 0.15, 0.03
    points, yarn, s = straight(np.radians(angle), 1.0, spacing)
    law = Repulsion(Power(3.0, exponent, share), D, onset=2 * spacing**2 / D)
    model = LineContact(yarn, s, np.full(len(s), spacing), law, 100.0)
    places = path([0, 0, 0], [slide, 0, -deep], steps=steps)
    *_, (force, _, _, history) = walk(model, points, yarn, places)
    pull, _, push = force * [1, 1, -1]
    stiffness = share * exponent * push / deep
    # Points resolve the approach from 0.01 on
    spring = history.spring[history.distance < D].sum()
    assert share * spring == pytest.approx(stiffness, rel=0.02)
    # In two steps pieces close up to 0.1 D later than a parabola says
    assert pull == pytest.approx(stiffness * slide / exponent, rel=0.08 if steps == 2 else 0.04)


NU, DEEP = 0.42, 0.0025  # Poisson's ratio, approach over the diameter: a patch of 0.07 R


def pair(bends=(0.0, 0.0), angle=90.0, spacing=0.025, friction=0.0, deep=DEEP, half=None):
    """Two yarns of half spaces, pressed by `deep`, which bend towards each other with kR = `bends`."""
    half = half or (0.6 if any(bends) or angle > 44 else 1.2)
    s = np.arange(-half, half, spacing) + 0.3 * spacing

    def bent(bend):
        k = 2 * bend / D
        return np.column_stack(
            [np.sin(k * s) / k, 0 * s, (1 - np.cos(k * s)) / k] if k else [s, 0 * s, 0 * s]
        )

    c, n = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    lower, upper = (bent(bend) for bend in bends)
    upper = upper @ np.array([[c, n, 0], [-n, c, 0], [0, 0, -1.0]]) + [0, 0, D - deep]
    law = Repulsion(hertz(1.0, NU, D / 2), D, 2 * spacing**2 / D)
    yarn, weight = np.repeat([0, 1], len(s)), np.full(2 * len(s), spacing)
    return LineContact(yarn, np.tile(s, 2), weight, law, friction), np.concatenate([lower, upper]), yarn


def pressed(deep, bends, angle):
    """Force that presses them, the mean of four ways in which points may lie."""
    total = 0.0
    for a, b in ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)):
        model, points, yarn = pair(bends, angle, deep=deep)
        # Points move along their yarns; those of the upper one are rotated ones of the lower one.
        shifted = pair_points(model, points, yarn, a, b)
        total -= forces(model, shifted)[0][:-6].reshape(-1, 6)[yarn == 1, 2].sum()
    return total / 4


def pair_points(model, points, yarn, a, b):
    """The same yarns with their points shifted by shares of the spacing."""
    moved = points.copy()
    for number, share in ((0, a), (1, b)):
        mine = points[yarn == number]
        s = np.arange(len(mine))
        moved[yarn == number] = CubicSpline(s, mine)(s + share)
    return moved


def hertzian(bends, angle, deep=DEEP):
    """Force, semi-axes and directions of the ellipse of two tori; curvatures are differences of their heights."""
    R, ((flat, steep), axes) = D / 2, curvatures(angle, bends)
    force, a, b = hertz_ellipse(flat / R, steep / R, deep, NU)
    return force, a, b, axes.T


SHAPES = [(angle, (0.0, 0.0)) for angle in (90, 60, 45, 30, 20)]
SHAPES += [(90, (k, k)) for k in (0.1, 0.2, 0.3, 0.4, 0.45)]
SHAPES += [(60, (0.1, 0.1)), (60, (0.2, 0.2)), (75, (0.35, 0.35)), (45, (0.1, 0.1)), (30, (0.06, 0.06))]
SHAPES += [(90, (0.45, 0.2)), (70, (0.25, 0.25)), (60, (0.3, -0.2))]


@pytest.mark.parametrize(("angle", "bends"), SHAPES)
def test_yarns_carry_what_elliptic_hertz_says_of_their_surfaces(angle, bends, verify):
    name = f"yarns at {angle} degrees, kR {bends}: force"
    verify.within(name, pressed(DEEP, bends, angle), hertzian(bends, angle)[0], 0.035)


LAYERS = [(90, 0.0, 0.05, 0.01), (45, 0.0, 0.05, 0.01), (90, 0.2, 0.01, 0.01), (90, 0.45, 0.01, 0.04)]
LAYERS += [(60, 0.2, 0.01, 0.015), (90, 0.2, 0.05, 0.03), (90, 0.3, 0.05, 0.05), (60, 0.2, 0.05, 0.05)]


@pytest.mark.parametrize(("angle", "bend", "deep", "bar"), LAYERS)
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
        model, points, yarn = pair((bend, bend), angle, deep=deep)
        model.repulsion = Repulsion(Power(1.0, 2.9), D, model.repulsion.onset)
        return -forces(model, points)[0][:-6].reshape(-1, 6)[yarn == 1, 2].sum()

    expected = summed(angle, bend) / summed(90, 0.0)
    assert carried(angle, bend) / carried(90, 0.0) == pytest.approx(expected, rel=bar)


def sheared(bends, angle, way, size=1e-5):
    """Stiffness of stuck yarns along a way."""
    model, points, yarn = pair(bends, angle, 0.0125, friction=1e3)
    turn = np.tile(np.eye(3), (len(yarn), 1, 1))
    history = model.commit(BeamState(points, turn), FAR_AWAY, LineHistory.none())
    pull = np.zeros(2)  # with friction and without it: hooked yarns resist a way by their shape as well
    for sign in (1, -1):
        state = BeamState(points + sign * size * (yarn == 1)[:, None] * np.append(way, 0.0), turn)
        for row, past in enumerate((history, LineHistory.none())):
            force = model.respond(state, FAR_AWAY, past, False)[0]
            pull[row] += sign * force[:-6].reshape(-1, 6)[yarn == 1, :2].sum(axis=0) @ way
    return (pull[0] - pull[1]) / (2 * size)


@pytest.mark.parametrize(("angle", "bends"), SHAPES)
def test_yarns_that_stick_are_as_stiff_as_mindlin_says(angle, bends, verify):
    """Mindlin 1949: an even slip of the ellipse, along and across it.

    At 0.45 / R the patch has 0.4 R, and pieces beside the closest points stick by 6 % too much.
    """
    bar = 0.05 if max(bends) < 0.45 or min(bends) < 0.45 else 0.065
    _, a, b, axes = hertzian(bends, angle)
    for way, axis, stiff in zip(("along", "across"), axes, stick_stiffness(a, b, NU), strict=True):
        name = f"yarns at {angle} degrees, kR {bends}: stick {way}"
        verify.within(name, sheared(bends, angle, axis), stiff, bar)


def rubbed(places, friction, **keys):
    """Return pulls (m, 3) of friction, without those of smooth yarns by their shape, and the steps of `walk`."""
    (model, points, yarn), (smooth, *_) = (pair(deep=0.0, friction=mu, **keys) for mu in (friction, 0.0))
    steps = list(walk(model, points, yarn, places))
    without = walk(smooth, points, yarn, places)
    return np.array([one[0] - other[0] for one, other in zip(steps, without, strict=True)]), steps


def test_what_was_sheared_falls_as_yarns_are_released(verify):
    """Pressed, sheared, released: t falls with k ~ delta^0.5; pressed again: t stays (Mindlin and Deresiewicz 1953)."""
    deep = 0.04
    corners = [0, 0, -deep], [1e-4, 0, -deep], [1e-4, 0, -deep / 4], [1e-4, 0, -deep]
    pulls = rubbed(path(*corners, steps=5), 1e3)[0][:, 0]
    verify.within("yarns released to a quarter: traction", pulls[10], pulls[5] / 2, 0.01)
    verify.within("yarns pressed again: traction", pulls[15], pulls[5] / 2, 0.01)


@pytest.mark.parametrize("angle", [90, 45, 20])
@pytest.mark.parametrize("way", [[1, 1, 0], [1, 0, 0], [1, 3, 0]])
def test_yarns_slide_by_a_radius_in_eight_increments(angle, way, verify):
    """Friction over the normal force is mu along the slip and nothing across, also off the axes of the patch."""
    way, deep = np.array(way) / np.linalg.norm(way), 0.025
    across = np.cross([0, 0, 1], way)
    for friction in (0.3, 0.0):
        model, points, yarn = pair(angle=angle, friction=friction, deep=0.0, half=2.4)
        places = path([0, 0, -deep], way * D / 2 - [0, 0, deep], steps=8)
        *_, (pull, *_) = walk(model, points, yarn, places)
        name = (
            f"yarns at {angle} degrees, slid along {way.round(2)}: friction over force, less mu = {friction}"
        )
        verify.at_most(name, abs(pull @ way / -pull[2] - friction), 0.003)
        verify.at_most(f"{name}, across", abs(pull @ across / pull[2]), 0.003)


def test_hooked_yarns_slide_without_lag(verify):
    """The direction of the force in 8 increments is that in 160."""
    ways = []
    for steps in (8, 160):
        model, points, yarn = pair((0.3, 0.3), 80, friction=0.3, deep=0.0)
        places = path([0, 0, -0.025], [0.1, 0.1, -0.025], steps=steps)
        *_, (pull, *_) = walk(model, points, yarn, places)
        ways.append(pull / np.linalg.norm(pull))
    verify.at_most("hooked yarns slid in 8 increments: direction", np.linalg.norm(ways[0] - ways[1]), 0.003)


def test_yarns_that_turn_while_they_stick_carry_what_hertz_says_where_they_end(verify):
    """Pressed at 50 degrees, then turned against each other to 25: friction pulls in the plane of contact alone."""
    deep = 0.025
    model, points, yarn = pair(angle=50, friction=1e3, deep=0.0, half=1.2)
    turns = -np.radians(np.linspace(0, 25, 9))[:, None] * [0, 0, 1]
    *_, (push, *_) = walk(model, points - (yarn == 1)[:, None] * [0, 0, deep], yarn, np.zeros((9, 3)), turns)
    verify.within("yarns turned from 50 to 25 degrees: force", -push[2], hertzian((0, 0), 25, deep)[0], 0.01)


@pytest.mark.parametrize("friction", [0.2, 1e3])
@pytest.mark.parametrize("seed", range(5))
def test_no_cycle_of_pressing_and_shearing_gives_work_back(seed, friction):
    """Work of shearing in whatever order of loads that ends where it began; every increment loses energy."""
    rng = np.random.default_rng(seed)
    corners = np.column_stack([rng.uniform(-0.01, 0.01, (8, 2)), rng.uniform(-0.04, 0.01, 8)])
    places = path([0, 0, -0.01], *corners, [0, 0, -0.01], [0, 0, 0.06], steps=5)
    pull, steps = rubbed(places, friction, bends=(0.15, 0.15), angle=60, spacing=0.05)
    lost = [each for _, _, energy, history in steps for each in (energy["friction"], history.dissipated)]
    work = 0.5 * np.sum((pull[1:] + pull[:-1]) * np.diff(places, axis=0))
    assert np.diff(lost).min() > -1e-12 * max(lost)
    assert lost[-1] > 0
    assert work == pytest.approx(lost[-1], rel=0.4)  # sums over five increments a leg
    assert steps[-1][-1].stored.sum() == 0  # open at the end


def test_yarns_slide_bit_by_bit_as_cattaneo_and_mindlin_say():
    """T = mu F (1 - (1 - u / u_s)^1.5) with u_s = 1.5 mu F / K, Mindlin 1949 (Johnson 1985, section 7.2)."""
    deep, mu = 0.02, 0.3
    model, points, yarn = pair(friction=mu, deep=deep)
    force = hertzian((0, 0), 90, deep)[0]
    end = 1.5 * mu * force / (2 * (1 - NU) / (2 - NU) * 1.5 * force / deep)
    slips = np.linspace(0, 1.2, 13)
    steps = walk(model, points, yarn, slips[:, None] * [end, 0, 0])
    for slip, (pull, *_) in zip(slips, steps, strict=True):
        # Coulomb's limit follows the pressure of the potential, which is not quite Hertz's
        assert pull[0] / (mu * force) == pytest.approx(1 - max(0.0, 1 - slip) ** 1.5, abs=0.02)
