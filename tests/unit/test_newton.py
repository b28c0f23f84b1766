"""Newton's method on springs whose solution is known."""

from dataclasses import dataclass, replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
from refusals import REFUSED, refusal

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.core.increment import (
    TRIALS,
    PrescribedDisplacement,
    Rate,
    Settings,
    Trial,
    extrapolated,
    line_search,
)
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.model import Memoryless, Response


@dataclass(frozen=True)
class State:
    x: np.ndarray


class Chain(Memoryless):
    """Springs in a row between unknowns, each with force f(stretch) and slope df."""

    block = 1
    length = 1.0

    def __init__(self, count, f, df):
        self.size, self.f, self.df = count, f, df
        self.scale = np.ones(count)

    def start(self):
        return State(np.zeros(self.size))

    def advance(self, state, step):
        return State(state.x + step)

    def respond(self, state, stiffness):
        pull = self.f(np.diff(state.x))
        force = np.zeros(len(state.x))
        force[:-1] -= pull
        force[1:] += pull
        matrix = None
        if stiffness:
            k = self.df(np.diff(state.x))
            main = np.append(k, 0) + np.append(0, k)
            matrix = sp.csr_matrix(sp.diags([-k, main, -k], [-1, 0, 1]))
        return Response(force, float(np.mean(np.abs(pull))), {"internal": 0.0}, matrix)


def cubic():
    return Chain(4, lambda e: e + e**3, lambda e: 1 + 3 * e**2)


PULL = PrescribedDisplacement(np.array([0, 3]), np.array([0.0, 3.0]))


@pytest.mark.parametrize(("fixed", "value", "message"), REFUSED["prescribed"])
def test_wrong_prescribed_unknowns_are_refused(fixed, value, message):
    with refusal(message):
        list(trace(cubic(), PrescribedDisplacement(np.array(fixed), np.array(value)), Settings(), LU()))


def test_an_increment_leaves_no_matrix():
    """Results of large knits would stand beside it."""

    class Forgetful(LU):
        knows = False

        def use(self, system):
            super().use(system)
            self.knows = True

        def forget(self):
            super().forget()
            self.knows = False

    solver = Forgetful()
    for _ in trace(cubic(), PULL, Settings(increments=2), solver):
        assert not solver.knows


def test_reaches_full_load_in_the_increments_asked_for():
    increments = list(trace(cubic(), PULL, Settings(increments=3), LU()))
    assert [i.load for i in increments] == [0, 1 / 3, 2 / 3, 1]
    np.testing.assert_allclose(increments[-1].state.x, [0, 1, 2, 3], atol=1e-9)
    assert all(i.residual <= 1e-6 and i.correction <= 1e-6 for i in increments)


def test_increments_end_at_stops_and_corners():
    """Out and back: nothing of the path between corners is cut off, and no rate is carried around one."""
    path = PrescribedDisplacement(np.array([0, 3]), np.array([[0, 3.0], [0, -1.5]]), (0.5, 1.0), (0.3,))
    assert path.next_stop(0.3 - 1e-15) == 0.5, "what rounding has brought just below a stop is that stop"
    increments = list(trace(cubic(), path, Settings(increments=4), LU()))
    assert [i.load for i in increments] == [0, 0.25, 0.3, 0.5, 0.75, 1]
    np.testing.assert_allclose([i.state.x[3] for i in increments], [0, 1.5, 1.8, 3, 0.75, -1.5], atol=1e-12)


def test_halves_increments_that_fail_and_grows_again():
    def fragile(e):
        """Springs of which no step may stretch one by more than a fifth of the load."""
        return np.where(e > fragile.limit, np.nan, e)

    fragile.limit = 0.3
    chain = Chain(4, fragile, np.ones_like)
    increments = []
    for increment in trace(chain, PULL, Settings(increments=1), LU()):
        increments.append(increment)
        fragile.limit = np.max(np.diff(increment.state.x)) + 0.3
    sizes = np.diff([i.load for i in increments])
    assert sizes.min() < 0.5
    assert increments[-1].load == 1


def test_says_where_a_path_ends_and_keeps_converged_increments():
    chain = Chain(4, lambda e: np.where(e > 0.55, np.nan, e), np.ones_like)
    path, seen = trace(chain, PULL, Settings(increments=4), LU()), []
    with refusal(r"does not converge beyond load factor 0\.5[45]"):
        seen.extend(path)
    assert 0.54 < seen[-1].load <= 0.55


def test_line_search_tames_a_step_that_overshoots():
    """Full Newton steps on arctan diverge from here; shortened ones arrive."""
    chain = Chain(3, lambda e: np.arctan(3 * (e - 1)) + np.arctan(3.0), lambda e: 3 / (1 + 9 * (e - 1) ** 2))
    drive = PrescribedDisplacement(np.array([0, 2]), np.array([0.0, 5.0]))
    *_, end = trace(chain, drive, Settings(increments=1), LU())
    np.testing.assert_allclose(end.state.x, [0, 2.5, 5], atol=1e-6)


def test_no_correction_is_longer_than_a_stride():
    """A soft start: the first tangent would take the node far beyond where the spring grows stiff."""

    class Watched(Chain):
        lengths = ()

        def advance(self, state, step):
            self.lengths = (*self.lengths, np.abs(step).max())
            return super().advance(state, step)

    def corrections(stride):
        uneven = np.array([1.0, 8.0])
        chain = Watched(3, lambda e: uneven * (0.01 * e + e**3), lambda e: uneven * (0.01 + 3 * e**2))
        drive = PrescribedDisplacement(np.array([0, 2]), np.array([0.0, 3.0]))
        *_, end = trace(chain, drive, Settings(increments=1, stride=stride), LU())
        first, second = uneven * (0.01 * np.diff(end.state.x) + np.diff(end.state.x) ** 3)
        assert first == pytest.approx(second, rel=1e-5)
        return chain.lengths[1:]  # after the prediction

    longest = max(corrections(np.inf))
    assert longest > 0.1
    assert max(corrections(longest / 10)) == pytest.approx(longest / 10)


def test_a_guess_that_the_first_correction_makes_worse_gives_way_to_that_of_the_tangent():
    """Springs that stiffen, pulled evenly: the tangent knows the answer, the rate of the increment before does not."""
    chain = Chain(4, lambda e: e + 30 * np.maximum(e - 1, 0) ** 2, lambda e: 1 + 60 * np.maximum(e - 1, 0))
    drive = PrescribedDisplacement(np.array([0, 3]), np.array([0.0, 3.6]))
    settings = Settings(increments=2, predictor=1)
    _, half, _ = trace(chain, drive, settings, LU())
    wrong = Rate(0.5, np.array([0.0, 4.5, -5.3, 3.6]))
    (end,) = trace(chain, drive, settings, LU(), resume=replace(half, rates=(wrong,)))
    np.testing.assert_allclose(end.state.x, [0, 1.2, 2.4, 3.6], atol=1e-9)
    assert end.newton_iterations == 2, "one is lost"


def test_a_guide_begins_increments_where_another_model_ends_them():
    def ends(model, guide=None):
        return {each.load: each for each in trace(model, PULL, Settings(increments=4), LU(), guide=guide)}

    # Uneven springs, so that no straight line leads from one increment to the next
    uneven = np.array([1.0, 4.0, 16.0])
    law = lambda e: uneven * e + e**3, lambda e: uneven + 3 * e**2
    alone = ends(Chain(4, *law))
    led = ends(Chain(4, *law), lambda load, target: alone[target].state.x - alone[load].state.x)
    assert max(each.newton_iterations for each in led.values()) <= 1, "a proof is all that is left"
    half = ends(Chain(4, *law), lambda load, target: None if target > 0.5 else np.zeros(4))
    for load, each in alone.items():
        np.testing.assert_allclose(led[load].state.x, each.state.x, atol=1e-9)
        np.testing.assert_allclose(half[load].state.x, each.state.x, atol=1e-6)


def test_a_guide_that_leads_astray_costs_one_attempt():
    """Springs that tear: beyond a stretch of two they have no tangent, and a path that begins there fails."""
    chain = Chain(4, lambda e: np.where(e < 2, e, np.nan), lambda e: np.where(e < 2, 1.0, np.nan))
    far = Chain(4, lambda e: np.tanh(e), lambda e: 1 - np.tanh(e) ** 2)
    astray = np.array([0.0, 60.0, -60.0, 0.0])
    for model in (chain, far):
        *_, end = trace(model, PULL, Settings(increments=2), LU(), guide=lambda load, target: astray.copy())
        np.testing.assert_allclose(end.state.x, [0, 1, 2, 3], atol=1e-5)


class Loose(Chain):
    """Springs in a row, beside an unknown whose force is next to nothing wherever it goes."""

    def __init__(self, drift):
        super().__init__(3, lambda e: e, np.ones_like)
        self.size, self.scale, self.drift = 4, np.ones(4), drift

    def respond(self, state, stiffness):
        springs = super().respond(State(state.x[:3]), stiffness)
        force = np.append(springs.force[:3], self.drift * (2 + np.sin(state.x[3])))
        matrix = sp.block_diag([springs.stiffness, [[self.drift]]], format="csr") if stiffness else None
        return replace(springs, force=force, stiffness=matrix)


def test_corrections_of_a_state_that_is_balanced_well_do_not_count():
    """Loose yarns go on moving. A hundredth of the allowed residual is enough, a tenth is not."""
    pull = PrescribedDisplacement(np.array([0, 2]), np.array([0.0, 2.0]))
    *_, last = trace(Loose(1e-9), pull, Settings(increments=1, predictor=0), LU())
    assert last.newton_iterations == 1
    assert last.correction > 1
    with refusal(r"residual is .*e-08 \(allowed 1\.0e-06\) and the correction"):
        list(trace(Loose(3e-8), pull, Settings(increments=1, predictor=0, vain=1000, cutbacks=0), LU()))


def test_a_free_mechanism_is_an_error():
    chain = Chain(3, lambda e: e, np.ones_like)
    loose = PrescribedDisplacement(np.array([], dtype=int), np.array([]))
    with pytest.raises(ConvergenceError):
        list(trace(chain, loose, Settings(increments=1, cutbacks=1), LU()))


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_the_predictor_is_the_polynomial_through_the_last_states(order):
    rng = np.random.default_rng(order)
    loads = np.array([0.9, 0.7, 0.65, 0.3, 0.1])[: order + 1]
    polynomial = np.polynomial.Polynomial(rng.normal(size=order + 1))
    rates = tuple(
        Rate(new - old, np.array([(polynomial(new) - polynomial(old)) / (new - old)]))
        for new, old in pairwise(loads)
    )
    np.testing.assert_allclose(
        extrapolated(rates, 0.25), polynomial(loads[0] + 0.25) - polynomial(loads[0]), rtol=1e-9
    )


def trials(force, status=None):
    """A trial at a share of a unit step in one unknown, and the shares that were asked for."""
    asked = []

    def trial(share):
        asked.append(share)
        value = force(share)
        return Trial(share, np.array([share]), None, SimpleNamespace(status=status), value, abs(value))

    return trial, asked


def closing(gap, penalty=1e4):
    """Force that a gap lets fall slowly, and contact steeply once it has closed."""
    return lambda share: -1.0 + 0.5 * share + penalty * max(0.0, share - gap)


@pytest.mark.parametrize("gap", [0.1, 0.3, 0.6])
def test_a_step_ends_where_a_gap_closes(gap):
    trial, asked = trials(closing(gap, 1e2), status=np.zeros(1))
    actual = line_search(trial, -1.0, 1.0, 1e-6)
    assert actual.share == pytest.approx(gap, abs=0.03)
    assert len(asked) <= TRIALS


def test_a_step_from_a_balanced_state_ends_between_both_sides_of_a_kink():
    """Full steps would go back and forth across the kink, by forces that are small enough."""
    trial, _ = trials(lambda share: 1e-7 * closing(0.5, penalty=3.0)(share), status=np.zeros(1))
    assert line_search(trial, -1e-7, 1e-7, 1e-6).share == pytest.approx(5 / 7, abs=0.1)


def test_folded_elements_shorten_the_step():
    trial, _ = trials(lambda share: np.nan if share > 0.4 else share - 1.0)
    assert line_search(trial, -1.0, 1.0, 1e-6).share == 0.25


@pytest.mark.parametrize("force", [np.nan, -2.0])
def test_none_helps(force):
    assert line_search(trials(lambda share: force)[0], -1.0, 1.0, 1e-6) is None


class Snapping(Chain):
    """A soft spring in a row with one whose force falls where it is stretched by 0.5 to 1.5."""

    def __init__(self):
        super().__init__(3, lambda e: np.array([0.2 * e[0], e[1] ** 3 - 3 * e[1] ** 2 + 2.3 * e[1]]), None)
        self.df = lambda e: np.array([0.2, 3 * e[1] ** 2 - 6 * e[1] + 2.3])

    def respond(self, state, stiffness):
        soft, hard = np.diff(state.x)
        stored = 0.1 * soft**2 + hard**4 / 4 - hard**3 + 1.15 * hard**2
        return replace(super().respond(state, stiffness), energy={"internal": stored})


def test_a_viscous_flow_that_is_not_needed_releases_nothing():
    plain, led = (list(trace(cubic(), PULL, Settings(increments=3, vain=v), LU())) for v in (30, -1))
    np.testing.assert_allclose(led[-1].state.x, plain[-1].state.x, atol=1e-6)
    assert [i.load for i in led] == [0, 1 / 3, 2 / 3, 1]
    assert led[-1].damped == pytest.approx(0, abs=0.02 * 2.25)  # the energy is 2.25


def test_a_viscous_flow_leads_through_a_snap_and_says_how_much_energy_that_releases():
    pull = PrescribedDisplacement(np.array([0, 2]), np.array([0.0, 6.0]))
    path = list(trace(Snapping(), pull, Settings(increments=60, vain=-1), LU()))
    work = sum(0.05 * (a.response.force[2] + b.response.force[2]) for a, b in pairwise(path))
    end = path[-1].response.energy
    assert np.diff(path[-1].state.x)[1] > 1.5
    assert end["stabilisation"] == path[-1].damped > 0.05
    assert work - end["internal"] == pytest.approx(end["stabilisation"], rel=0.15)


class Rattling(Chain):
    """Springs in a row, beside an unknown with next to no stiffness, whose force changes its sign at rest."""

    def __init__(self):
        super().__init__(4, lambda e: e * [1, 1, 0], lambda e: np.array([1.0, 1.0, 0.0]))

    def respond(self, state, stiffness):
        springs, way = super().respond(state, stiffness), state.x[3] - 1
        force = springs.force + np.array([0, 0, 0, 1e-10 * way + 1e-7 * np.sign(way)])
        matrix = sp.csr_matrix(springs.stiffness + sp.diags([0, 0, 0, 1e-10])) if stiffness else None
        return replace(springs, force=force, stiffness=matrix)


def test_a_viscous_flow_ends_where_its_forces_are_next_to_nothing():
    """Without viscous forces Newton's method goes to and fro for ever."""
    pull = PrescribedDisplacement(np.array([0, 2]), np.array([0.0, 1.0]))
    *_, last = trace(Rattling(), pull, Settings(increments=2, vain=-1), LU())
    np.testing.assert_allclose(last.state.x, [0, 0.5, 1, 1], atol=1e-5)
    np.testing.assert_allclose(last.response.force, [-0.5, 0, 0.5, 0], atol=1e-6)
    assert last.damped < 1e-6


def test_steps_of_a_viscous_flow_are_short_and_begin_where_the_last_one_ended():
    model, path = Snapping(), []
    model.length, model.begin = 0.4, lambda state, load, change: path.append(state.x) or state
    pull = PrescribedDisplacement(np.array([0, 2]), np.array([0.0, 6.0]))
    increments = list(trace(model, pull, Settings(increments=60, vain=-1), LU()))
    jump = np.abs(np.diff([increment.state.x[1] for increment in increments])).max()
    steps = np.abs(np.diff([x[1] for x in path]))
    assert steps.max() <= 1.25 * model.length < jump
