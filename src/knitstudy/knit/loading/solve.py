"""A boundary value problem and its solution along the load path: increments, checks, history, restart file."""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from types import UnionType
from typing import Any, Protocol, Union, get_args, get_origin, get_type_hints

import numpy as np
import xarray as xr

from knitstudy.errors import CoarseIncrement, ConvergenceError, DataFileError
from knitstudy.files import replacing
from knitstudy.knit.loading.gates import (
    fewest_across,
    relaxed_limits,
    require_apart,
    require_lasting_friction,
)
from knitstudy.knit.loading.history import Meter, Motion, Recorder, Stations
from knitstudy.knit.loading.overlap import Repeats, largest_overlap
from knitstudy.knit.loading.run import IN_MEMORY, ReportProgress, Run, silent
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.shared_sections import Newton
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import reuse_memory, serial_blas
from knitstudy.mechanics.core.energy_balance import worth_halving
from knitstudy.mechanics.core.increment import Increment, PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU, LinearSolver
from knitstudy.mechanics.core.load_path import Guide, trace
from knitstudy.mechanics.core.model import Model, Response

# Ways of loading, in words, by `load.deformation` of a cell or `load.direction` of a knit
WAYS = {
    "course": "along courses",
    "wale": "along wales",
    "biaxial": "in both directions",
    "shear": "in shear",
    "press": "between plates",
}
HELD_BY_NOTHING = (
    "Yarns do not hold each other there: begin with the shape at rest (load.start), draw closer loops (smaller "
    "pattern.course_spacing and pattern.wale_spacing, less pattern.loop_length), or use a larger load"
)

UNSTABLE = (
    "the path has passed a bifurcation or a limit point, and shapes beside the simulated one have less energy"
)

log = logging.getLogger(__name__)

# Whether a run goes on from a restart file, for readers who do not want a line for every increment
resumed = logging.getLogger(f"{__name__}.resumed")

Reported = tuple[dict[str, Any], dict[str, Floats]]
"""Columns of the history, and columns of the points in contact; see `Recorder.add`."""


class Observer(Protocol):
    """Reports columns of a model at every converged increment."""

    def record(self, increment: Increment) -> Reported:
        """Return the columns of the history for an increment."""
        ...


Check = Callable[[Increment, Recorder], None]
"""Raises a ConvergenceError if a converged increment, which has been recorded, must not count."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A boundary value problem along a load path."""

    scene: Scene
    model: Model
    observer: Observer
    settings: Settings
    prescribed: PrescribedDisplacement
    motion: Motion  # of the driven side
    # (k, 3) unknowns of the driven nodes by component (x, y, z), whose forces are the reaction
    driven: Ints
    stations: Stations  # points whose displacement the observer reports
    # Called in order after an increment has been recorded and before it is written to the restart file, so that
    # no run goes on from a refused state
    checks: tuple[Check, ...] = ()
    # Variables of the history that are the same at all increments
    constants: dict[str, Floats] = field(default_factory=dict)
    # Returns the variables of the history that are known at the last increment alone, from the model's state
    fields: Callable[[Any], dict[str, Floats]] | None = None
    attributes: dict[str, Any] = field(default_factory=dict)  # of the history: numbers and texts
    solver: LinearSolver = field(default_factory=LU)
    repeats: Repeats | None = None  # of an endless fabric
    meter: Meter | None = None  # begun before the model was built; by default with the solution
    # Returns a cheaper model that leads the way, if there is one, which reports its own progress
    guide: Callable[[ReportProgress], Guide | None] = lambda report: None

    def increments(
        self, report: ReportProgress = silent, resume: Increment | None = None
    ) -> Generator[Increment, str | None, None]:
        """Follow the load path from the undeformed state, or from an increment; see `trace`."""
        guide = self.guide(report)
        return trace(self.model, self.prescribed, self.settings, self.solver, resume=resume, guide=guide)


def settings_of(solver: Newton, touches: bool, stride: float = np.inf) -> Settings:
    """Return accuracy and limits of a load path; `stride` [m] bounds corrections of yarns that touch.

    Where contact begins, a parabola through earlier increments overshoots far into the other yarn.
    """
    settings = Settings(
        increments=solver.increments,
        residual_tolerance=solver.residual_tolerance,
        correction_tolerance=solver.correction_tolerance,
    )
    return replace(settings, predictor=1, stride=stride) if touches else settings


def solve_load_path(problem: Problem, run: Run = IN_MEMORY) -> xr.Dataset:
    """Drive a model to full load and return its history, in the format of docs/reference/files.md.

    An increment whose energy balance misses too much is repeated in halves, as one that does not converge
    is, as long as that helps.

    Raises
    ------
    ConvergenceError
        If the load cannot be reached or a check refuses a state; its `history` holds the increments that had converged.
    DataFileError
        If the restart file is damaged or belongs to another scene.
    """
    reuse_memory()
    scene = problem.scene
    place = problem.motion.place
    recorder = Recorder(problem.stations, problem.driven, problem.motion, problem.meter or Meter())
    checkpoint = Checkpoint(run.restart, scene.hash, type(problem.model.start())) if run.restart else None
    last = checkpoint.load(recorder) if checkpoint else None
    if last is not None:
        resumed.info(
            "going on from increment %d at load factor %.4g (%s)", last.index, last.load, run.restart
        )
        run.progress(last.load, place(last.load))
    increments = problem.increments(run.progress, resume=last)
    try:
        with serial_blas():
            for last in _accepted(problem, recorder, increments):
                if checkpoint:
                    # Writing takes a tenth of a reduced model's time and is not part of its cost.
                    with recorder.meter.paused():
                        checkpoint.save(last, recorder)
                run.progress(last.load, place(last.load))
                if _is_at_largest_load(problem, recorder):
                    return _history(problem, recorder, last).assign_attrs(full_load=last.load)
    except ConvergenceError as error:
        if last is not None and last.load > 0:
            if len(recorder.columns["load"]) > last.index + 1:
                recorder.drop()  # refused
            reached = f"ended at {place(last.load)}, load factor {last.load:.4g}"
            _add_slack(error, problem, recorder)
            error.history = _history(problem, recorder, last).assign_attrs(incomplete=f"{reached}: {error}")
        raise
    return _history(problem, recorder, last)


def _is_at_largest_load(problem: Problem, recorder: Recorder) -> bool:
    """Whether a cell has the largest force per width or pressure that its scene asks for."""
    force, pressure = (problem.scene.value(f"load.largest_{name}") for name in ("force", "pressure"))
    columns = recorder.columns
    if force is not None and abs(columns["force_per_width"][-1][problem.motion.axis]) >= force:
        return True
    return pressure is not None and bool(columns["pressure"][-1] >= pressure)


def _add_slack(error: ConvergenceError, problem: Problem, recorder: Recorder) -> None:
    """Add to an error up to which strain nothing resists the load, where nothing ever does."""
    slack = slack_of(problem, recorder)
    if slack and not recorder.slack()[1]:
        error.args = (f"{error}; {slack}. {HELD_BY_NOTHING}",)


def slack_of(problem: Problem, recorder: Recorder) -> str:
    """Return in words up to which strain nothing resists the load, "" if something does from the first increment on."""
    scene = problem.scene
    index, _ = recorder.slack()
    way = WAYS.get(scene.value("load.deformation") or scene.value("load.direction"))
    if not index or way is None:
        return ""
    strain = recorder.columns["strain"][index]
    undecided = recorder.undecided[index]
    return (
        f"no stiffness {way} below a strain of {strain:.3g}: up to there yarns store less than the {undecided:.1g} J "
        "of drag and of what solver.residual_tolerance leaves open"
    )


def _accepted(
    problem: Problem, recorder: Recorder, increments: Generator[Increment, str | None, None]
) -> Iterator[Increment]:
    """Record converged increments and yield those that all checks accept; raises ConvergenceError as these."""
    # Of an increment and of those that it is a part of, by unit
    errors: defaultdict[str, list[float]] = defaultdict(list)
    increment = next(increments, None)
    while increment is not None:
        _record(problem, recorder, increment)
        coarse = _check(problem, increment, recorder)
        if coarse is not None:
            alike = errors[coarse.unit]
            alike.append(coarse.error)
            if worth_halving(alike):
                recorder.drop()
                increment = increments.send(str(coarse))
                continue
            if not coarse.bearable:
                raise coarse
        require_lasting_friction(recorder, increment.index)
        *before, negative = recorder.columns["negative_eigenvalues"]
        if negative > 0 and max(before) <= 0:
            log.warning("increment %d: unstable %s", increment.index, unstable(recorder))
        yield increment
        errors.clear()
        increment = next(increments, None)


def unstable(recorder: Recorder) -> str:
    """Return where a path has lost its stability, in words; empty if it has not.

    The path has lost it since the increment before. The tangent is that of the last iteration, a correction earlier.
    """
    negative = np.array(recorder.columns["negative_eigenvalues"])
    if not np.any(negative > 0):
        return ""
    places = [recorder.motion.place(load) for load in recorder.columns["load"]]
    first = int(np.argmax(negative > 0))
    stable = first + np.flatnonzero(negative[first:] == 0)
    again = f" (stable again by {places[stable[0]]})" if len(stable) else ""
    return f"by {places[first]}{again}: {UNSTABLE}"


def _check(problem: Problem, increment: Increment, recorder: Recorder) -> CoarseIncrement | None:
    """Call all checks; return the first error of an increment that is too coarse, of those that are not bearable."""
    errors: list[CoarseIncrement] = []
    checks: tuple[Check, ...] = (*problem.checks, partial(_require_apart, problem))
    for check in checks:
        try:
            check(increment, recorder)
        except CoarseIncrement as error:
            errors.append(error)
    return min(errors, key=lambda error: error.bearable, default=None)


def _require_apart(problem: Problem, increment: Increment, recorder: Recorder) -> None:
    """Refuse an increment after which yarns overlap too deep; raises as `gates.require_apart`."""
    limit = problem.scene.value("gates.overlap")
    if limit is not None:
        require_apart(recorder.columns["largest_overlap"][-1], increment.index, limit)


def _record(problem: Problem, recorder: Recorder, increment: Increment) -> None:
    """Add a converged increment to the history, and a line to the log."""
    columns, points = problem.observer.record(increment)
    if problem.scene.value("gates.overlap") is not None:
        places = problem.stations.position + columns["centreline_displacement"]
        repeats = problem.repeats
        radius = problem.scene.radius
        lattice = () if repeats is None else (repeats.length, repeats.stretched(columns["cell_strain"]))
        columns["largest_overlap"] = largest_overlap(problem.stations, places, radius, *lattice)
    recorder.add(increment, columns, points)
    gap = columns.get("smallest_gap", np.nan)
    log.info(
        "increment %d: %s, force %.6g N, %d Newton and %d Krylov iterations, residual %.1e%s",
        increment.index,
        problem.motion.place(increment.load),
        recorder.columns["force"][-1],
        increment.newton_iterations,
        increment.krylov_iterations,
        increment.residual,
        f", smallest gap {gap:.3g} m" if np.isfinite(gap) else "",
    )


def _history(problem: Problem, recorder: Recorder, last: Increment | None) -> xr.Dataset:
    """Return the history so far, with the fields of the last increment if asked for."""
    scene, solver = problem.scene, problem.solver
    refinement = scene.value("mesh.refinement")
    fewest = None if refinement is None else fewest_across(scene.specimen, refinement)
    fields = problem.fields(last.state) if problem.fields and last else {}
    if slack := slack_of(problem, recorder):
        log.info("%s", slack)
    return recorder.to_dataset(
        problem.constants | fields,
        scene=scene.name,
        fidelity=scene.fidelity,
        interaction=scene.interaction,
        **({"relaxed_limits": wider} if (wider := relaxed_limits(scene.gates, fewest)) else {}),
        **({"slack": slack} if slack else {}),
        **({"unstable": where} if last and (where := unstable(recorder)) else {}),
        unknowns=problem.model.size - len(problem.prescribed.fixed),
        linear_solver=type(getattr(solver, "preconditioner", solver)).__name__,
        linear_setups=getattr(solver, "setups", 0),
        **problem.attributes,
    )


# The restart file of a run: the last converged increment and the history up to it, read and written


KEPT = ("index", "load", "size", "largest", "damped", "unbalanced_so_far", "headway", "rates", "updates")
"""Fields of an increment from which a run goes on, besides its state and its forces."""

_LEAVES = (np.ndarray, np.generic, bool, int, float, str)
_SCALARS = (bool, int, float, str)
# Columns that gates and tables judge
_JUDGED = tuple(f"column.{name}" for name in ("load", "strain", "force", "reaction", "energy"))


@dataclass(frozen=True)
class Checkpoint:
    """A restart file of one scene: the last converged increment and the history up to it."""

    path: Path  # its folder is made when needed
    key: str  # hash of everything that determines the result; a file with another key is refused
    # Of the model's state: a dataclass of arrays, numbers, texts, None, tuples of these, and such dataclasses
    state_type: type

    def save(self, increment: Increment, recorder: Recorder) -> None:
        """Replace the file, whole or not at all.

        Raises TypeError if the state holds something that a restart file cannot keep.
        """
        response = increment.response
        data: dict[str, Any] = {"key": self.key, "force": response.force, "mean_force": response.mean_force}
        for name in ("state", *KEPT):
            data |= _arrays(getattr(increment, name), name)
        data |= {f"column.{name}": np.array(values) for name, values in recorder.columns.items()}
        for name, parts in recorder.flat.items():
            data |= {
                f"flat.{name}": np.concatenate(parts),
                "flat_ends": np.cumsum([len(part) for part in parts]),
            }
        data |= {f"meter.{name}": value for name, value in recorder.meter.read().items()}
        data["undecided"] = np.array(recorder.undecided)
        with replacing(self.path) as temporary, open(temporary, "wb") as file:
            np.savez(file, allow_pickle=False, **data)

    def load(self, recorder: Recorder) -> Increment | None:
        """Return the increment to go on from and fill the recorder; None if there is no file.

        Another run of the same scene that has come to its end may delete the file at any moment.
        Raises DataFileError if the file is damaged or belongs to another scene.
        """
        try:
            with np.load(self.path, allow_pickle=False) as archive:
                data = dict(archive)
            return self._restore(data, recorder)
        except FileNotFoundError:
            return None
        except Exception as error:  # readers of damaged archives raise nearly anything
            raise DataFileError(
                f"{self.path}: this restart file cannot be used ({error or type(error).__name__}); delete it to start "
                "the scene again"
            ) from None

    def _restore(self, data: dict[str, Floats], recorder: Recorder) -> Increment:
        if str(data["key"]) != self.key:
            raise ValueError("it belongs to another scene or another version of the input")
        _require_whole(data)
        for name, values in data.items():
            if name.startswith("column."):
                recorder.columns[name.removeprefix("column.")] = list(values)
            if name.startswith("flat."):
                recorder.flat[name.removeprefix("flat.")] = np.split(values, data["flat_ends"][:-1])
        recorder.undecided = data["undecided"].tolist()
        recorder.meter.go_on(
            {name.removeprefix("meter."): data[name].item() for name in data if name.startswith("meter.")}
        )
        hints = get_type_hints(Increment)
        return Increment(
            state=_value(self.state_type, data, "state"),
            response=Response(data["force"], float(data["mean_force"])),
            **{name: _value(hints[name], data, name) for name in KEPT},
        )


_NUMBERS = (
    "state.",
    "rates",
    "updates",
    "force",
    "mean_force",
    "load",
    "size",
    "largest",
    "damped",
    "unbalanced",
)


def _require_whole(data: dict[str, Floats]) -> None:
    """Refuse values that are not numbers, and arrays whose lengths do not fit; gaps may be infinite or nan."""
    increments = int(data["index"]) + 1
    for name, values in data.items():
        judged = name.startswith((*_NUMBERS, *_JUDGED)) and not name.endswith("gap")
        if judged and values.dtype.kind == "f" and np.isnan(values).any():
            raise ValueError(f"{name} holds values that are not numbers")
        if name.startswith(("rates", "force")) and values.dtype.kind not in "iuf":
            raise ValueError(f"{name} holds {values.dtype} and must hold numbers")
        if name.startswith("column.") and len(values) != increments:
            raise ValueError(f"{name} has {len(values)} increments and must have {increments}")
        if name.startswith("rates.") and name.endswith(".step") and values.shape != data["force"].shape:
            raise ValueError(f"{name} has the shape {values.shape} and must have {data['force'].shape}")
    if not 0 <= float(data["load"]) <= 1:
        raise ValueError(f"load is {float(data['load'])} and must lie between 0 and 1")


def _arrays(value: Any, name: str) -> dict[str, Floats]:
    """Return all arrays, numbers and texts in a value by dotted names; None is left out."""
    if value is None:
        return {}
    if is_dataclass(value):
        parts = [_arrays(getattr(value, field.name), f"{name}.{field.name}") for field in fields(value)]
    elif isinstance(value, tuple):
        parts = [{f"{name}.length": np.asarray(len(value))}]
        parts += [_arrays(item, f"{name}.{i}") for i, item in enumerate(value)]
    elif isinstance(value, _LEAVES) and np.asarray(value).dtype != object:
        return {name: np.asarray(value)}
    else:
        raise TypeError(f"{name} is a {type(value).__name__}, which a restart file cannot keep")
    return {key: array for part in parts for key, array in part.items()}


def _value(hint: Any, data: dict[str, Floats], name: str) -> Any:
    """Return the value of a type that `_arrays` took apart."""
    if get_origin(hint) in (Union, UnionType):
        if not any(entry == name or entry.startswith(f"{name}.") for entry in data):
            return None
        hint = next(part for part in get_args(hint) if part is not type(None))
    if isinstance(hint, type) and is_dataclass(hint):
        hints = get_type_hints(hint)
        return hint(
            **{field.name: _value(hints[field.name], data, f"{name}.{field.name}") for field in fields(hint)}
        )
    if get_origin(hint) is tuple:
        count = int(data[f"{name}.length"])
        kinds = get_args(hint)
        of_items = kinds[:1] * count if kinds[-1] is Ellipsis else kinds[:count]
        return tuple(_value(kind, data, f"{name}.{i}") for i, kind in enumerate(of_items))
    return hint(data[name]) if hint in _SCALARS else data[name]
