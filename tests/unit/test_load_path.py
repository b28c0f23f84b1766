"""Load paths: how grips move, and the solution along them: its progress, columns, refusals and kept results."""

import logging
from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.sparse as sp
from refusals import refusal

from knitstudy.errors import CoarseIncrement, ConvergenceError
from knitstudy.knit.geometry.specimens import yarn_pair
from knitstudy.knit.loading.gates import require_energy_balance
from knitstudy.knit.loading.history import Motion, Stations, load_path
from knitstudy.knit.loading.run import Run
from knitstudy.knit.loading.solve import Problem, solve_load_path
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.model import Memoryless, Response

CORNERS = np.array([[0, 0, -1e-5], [3e-5, 0, -1e-5], [3e-5, 6e-5, -1e-5], [0, 0, 0]])
QUARTERS = (0.25, 0.5, 0.75, 1.0)


def test_a_motion_is_straight_between_its_corners():
    motion = Motion(CORNERS, QUARTERS, (), axis=2, length=1.0)
    np.testing.assert_array_equal(motion.at(0.0), 0)
    np.testing.assert_allclose(motion.at(0.125), 0.5 * CORNERS[0])
    np.testing.assert_allclose(motion.at(0.5), CORNERS[1])
    np.testing.assert_allclose(motion.at(0.65), 0.4 * CORNERS[1] + 0.6 * CORNERS[2])
    np.testing.assert_allclose(motion.at(1.0), CORNERS[3], atol=1e-20)


def test_a_pair_follows_its_path(plain_scene):
    pair = plain_scene.vary({"specimen": "pair", "fidelity": "hexahedra", "load.path": CORNERS.tolist()})
    motion = load_path(pair, yarn_pair(0.9e-3, 90.0, 5e-3, 0.01))
    assert motion.corners == QUARTERS
    np.testing.assert_array_equal(motion.displacement, CORNERS)
    assert (motion.axis, motion.length) == (2, 1.8e-3)


@dataclass(frozen=True)
class Stretch:
    x: np.ndarray


class Spring(Memoryless):
    """A spring along x from the origin, f = x + x^3, that breaks at a stretch."""

    block, size, length, scale = 3, 6, 1.0, np.ones(6)

    def __init__(self, breaks_at=np.inf):
        self.breaks_at = breaks_at

    def start(self):
        return Stretch(np.zeros(6))

    def advance(self, state, step):
        return Stretch(state.x + step)

    def settle(self, state):
        if state.x[3] > self.breaks_at:
            raise ConvergenceError("the spring breaks")

    def respond(self, state, stiffness):
        x = state.x[3] - state.x[0]
        force = np.zeros(6)
        force[[0, 3]] = -(x + x**3), x + x**3
        matrix = sp.csr_matrix(np.eye(6) * (1 + 3 * x**2)) if stiffness else None
        return Response(force, 1.0, {"internal": x**2 / 2 + x**4 / 4}, matrix)


class Ends:
    """Reports where both ends are."""

    def record(self, increment):
        return {"centreline_displacement": increment.state.x.reshape(2, 3)}, {}


@pytest.fixture
def problem(plain_scene):
    """The spring pulled by 2 m in four increments, as the scene's 5% strain."""
    pull = np.array([[2.0, 0, 0]])
    return Problem(
        scene=plain_scene,
        model=Spring(),
        prescribed=PrescribedDisplacement(np.arange(6), np.array([0, 0, 0, 2.0, 0, 0])),
        solver=LU(),
        settings=Settings(increments=4),
        motion=Motion(pull, (1.0,), (), axis=0, length=40.0),
        driven=np.array([[3, 4, 5]]),
        stations=Stations(np.zeros(2, int), np.array([0.0, 1.0]), np.array([[0.0, 0, 0], [1.0, 0, 0]])),
        observer=Ends(),
        constants={"crossing_tied": np.zeros(1, np.int8)},
        attributes={"dof": 6},
    )


class Reports(list):
    """The calls of progress; ends the run, as a signal would, at a load factor."""

    def __init__(self, ends_at=np.inf):
        super().__init__()
        self.ends_at = ends_at

    def __call__(self, done, note):
        self.append((done, note))
        if done >= self.ends_at:
            raise KeyboardInterrupt


def alike(one, other):
    """Whether two histories hold the same, up to times and memory."""
    return one.drop_vars("seconds").equals(other.drop_vars("seconds"))


def test_history_progress_and_log(problem, caplog):
    reports = Reports()
    caplog.set_level(logging.INFO, logger="knitstudy.knit.loading.solve")
    history = solve_load_path(problem, Run(progress=reports))
    np.testing.assert_allclose(history["force"], [0, 0.5 + 0.125, 2, 1.5 + 3.375, 10])
    np.testing.assert_allclose(history["strain"], [0, 0.0125, 0.025, 0.0375, 0.05])
    np.testing.assert_array_equal(history["centreline_displacement"][-1], [[0, 0, 0], [2, 0, 0]])
    assert (history.attrs["dof"], history.attrs["unknowns"], history.attrs["linear_solver"]) == (6, 0, "LU")
    assert history["crossing_tied"].dims == ("crossing",)
    assert reports == [
        (0.0, "strain 0.00%"),
        (0.25, "strain 1.25%"),
        (0.5, "strain 2.50%"),
        (0.75, "strain 3.75%"),
        (1.0, "strain 5.00%"),
    ]
    lines = [record.getMessage() for record in caplog.records]
    assert lines[2].startswith("increment 2: strain 2.50%, force 2 N, 1 Newton and")
    assert len(lines) == 5


def test_an_interrupted_run_goes_on(problem, tmp_path, caplog):
    restart = tmp_path / "run" / "a.npz"
    with pytest.raises(KeyboardInterrupt):
        solve_load_path(problem, Run(restart=restart, progress=Reports(ends_at=0.5)))
    reports = Reports()
    caplog.set_level(logging.INFO, logger="knitstudy.knit.loading.solve")
    run = Run(restart=restart, progress=reports)
    history = solve_load_path(problem, run)
    assert alike(history, solve_load_path(problem))
    assert [done for done, _ in reports] == [0.5, 0.75, 1.0]  # the share at the start is not of this run
    going_on = "going on from increment 2 at load factor 0.5"
    assert any(record.getMessage().startswith(going_on) for record in caplog.records)
    reports.clear()
    assert alike(history, solve_load_path(problem, run))  # killed before the history was on disk
    assert [done for done, _ in reports] == [1.0]
    run.forget()
    assert not restart.exists()


def test_an_increment_too_coarse_for_the_energy_balance_is_halved(problem, tmp_path):
    def closed(increment, recorder):
        require_energy_balance(recorder, increment.index, 0.01)

    problem = replace(problem, settings=Settings(increments=2), checks=(closed,))
    history = solve_load_path(problem)
    work, stored = history["energy"][-1, :2]
    assert abs(work - stored) <= 0.01 * work
    assert history["load"][-1] == 1
    assert np.all(np.diff(history["load"]) > 0)
    assert 4 <= history.sizes["increment"] - 1 <= 16
    with pytest.raises(KeyboardInterrupt):
        solve_load_path(problem, Run(restart=tmp_path / "a.npz", progress=Reports(ends_at=0.5)))
    assert alike(history, solve_load_path(problem, Run(restart=tmp_path / "a.npz")))


class Buckling(Spring):
    """A spring whose end loses its hold across where it is stretched by 1.2 m."""

    def respond(self, state, stiffness):
        answer, hold = super().respond(state, stiffness), 1.2 - state.x[3]
        force, matrix = answer.force.copy(), answer.stiffness
        force[4] = hold * state.x[4]
        if stiffness:
            matrix = sp.csr_matrix(matrix)
            matrix[4, 4] = hold
        return replace(answer, force=force, stiffness=matrix)


def test_a_path_says_once_where_it_passes_a_bifurcation(problem, tmp_path, caplog):
    free = PrescribedDisplacement(np.array([0, 1, 2, 3, 5]), np.array([0, 0, 0, 2.0, 0]))
    straight = replace(problem, model=Spring(), prescribed=free)
    assert "unstable" not in solve_load_path(straight).attrs
    assert not caplog.records
    buckles, restart = replace(straight, model=Buckling()), tmp_path / "a.npz"
    with pytest.raises(KeyboardInterrupt):
        solve_load_path(buckles, Run(restart=restart, progress=Reports(ends_at=0.75)))
    for history in (solve_load_path(buckles, Run(restart=restart)), solve_load_path(buckles)):
        assert history["negative_eigenvalues"].to_numpy().tolist() == [-1, 0, 0, 1, 1]
        assert history.attrs["unstable"].startswith("by strain 3.75%: the path has passed a bifurcation")
    warned = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
    assert len(warned) == 2  # of two paths, one of them in two runs
    assert all(line.startswith("increment 3: unstable by strain 3.75%") for line in warned)


class Regaining(Spring):
    """A spring beside friction that gives back its work beyond a stretch of 1.2 m."""

    def respond(self, state, stiffness):
        answer = super().respond(state, stiffness)
        return replace(answer, energy=answer.energy | {"friction": 0.1 * min(state.x[3], 2.4 - state.x[3])})


def test_a_run_ends_where_friction_gives_dissipated_energy_back(problem):
    message = r"increment 3: the energy of friction falls by 0\.01 J, 0\.4% of the largest energy so far"
    with refusal(message) as refused:
        solve_load_path(replace(problem, model=Regaining()))
    np.testing.assert_allclose(refused.value.history["energy"].sel(form="friction"), [0, 0.05, 0.1])


def test_errors_of_one_unit_are_compared_where_an_increment_is_halved(problem):
    """Three halvings of the first increment: 4 J are less than 5 J, and no more than 1 nm."""
    errors = iter([(1e-9, "m"), (5.0, "J"), (4.0, "J")])

    def refuse(increment, recorder):
        for error, unit in errors if increment.index else ():
            raise CoarseIncrement("too coarse", error, unit)

    load = solve_load_path(replace(problem, checks=(refuse,)))["load"]
    assert load[1] == load[-1] / 8 / problem.settings.increments


def test_increments_that_converged_before_a_failure_are_kept(problem, tmp_path):
    broken = replace(problem, model=Spring(breaks_at=1.2))
    run = Run(restart=tmp_path / "a.npz")
    with refusal(r"^increment 3, load factor 0.75: the spring breaks$") as refused:
        solve_load_path(broken, run)
    kept = refused.value.history
    np.testing.assert_allclose(kept["force"], [0, 0.5 + 0.125, 2])
    assert kept.attrs["incomplete"] == f"ended at strain 2.50%, load factor 0.5: {refused.value}"
    # With a remedy the run goes on from there.
    assert alike(solve_load_path(problem, run), solve_load_path(problem))


def test_a_state_that_a_gate_refuses_is_not_of_the_curve(problem):
    def refuse(increment, recorder):
        if increment.load == 1:
            raise ConvergenceError("the limit gates.some is less")

    with refusal(r"gates\.some") as refused:
        solve_load_path(replace(problem, checks=(refuse,)))
    np.testing.assert_allclose(refused.value.history["load"], [0, 0.25, 0.5, 0.75])
