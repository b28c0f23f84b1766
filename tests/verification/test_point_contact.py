"""Contact of beams at closest points against theories that are not its own: Hertz, Mindlin, Deresiewicz, Coulomb."""

import numpy as np
import pytest
from crossing_beams import MODULUS, POISSON, RADIUS
from rigid_yarns import LAW, Yarns, path
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from knitstudy.mechanics.rotation import exp

DEPTH = 0.05  # over R
SHEAR = MODULUS / (2 * (1 + POISSON))


def surface(x, y, k):
    """Height over R of the upper side of a yarn along x that bends upwards with kR = k, over the plane it touches."""
    # Of a torus: the distance from its circle of radius 1 / k about (0, 1 / k) in the plane of x and z is 1.
    if k == 0:
        return np.sqrt(1 - y**2) - 1
    inner = 1 / k - np.sqrt(1 - y**2)
    return 1 / k - np.sign(k) * np.sqrt(inner**2 - x**2) - 1


def curvatures(angle, bends, step=1e-3):
    """Principal values (2,) of the second derivatives of the gap of both surfaces, times R, and their axes."""

    def gap(x, y):
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        return -surface(x, y, bends[0]) - surface(c * x + s * y, c * y - s * x, bends[1])

    i, j = step * np.eye(2)
    second = [
        [(gap(*(a + b)) - gap(*(a - b)) - gap(*(b - a)) + gap(*(-a - b))) / (4 * step**2) for a in (i, j)]
        for b in (i, j)
    ]
    return np.linalg.eigh(second)


def hertz_ellipse(flat, steep, depth):
    """Force and semi-axes of bodies whose gap is (flat x^2 + steep y^2) / 2 (Johnson 1985, section 4.2)."""

    def integrals(m):  # of the squared eccentricity
        return ellipk(m), ellipe(m), (1 - m) ** 0.5

    def misfit(m):
        K, E, ratio = integrals(m)
        return (E / ratio**2 - K) / (K - E) - steep / flat

    m = brentq(misfit, 1e-9, 1 - 1e-9) if steep / flat > 1 + 1e-6 else 1e-9
    K, E, ratio = integrals(m)
    modulus = MODULUS / (2 * (1 - POISSON**2))
    # With p0 the largest pressure: A = flat / 2 = p0 b (K - E) / (E* m a^2), delta = p0 b K / E*, F = 2/3 pi p0 a b
    a = np.sqrt(2 * depth * (K - E) / (K * m * flat))
    return 2 / 3 * np.pi * modulus * depth * a / K, a, ratio * a


def stick_stiffness(a, b):
    """Force over slip (2,), along a and along b, of two half spaces that stick over an ellipse (Mindlin 1949).

    The traction is Q / 2 pi a b (1 - x^2/a^2 - y^2/b^2)^(-1/2), which moves the middle
    by int q ((1 - nu) / r + nu x^2 / r^3) / 2 pi G.
    """
    turn = np.linspace(0, np.pi, 4001)[:-1]
    reach = a * b / np.sqrt((b * np.cos(turn)) ** 2 + (a * np.sin(turn)) ** 2)
    found = []
    for along in (np.cos(turn) ** 2, np.sin(turn) ** 2):
        mean = np.mean(np.pi / 2 * reach * (1 - POISSON + POISSON * along))
        found.append(2 * np.pi * a * b * SHEAR / (2 * mean))
    return np.array(found)


SHAPES = [(angle, (0.0, 0.0)) for angle in (90, 60, 45, 30, 20)]
SHAPES += [(90, (k, k)) for k in (0.1, 0.2, 0.3, 0.4, 0.45)] + [
    (90, (0.45, 0.2)),
    (70, (0.25, 0.25)),
    (60, (0.3, -0.2)),
]


@pytest.mark.parametrize(("angle", "bends"), SHAPES)
def test_pressed_and_sheared_yarns_of_any_shape(angle, bends, verify):
    """Rigid but for what Hertz's patch gives way: force, and stiffness along and across an elliptic patch."""
    yarns = Yarns(angle, bends, count=193)
    (flat, steep), axes = curvatures(angle, bends)
    force, a, b = hertz_ellipse(flat / RADIUS, steep / RADIUS, DEPTH * RADIUS)
    name = f"rigid yarns at {angle} degrees, kR {bends}"
    *_, (push, _, _) = yarns.carried(path([0, 0, -DEPTH], steps=3))
    verify.within(f"{name}: force", -push[2], force, 0.03)
    for axis, stiff, way in zip(axes.T, stick_stiffness(a, b), ("along", "across"), strict=True):
        slip = 1e-4 * np.append(axis, 0)
        pressed = path([0, 0, -DEPTH], steps=3)
        *_, (pull, _, _) = yarns.carried(np.concatenate([pressed, pressed[-1:] + slip * RADIUS]))
        verify.within(f"{name}: stick {way}", pull[:2] @ axis / (1e-4 * RADIUS), stiff, 0.05)


@pytest.mark.parametrize("steps", [1, 4, 20])
@pytest.mark.parametrize("angle", [90, 40])
def test_yarns_sheared_as_they_are_pressed(steps, angle, verify):
    """Slip in proportion to the approach: as F ~ delta^1.5, int k du = k u / 1.5 (Mindlin and Deresiewicz 1953)."""
    yarns, way = Yarns(angle), np.array([0.02, 0.02, -DEPTH])
    *_, (there, points, _) = yarns.carried(path(way, steps=steps))
    stiffness = (
        points.rubs.spring[0] * points.rubs.frame.axes[0] @ points.rubs.shear[0] @ points.rubs.frame.axes[0].T
    )
    expected = stiffness @ (way * RADIUS) / 1.5
    error = np.linalg.norm(there[:2] - expected[:2]) / np.linalg.norm(expected)
    verify.at_most(f"rigid yarns at {angle} degrees, sheared as pressed in {steps}: traction", error, 1e-3)


def test_what_was_sheared_falls_as_yarns_are_released(verify):
    """Pressed, sheared, released: t falls with k; pressed again: t stays (Mindlin and Deresiewicz 1953)."""
    corners = [0, 0, -DEPTH], [0.002, 0, -DEPTH], [0.002, 0, -DEPTH / 4], [0.002, 0, -DEPTH]
    pulls = [pull[0] for pull, _, _ in Yarns().carried(path(*corners, steps=5))]
    verify.within("rigid yarns: traction after release to a quarter", pulls[14], pulls[9] / 2, 1e-6)
    verify.within("rigid yarns: traction after being pressed again", pulls[19], pulls[9] / 2, 1e-6)


@pytest.mark.parametrize("friction", [0.3, np.inf])
@pytest.mark.parametrize("seed", range(4))
def test_no_cycle_of_contact_does_work(friction, seed, verify):
    """Pressed, sheared, turned and opened in any order and back: friction loses energy in every increment."""
    random = np.random.default_rng(seed)
    corners = random.uniform([-0.02, -0.02, -0.08], [0.02, 0.02, 0.01], (8, 3))
    places = path([0, 0, -0.04], *corners, [0, 0, -0.04], steps=6)
    turns = 0.3 * np.interp(
        np.arange(len(places)), [0, 20, 40, len(places)], [0, *random.uniform(-1, 1, 2), 0]
    )
    rubbed = [0.0]
    for _, points, history in Yarns(60.0, (0.2, 0.1), friction).carried(places, turns[:, None] * [0, 0, 1]):
        assert points.rubs.lost[0] >= -1e-15 * LAW.energy(-0.08 * RADIUS)
        rubbed.append(history.rubbed)
    least = np.diff(rubbed).min() / rubbed[-1]
    verify.at_most(f"rigid yarns, cycle {seed}, mu {friction}: largest gain of energy", -least, 1e-12)


@pytest.mark.parametrize("angle", [90, 45, 20])
def test_friction_of_sliding_yarns(angle, verify):
    """Slid by R in 8 increments: force along the slip over that across is mu, without friction there is no drag."""
    slid = np.concatenate(
        [path([0, 0, -DEPTH], steps=2), path([0.7, 0.7, 0], steps=8) - [0, 0, DEPTH * RADIUS]]
    )
    for friction in (0.3, 0.0):
        *_, (pull, _, _) = Yarns(angle, friction=friction).carried(slid)
        ratio = pull[:2] @ [0.5**0.5, 0.5**0.5] / -pull[2]
        name = f"rigid yarns at {angle} degrees, slid: friction over force, less mu = {friction}"
        verify.at_most(name, abs(ratio - friction), 0.003)


def test_hooked_yarns_slide_without_lag(verify):
    """Curved yarns whose closest points are held: the direction of the force in 8 increments is that in 160."""
    ways = []
    for steps in (8, 160):
        slid = path([0.2, 0.2, 0], steps=steps) - [0, 0, DEPTH * RADIUS]
        *_, (pull, _, _) = Yarns(80, (0.3, 0.3), 0.0).carried(
            np.concatenate([path([0, 0, -DEPTH], steps=2), slid])
        )
        ways.append(pull / np.linalg.norm(pull))
    verify.at_most("hooked yarns slid in 8 increments: direction", np.linalg.norm(ways[0] - ways[1]), 0.003)


@pytest.mark.parametrize(("start", "steps", "bar"), [(90, 8, 0.005), (50, 8, 0.025), (50, 32, 0.01)])
def test_force_of_yarns_that_turn(start, steps, bar, verify):
    """Pressed, then turned against each other by 25 degrees: Hertz's force where they end.

    Of 2 % and 0.6 % at last, 0.5 % are the factor's smooth bound at 25 degrees: steps count with their square.
    """
    turns = np.radians(np.concatenate([[0, 0], np.linspace(0, 25, steps + 1)[1:]]))
    places = np.tile([0, 0, -DEPTH * RADIUS], (len(turns), 1))
    *_, (push, _, _) = Yarns(start, count=193).carried(places, -turns[:, None] * [0, 0, 1])
    (flat, steep), _ = curvatures(start - 25, (0, 0))
    force, *_ = hertz_ellipse(flat / RADIUS, steep / RADIUS, DEPTH * RADIUS)
    verify.within(
        f"rigid yarns turned from {start} degrees in {steps} increments: force", -push[2], force, bar
    )


@pytest.mark.parametrize("friction", [0.1, np.inf])
def test_friction_turns_with_everything(friction, verify):
    """Pressed and sheared, while everything is turned by 90 degrees in three increments more or not."""
    places = path([0, 0, -DEPTH], [0.004, 0.002, -DEPTH], [0.006, -0.002, -DEPTH], steps=3)
    whole = np.linspace(0, np.pi / 2, len(places) + 1)[1:, None] * np.array([2, -1, 2]) / 3
    *_, (still, _, _) = Yarns(50, (0.2, 0), friction).carried(places)

    *_, (turned, _, _) = Yarns(50, (0.2, 0), friction).carried(places, whole=whole)
    error = np.linalg.norm(turned - exp(whole[-1]) @ still) / np.linalg.norm(still)
    verify.at_most(f"rigid yarns, all turned, mu {friction}: force", error, 1e-9)
