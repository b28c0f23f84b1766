"""The loop along a load path: what it reports, records, refuses and keeps, whatever the model is."""

import logging
from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.sparse as sp

from knitstudy.errors import CoarseIncrement, ConvergenceError, DataFileError
from knitstudy.files import read_dataset
from knitstudy.loading.gates import require_closed_ledger
from knitstudy.loading.history import Stations
from knitstudy.loading.load_path import Motion
from knitstudy.loading.restart import Run
from knitstudy.loading.solve import Problem, follow
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear.direct import LU
from knitstudy.mechanics.model import Memoryless, Response


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
        stations=Stations(np.zeros(2, int), np.array([0.0, 1.0]), np.zeros((2, 3))),
        observers=(Ends(),),
        constants={"crossing_tied": np.zeros(1, np.int8)},
        attributes={"dof": 6},
    )


class Reports(list):
    """What progress was told; ends the run, as a signal would, at a load factor."""

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
    caplog.set_level(logging.INFO, logger="knitstudy.loading.solve")
    history = follow(problem, Run(progress=reports))
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
        follow(problem, Run(restart=restart, progress=Reports(ends_at=0.5)))
    reports = Reports()
    caplog.set_level(logging.INFO, logger="knitstudy.loading.solve")
    run = Run(restart=restart, progress=reports)
    history = follow(problem, run)
    assert alike(history, follow(problem))
    assert [done for done, _ in reports] == [0.5, 0.75, 1.0]  # the share at the start is not of this run
    going_on = "going on from increment 2 at load factor 0.5"
    assert any(record.getMessage().startswith(going_on) for record in caplog.records)
    reports.clear()
    assert alike(history, follow(problem, run))  # killed before the history was on disk
    assert [done for done, _ in reports] == [1.0]
    run.forget()
    assert not restart.exists()


def test_an_increment_too_coarse_for_the_ledger_is_halved(problem, tmp_path):
    def closed(increment, recorder):
        require_closed_ledger(recorder, increment.index, 0.01)

    problem = replace(problem, settings=Settings(increments=2), checks=(closed,))
    history = follow(problem)
    work, stored = history["energy"][-1, :2]
    assert abs(work - stored) <= 0.01 * work
    assert history["load"][-1] == 1
    assert np.all(np.diff(history["load"]) > 0)
    assert 4 <= history.sizes["increment"] - 1 <= 16
    with pytest.raises(KeyboardInterrupt):
        follow(problem, Run(restart=tmp_path / "a.npz", progress=Reports(ends_at=0.5)))
    assert alike(history, follow(problem, Run(restart=tmp_path / "a.npz")))


def test_halves_that_close_no_ledger_are_not_gone_on_with(problem, tmp_path):
    tried = []

    def open_beyond_the_middle(increment, recorder):
        if increment.load > 0.5:
            tried.append(increment.load)
            raise CoarseIncrement("the ledger is open", 1.0)

    with pytest.raises(ConvergenceError, match="the ledger is open"):
        follow(replace(problem, checks=(open_beyond_the_middle,)), Run(partial=tmp_path / "a.nc"))
    assert tried == [0.75, 0.625, 0.5625]
    assert read_dataset(tmp_path / "a.nc")["load"][-2] == 0.5


def test_what_had_converged_before_a_failure_is_kept(problem, tmp_path):
    broken = replace(problem, model=Spring(breaks_at=1.2))
    files = {"restart": tmp_path / "a.npz", "partial": tmp_path / "a.nc"}
    with pytest.raises(
        ConvergenceError,
        match=r"increment 3, load factor 0.75: the spring breaks. The history up to load factor 0.5 is in",
    ):
        follow(broken, Run(**files))
    kept = read_dataset(files["partial"])
    np.testing.assert_allclose(kept["force"], [0, 0.5 + 0.125, 2])
    assert kept.attrs["incomplete"] == "increment 3, load factor 0.75: the spring breaks"
    assert kept.attrs["scene"] == problem.scene.name
    # With a remedy the run goes on from there, and nothing incomplete is left.
    run = Run(**files)
    whole = follow(problem, run)
    assert alike(whole, follow(problem))
    run.forget()
    assert list(tmp_path.iterdir()) == []


def test_a_refused_state_is_recorded_but_in_no_restart_file(problem, tmp_path):
    def require_little(increment, recorder):
        if recorder.columns["force"][-1] > 1.5:
            raise ConvergenceError(f"increment {increment.index}: too much force")

    files = {"restart": tmp_path / "a.npz", "partial": tmp_path / "a.nc"}
    checked = replace(problem, checks=(require_little,))
    for _ in range(2):  # the second run meets the same state again
        with pytest.raises(ConvergenceError, match="increment 2: too much force"):
            follow(checked, Run(**files))
        np.testing.assert_allclose(read_dataset(files["partial"])["load"], [0, 0.25, 0.5])


def test_a_failure_before_anything_converged_leaves_no_history(problem, tmp_path):
    def refuse(increment):
        raise ConvergenceError("nothing")

    class Refusing:
        record = staticmethod(refuse)

    with pytest.raises(ConvergenceError, match=r"^nothing$"):
        follow(replace(problem, observers=(Refusing(),)), Run(partial=tmp_path / "a.nc"))
    assert list(tmp_path.iterdir()) == []


def test_an_observer_may_report_only_what_the_table_has(problem):
    class Inventive:
        def record(self, increment):
            return {"mood": 1.0}, {}

    with pytest.raises(DataFileError, match="a history has no variable 'mood'"):
        follow(replace(problem, observers=(Ends(), Inventive())))


def test_two_observers_must_not_report_the_same(problem):
    with pytest.raises(DataFileError, match="two observers report 'centreline_displacement'"):
        follow(replace(problem, observers=(Ends(), Ends())))


def test_fields_are_those_of_the_last_state(problem):
    shown = replace(problem, fields=lambda state: {"node_displacement": state.x.reshape(2, 3)})
    assert float(follow(shown)["node_displacement"][1, 0]) == 2.0
