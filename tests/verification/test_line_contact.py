"""Contact along yarns that repeat themselves: closed forms of crossed and parallel ones, tangent, balance, friction."""

import numpy as np
import pytest
from scipy.integrate import quad

from knitstudy.mechanics.beam import Section
from knitstudy.mechanics.beam_contact import Power
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.endless_beams import EndlessBeams
from knitstudy.mechanics.line_contact import LineContact, LineHistory, Repulsion
from knitstudy.mechanics.periodic import Lattice

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
    return LineContact(yarn, s, np.full(len(s), spacing), np.full(2, 100.0), law, friction)


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
        inside = np.sqrt(model.repulsion.reach**2 - apart**2)
        return quad(lambda t: model.repulsion.of(np.array([np.hypot(apart, t)]))[0][0], -inside, inside)[0]

    wanted = -(energy(0.801) - energy(0.799)) / 0.002
    middle = (yarn == 1) & (np.abs(s) < 0.5)
    found = -forces(model, points)[0][:-3].reshape(-1, 6)[middle, 2]
    np.testing.assert_allclose(found / 0.05, wanted, rtol=1e-3)


def two_rows(friction, ramps=False):
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
    model = LineContact(yarn, np.tile(s, 2), np.full(2 * n, own / n), np.full(2, own), law, friction, 1.6)
    return EndlessBeams(inner, owner, image, lattice, model, ramps=ramps)


def disturbed(model, size=0.01, seed=0):
    """A state with contact that slides at some pairs and sticks at others."""
    rng = np.random.default_rng(seed)
    state = model.advance(model.start(), size * rng.standard_normal(model.size))
    state = model.commit(model.commit(state))
    return model.advance(state, 1.5 * size * rng.standard_normal(model.size))


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_tangent_is_the_derivative(friction):
    model = two_rows(friction)
    state = disturbed(model)
    tangent = model.respond(state, stiffness=True).stiffness.toarray()
    contact = model.contact
    pairs = contact.pairs(state.beams, model.vectors(state))
    push = -contact.weight[pairs.i] * contact.weight[pairs.j] * contact.repulsion.of(pairs.distance)[1]
    change = -contact.weight[pairs.i] * contact.weight[pairs.j] * contact.repulsion.of(pairs.distance)[2]
    rubs = contact.rubbing(state.beams, pairs, push, change, state.contact)
    assert len(pairs.i) > 50
    assert friction == 0 or 0 < rubs.slides.mean() < 1
    way, h = np.random.default_rng(1).standard_normal(model.size), 1e-6
    ahead, behind = (model.respond(model.advance(state, sign * h * way), False).force for sign in (1, -1))
    wanted = (ahead - behind) / (2 * h)
    np.testing.assert_allclose(tangent @ way, wanted, atol=1e-6 * np.abs(wanted).max())


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
    tangent = np.where(yarn[:, None] == 0, [1.0, 0, 0], [0, 1.0, 0])
    turn, history, work, before = np.tile(np.eye(3), (len(yarn), 1, 1)), LineHistory.none(), 0.0, 0.0
    for step in np.linspace(0, 0.1, 41):
        moved = BeamState(points + step * (yarn == 1)[:, None] * np.array(way), turn)
        force, energy, _ = model.respond(moved, FAR_AWAY, np.zeros((2, 3, 3)), history, False)
        history = model.commit(moved, tangent, FAR_AWAY, history)
        pull = force[:-3].reshape(-1, 6)[yarn == 1, :3].sum(axis=0)
        work += 0.5 * (pull @ way + before) * 0.0025
        before = pull @ way
    normal = 3.0 * 0.15**2
    assert pull @ way == pytest.approx(mu * normal, rel=0.02)
    # Pairs that come within reach while yarns slide begin without friction: 2 % of the force
    moments = force[:-3].reshape(-1, 6)[:, 3:] + np.cross(moved.position, force[:-3].reshape(-1, 6)[:, :3])
    np.testing.assert_allclose(moments.sum(axis=0), 0, atol=0.02 * mu * normal)
    stored = 0.5 * (mu * normal) ** 2 / (2 * normal / 0.15)  # on the stiffness against approach
    assert energy["friction"] == pytest.approx(work - stored, rel=0.03)


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
    model = LineContact(yarn, s, np.full(len(s), spacing), np.full(2, 100.0), law, friction=1.0)
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0])
    tangent = np.where(yarn[:, None] == 0, [1.0, 0, 0], along)
    turn, history = np.tile(np.eye(3), (len(yarn), 1, 1)), LineHistory.none()
    for load in np.linspace(0, 1, steps + 1):
        move = load * (yarn == 1)[:, None] * np.array([slide, 0, -deep])
        state = BeamState(points + move, turn)
        force = model.respond(state, FAR_AWAY, np.zeros((2, 3, 3)), history, False)[0]
        history = model.commit(state, tangent, FAR_AWAY, history)
    pull, _, push = force[:-3].reshape(-1, 6)[yarn == 1, :3].sum(axis=0) * [1, 1, -1]
    stiffness = share * exponent * push / deep
    # `PARALLEL` leaves a part of the way along the yarns in their normal
    assert history.spring.sum() == pytest.approx(stiffness, rel=0.04)
    assert pull == pytest.approx(stiffness * slide / exponent, rel=0.15 if steps == 2 else 0.04)
