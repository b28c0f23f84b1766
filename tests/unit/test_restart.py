"""Restart files, from which a run goes on, and progress, which is plain lines with the time left."""

import io
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.loading.history import Motion, Recorder, Stations
from knitstudy.knit.loading.run import Progress, Run
from knitstudy.knit.loading.solve import Checkpoint
from knitstudy.knit.simulate import solve
from knitstudy.mechanics.core.increment import Increment, Rate
from knitstudy.mechanics.core.model import Response
from knitstudy.run.configuration import load_scene

STILL = {"centreline_displacement": np.zeros((1, 3))}


@dataclass(frozen=True)
class State:
    displacement: np.ndarray


def recorder():
    stations = Stations(np.zeros(1, int), np.zeros(1), np.zeros((1, 3)))
    return Recorder(
        stations,
        driven=np.array([[0, 1, 2]]),
        motion=Motion(np.array([[2.0, 0, 0]]), (1.0,), (), axis=0, length=10.0),
    )


def increment(index, load):
    response = Response(np.arange(3.0) + index, 1.5, {"internal": 2.0 * load})
    rates, updates = (Rate(0.25, np.ones(3)),), (np.full(3, 0.5), np.full(3, 0.1))
    state, headway = State(np.full((1, 3), load)), (0.1, 2, 5)
    return Increment(index, load, state, response, 0.25, rates, updates, 3, 7, headway=headway)


@pytest.fixture
def saved(tmp_path):
    file, record = Checkpoint(tmp_path / "run" / "a.npz", "key", State), recorder()
    for index, load in enumerate((0.0, 0.25, 0.5)):
        record.add(increment(index, load), STILL)
        file.save(increment(index, load), record)
    return file, record


def test_a_restart_gives_back_increment_and_history(saved):
    file, record = saved
    fresh = recorder()
    back = file.load(fresh)
    assert (back.index, back.load, back.size, back.headway) == (2, 0.5, 0.25, (0.1, 2, 5))
    np.testing.assert_array_equal(back.state.displacement, np.full((1, 3), 0.5))
    np.testing.assert_array_equal(back.rates[0].step, np.ones(3))
    np.testing.assert_array_equal(back.updates, [[0.5] * 3, [0.1] * 3])
    for name, values in record.columns.items():
        np.testing.assert_array_equal(fresh.columns[name], values)
    fresh.add(increment(3, 0.75), STILL)
    record.add(increment(3, 0.75), STILL)
    assert fresh.to_dataset()["energy"].equals(record.to_dataset()["energy"])
    # Trapezoidal work of reactions 0, 1, 2, 3 N over steps of 0.5 m.
    np.testing.assert_allclose(fresh.to_dataset()["energy"].sel(form="external"), [0, 0.25, 1.0, 2.25])


def test_a_restart_counts_what_the_run_has_taken_before(tmp_path):
    file, record, fresh = Checkpoint(tmp_path / "a.npz", "key", State), recorder(), recorder()
    taken = {
        "wall_seconds": 100.0,
        "processor_seconds": 150.0,
        "memory_growth": 10**14,
        "memory_peak": 10**15,
    }
    record.meter.go_on(taken)
    record.add(increment(0, 0.0), STILL)
    file.save(increment(0, 0.0), record)
    file.load(fresh)
    both = fresh.meter.read()
    assert 100 < both["wall_seconds"] < 140
    assert 150 < both["processor_seconds"] < 190
    assert (both["memory_growth"], both["memory_peak"]) == (10**14, 10**15)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_damaged_file_is_refused(saved, share):
    file, _ = saved
    content = file.path.read_bytes()
    file.path.write_bytes(content[: int(share * len(content))])
    with refusal("delete it"):
        file.load(recorder())


@dataclass(frozen=True)
class Inner:
    gap: np.ndarray
    count: int


@dataclass(frozen=True)
class Nested:
    """All that a state may hold."""

    inner: Inner
    maybe: Inner | None
    weight: float | None
    touches: bool
    name: str
    pair: tuple[Inner, Inner]
    steps: tuple[float, ...]
    nothing: tuple[int, ...] = ()


@pytest.mark.parametrize("present", [True, False])
def test_a_state_is_any_dataclass(tmp_path, present):
    inner = Inner(np.array([[0.5, np.inf]]), 3)
    state = Nested(
        inner, inner if present else None, 0.25 if present else None, True, "a", (inner, inner), (1.0, 2.0)
    )
    file = Checkpoint(tmp_path / "a.npz", "key", Nested)
    file.save(replace(increment(1, 0.5), state=state), recorder())
    back = file.load(recorder()).state
    for one in (back.inner, *back.pair, *([back.maybe] if present else [])):
        np.testing.assert_array_equal(one.gap, inner.gap)
        assert one.count == 3
    assert present == (back.maybe is not None)
    assert (back.weight, back.touches, back.name) == (state.weight, True, "a")
    assert (back.steps, back.nothing) == ((1.0, 2.0), ())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"key": "other"}, "another scene"),
        ({"state.displacement": np.full((1, 3), np.nan)}, r"state\.displacement holds values that are not"),
        ({"column.energy": np.full((3, 6), np.nan)}, r"column\.energy holds values that are not numbers"),
        ({"column.force": np.zeros(2)}, r"column\.force has 2 increments and must have 3"),
        ({"rates.0.step": np.ones(4)}, r"rates\.0\.step has the shape \(4,\) and must have \(3,\)"),
        ({"load": 1.5}, r"load is 1\.5 and must lie between 0 and 1"),
        ({"index": np.arange(2)}, "this restart file cannot be used"),
        ({"force": np.array(["a"])}, r"force holds <U1 and must hold numbers"),
    ],
)
def test_files_that_no_run_has_written_are_refused(saved, changes, message):
    file, _ = saved
    np.savez(file.path, **(dict(np.load(file.path)) | changes))
    with refusal(message):
        file.load(recorder())


def test_time_left_counts_from_where_a_run_goes_on(monkeypatch):
    """Half was done before; a half of the rest in thirty seconds."""
    clock, stream = iter([100.0, 130.0]), io.StringIO()
    monkeypatch.setattr("knitstudy.knit.loading.run.time.monotonic", lambda: next(clock))
    progress = Progress("simulation a", streams=(stream,))
    progress(0.5)
    progress(0.75, "strain 3.75%")
    first, second = stream.getvalue().splitlines()
    assert first.endswith("50% [00:00<?]")
    assert second.endswith("75% [00:30<00:30] strain 3.75%")


PAIR = {"fidelity": "spline_yarns", "pair.support": "ends", "pair.length": 3.7e-3}
PAIR |= {"load.path": [[0, 0, -4e-5], [5e-5, 0, -4e-5]]}


@pytest.fixture(scope="module")
def run(plain_scene, touching_cell, knit, contacts, knit_of):
    """Function that loads a reduced model, a planar one, beams that touch and slide, or solid yarns."""
    touching = touching_cell.vary({"mesh.beam_size": 10 / 9, "contact.friction": 0.1, "load.strain": 0.03})
    tied, cell = {"contacts": contacts}, knit_of(touching_cell)
    models = {
        "reduced": (plain_scene.replace("mesh.beam_size", 1.2), knit, tied),
        "planar": (plain_scene.replace("fidelity", "rom2d"), knit, tied),
        "touching": (touching, cell, {}),
    }

    def load(model, **files):
        if model in models:
            scene, fabric, data = models[model]
        else:
            changes = {"solver.increments": 6} | (PAIR if model.startswith("pair") else {})
            scene, data = load_scene(model).vary(changes), {}
            fabric = fabric_of(lay_out(scene))
        return solve(scene, fabric, run=Run(**files), **data)

    return load


def interrupted(run, restart, after, message):
    """Run until a load factor has been reached, then be interrupted; return the load factors that were reported."""
    seen = []

    def report(done, note):
        seen.append(done)
        assert note.startswith(message)
        if done >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(restart=restart, progress=report)
    return seen


LONG = pytest.param(
    "extreme-yarns-slide", marks=pytest.mark.full
)  # increments are halved for the energy balance


@pytest.mark.parametrize(
    "model", ["reduced", "planar", "touching", "pair-slid-30", "extreme-yarns-tie", LONG]
)
def test_an_interrupted_run_goes_on(model, run, tmp_path):
    run, restart = partial(run, model), tmp_path / "a.npz"
    whole = run()
    middle = float(whole["load"][len(whole["load"]) // 2])
    before = interrupted(run, restart, middle, "leg " if model.startswith("pair") else "strain ")
    assert restart.exists()
    after = []
    history = run(restart=restart, progress=lambda done, note: after.append(done))
    assert history.drop_vars("seconds").equals(whole.drop_vars("seconds"))
    np.testing.assert_array_equal([*before, *after[1:]], whole["load"])  # nothing is computed again
    if model == "touching":
        assert history["crossing_slip"].max() > 0
