"""Follows a problem along its load path, with restart file, progress, checks and history."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import xarray as xr

from knitstudy.errors import ConvergenceError, DataFileError
from knitstudy.files.netcdf import write_dataset
from knitstudy.loading.checkpoint import Checkpoint
from knitstudy.loading.history import Recorder
from knitstudy.loading.load_path import place
from knitstudy.loading.problem import Problem
from knitstudy.loading.progress import ReportProgress, silent
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.parallel import serial_blas

log = logging.getLogger(__name__)


def follow(
    problem: Problem,
    *,
    restart: Path | None = None,
    partial: Path | None = None,
    progress: ReportProgress = silent,
) -> xr.Dataset:
    """Drive a model to full load and return its history.

    Parameters
    ----------
    problem : Problem
    restart : Path, optional
        Restart file, rewritten at every increment and removed at the end. If it exists, the run goes on from it.
    partial : Path, optional
        Where the history of what had converged is written, with the reason as attribute `incomplete`, if full load is
        not reached; removed when it is.
    progress : callable, optional
        Called at every converged increment with the load factor and, in words, the place on the load path.

    Returns
    -------
    Dataset
        History in the format of docs/architecture.md.

    Raises
    ------
    ConvergenceError
        If the load cannot be reached or a check refuses a state; `restart` and `partial` keep what had converged.
    DataFileError
        If the restart file is damaged or belongs to another scene.
    """
    scene, recorder = problem.scene, problem.recorder()
    checkpoint = Checkpoint(restart, scene.hash, type(problem.model.start())) if restart else None
    last = checkpoint.load(recorder) if checkpoint else None
    if last is not None:
        log.info("going on from increment %d at load factor %.4g (%s)", last.index, last.load, restart)
        progress(last.load, place(scene.load, last.load))
    path = trace(problem.model, problem.prescribed, problem.settings, problem.solver, last)
    try:
        with serial_blas():
            for increment in path:
                _record(problem, recorder, increment)
                last = increment
                for check in problem.checks:
                    check(last, recorder)
                if checkpoint:
                    checkpoint.save(last, recorder)
                progress(last.load, place(scene.load, last.load))
    except ConvergenceError as error:
        if partial is None or last is None:
            raise
        write_dataset(_history(problem, recorder, last).assign_attrs(incomplete=str(error)), partial, scene)
        raise ConvergenceError(
            f"{str(error).rstrip('.')}. The history up to load factor {last.load:.4g} is in {partial}"
        ) from None
    history = _history(problem, recorder, last)
    if checkpoint:
        checkpoint.remove()
    if partial:
        partial.unlink(missing_ok=True)
    return history


def _record(problem: Problem, recorder: Recorder, increment: Increment) -> None:
    """Add what all observers see of a converged increment to the history, and a line to the log."""
    columns, points = {}, {}
    for observer in problem.observers:
        seen, touching = observer.record(increment)
        if twice := columns.keys() & seen.keys():
            raise DataFileError(f"two observers report {min(twice)!r}: leave it to one of them")
        columns |= seen
        points |= touching
    recorder.add(increment, columns, points)
    gap = columns.get("smallest_gap", np.nan)
    log.info(
        "increment %d: %s, force %.6g N, %d Newton and %d Krylov iterations, residual %.1e%s",
        increment.index,
        place(problem.scene.load, increment.load),
        recorder.columns["force"][-1],
        increment.newton_iterations,
        increment.krylov_iterations,
        increment.residual,
        f", smallest gap {gap:.3g} m" if np.isfinite(gap) else "",
    )


def _history(problem: Problem, recorder: Recorder, last: Increment) -> xr.Dataset:
    """Return the history so far, with the fields of the last increment if asked for."""
    scene, solver = problem.scene, problem.solver
    fields = problem.fields(last.state) if problem.fields else {}
    return recorder.to_dataset(
        problem.constants | fields,
        scene=scene.name,
        scene_hash=scene.hash,
        fidelity=scene.fidelity,
        interaction=scene.interaction,
        unknowns=problem.model.size - len(problem.prescribed.fixed),
        linear_solver=type(getattr(solver, "preconditioner", solver)).__name__,
        linear_setups=getattr(solver, "setups", 0),
        **problem.attributes,
    )
