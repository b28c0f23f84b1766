"""From scenes to their results in one call: one scene, or many side by side."""

from __future__ import annotations

import logging
import os
import signal
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from knitstudy.errors import ConfigurationError, KnitstudyError
from knitstudy.interruption import end_with_parent
from knitstudy.knit.loading.run import silent
from knitstudy.knit.scene.documents import CONFIG
from knitstudy.knit.scene.scene import Scene, unit_warnings
from knitstudy.mechanics.core.batches import VARIABLE, threads
from knitstudy.run.plan import Plan, Step, with_digits
from knitstudy.run.store import OF_STUDY, BeginProgress, Store, warn_of_another

if TYPE_CHECKING:  # the workflow needs no dataset, and starts in half the time
    import xarray as xr

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Results:
    """All that a simulation gives, in the formats of docs/reference/files.md.

    Files have the name of the scene; only solid yarns have a `mesh`. `contacts` are at the crossings of solid yarns;
    for a reduced model, they are the contacts that its joints come from. `path` is the file of the history.
    """

    scene: Scene
    geometry: xr.Dataset
    history: xr.Dataset
    mesh: xr.Dataset | None = None
    contacts: xr.Dataset | None = None
    path: Path | None = None

    def _repr_html_(self) -> str:
        """Notebooks show the name and the history."""
        return f"<b>{self.scene.name}</b>{self.history._repr_html_()}"


def simulate(
    scene: Scene,
    folder: Path | str | None = None,
    *,
    config: Path = CONFIG,
    progress: BeginProgress | None = None,
    force: bool = False,
    plan: Plan | None = None,
) -> Results:
    """Simulate a scene, and before it whatever it takes joints or springs from.

    Parameters
    ----------
    scene : Scene
        Of the configuration (`knitstudy.run.configuration.load_scene`), or a changed one (`Scene.vary`). Other keys
        under a name of the configuration, or none, get a name of their own. If the geometry of a reduced model has
        changed, so has that of the simulations that its joints and springs come from; their other keys are their own.
    folder : Path or str, optional
        Where results, and files for other programs that the scene's outputs ask for, are kept, and taken from if they
        are up to date; restart files of runs that were ended lie in its folder ``restart``. Results of a study in the
        working folder are taken as well. Without it, all stays in memory.
    config, plan
        Configuration folder that names of other scenes refer to; its plan, where it has been read already.
    progress : callable, optional
        Called with the label of a stage, returns the receiver of its progress; for example
        `knitstudy.knit.loading.run.Progress`, which prints lines with the time left.
    force : bool
        Simulate the scene even if its result is there.

    Raises
    ------
    KnitstudyError
        Where a stage ends in an error; earlier results stay.
    ConvergenceError
        Where the simulation ends before full load. The history so far is its attribute `history`, and in a file of
        the folder.
    """
    plan = plan or Plan.of(config)
    scene = plan.labelled(scene)
    steps = plan.steps_of(scene)
    kept = None if folder is None else Path(folder)
    store = Store(kept, (OF_STUDY,) if kept else (), progress or (lambda label: silent))
    for warning in unit_warnings(scene):
        log.warning(warning)
    path = kept and kept / steps["simulation"].path
    if path and scene.name not in plan.configured and (force or not store.holds(steps["simulation"])):
        warn_of_another(scene, path)
    history = store.get(steps["simulation"], force)
    taken = {**steps["simulation"].needs, **steps}
    beside = {name: store.get(taken[name]) for name in ("geometry", "mesh", "contacts") if name in taken}
    if kept:
        _write_other_files(store, steps.values())
    return Results(scene, history=history, **beside, path=path)


def _write_other_files(store: Store, steps: Iterable[Step]) -> None:
    """Write the files for other programs that a scene's outputs ask for."""
    for step in steps:
        if step.wanted and not step.stage.is_dataset:
            store.get(step)


def simulate_many(
    scenes: Iterable[Scene],
    folder: Path | str = "runs",
    *,
    jobs: int | None = None,
    errors: Literal["raise", "coerce"] = "raise",
    config: Path = CONFIG,
) -> list[Results | None]:
    """Simulate scenes side by side with a progress bar, and return their results in the same order.

    Results are kept and taken as by `simulate`; where scenes share a name, digits of their hash follow it.

    Parameters
    ----------
    jobs : int, optional
        Processes, by default one a core; they share the threads that OMP_NUM_THREADS allows.
    errors : str
        "raise": once all others are done, a KnitstudyError names the scenes that failed. "coerce": None stands there.
        Every failure is a warning as well.
    """
    from rich.console import Console
    from rich.progress import track

    import knitstudy.knit.simulate  # noqa: F401  # once for all processes

    if (jobs or 1) < 1 or errors not in ("raise", "coerce"):
        wanted = "must be 1 or more, and raise or coerce"
        raise ConfigurationError(f"jobs is {jobs} and errors is {errors!r} but they {wanted}")
    plan = Plan.of(config)
    scenes = [plan.labelled(scene) for scene in scenes]
    names = Counter(name for name, _ in {(scene.name, scene.hash) for scene in scenes})
    scenes = [with_digits(scene) if names[scene.name] > 1 else scene for scene in scenes]
    different = list(dict.fromkeys(scenes))
    with processes(len(different), jobs) as pool:  # they begin before the thread of the bar
        done = pool.map(partial(_results_or_reason, folder=folder, config=config), different)
        bar = track(done, f"{len(different)} scenes", len(different), console=Console(stderr=True))
        ended = dict(zip(different, bar, strict=True))
    failed = {scene.name: end for scene, end in ended.items() if isinstance(end, str)}
    _report_failed(failed, len(scenes), folder, errors)
    return [None if isinstance(end := ended[scene], str) else end for scene in scenes]


def _report_failed(
    failed: Mapping[str, str], count: int, folder: Path | str, errors: Literal["raise", "coerce"]
) -> None:
    """Warn of every scene that failed, of so many, with the reason; raise KnitstudyError unless errors are coerced."""
    for name, reason in failed.items():
        log.warning("%s: %s", name, reason)
    if failed and errors != "coerce":
        these = f"{len(failed)} of {count} scenes failed, {', '.join(failed)}"
        raise KnitstudyError(f"{these}: {next(iter(failed.values()))}; the others are in {folder}")


@contextmanager
def processes(
    tasks: int, jobs: int | None = None, remedy: str = "take fewer jobs, or smaller scenes"
) -> Iterator[ProcessPoolExecutor]:
    """Yield as many processes as there are tasks, or `jobs`, by default one a core; they know all that was made before.

    Raises KnitstudyError, with a remedy, where the system ends one.
    """
    jobs = min(jobs or os.cpu_count() or 1, tasks) or 1
    pool = ProcessPoolExecutor(jobs, get_context("fork"), _begin, (max(threads() // jobs, 1),))
    try:
        yield pool
    except BrokenProcessPool:
        why = "the system ended a process, perhaps for its memory"
        raise KnitstudyError(f"{why}: {remedy}; what is done is kept") from None
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(threads: int) -> None:
    """Begin a process: Ctrl-C and the end of its parent end it, and it has its share of the threads."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    end_with_parent()
    os.environ[VARIABLE] = str(threads)


def _results_or_reason(scene: Scene, folder: Path | str, config: Path) -> Results | str:
    """Return the results of a scene, or why there are none."""
    try:
        return simulate(scene, folder, config=config)
    except Exception as error:  # whatever it is: the others go on
        return f"{type(error).__name__}: {error}"
