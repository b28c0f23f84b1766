"""Beams in contact under load: the loop and the history of the solids."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from knitstudy.errors import ConvergenceError
from knitstudy.gates.increment import require_sound
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.cost import Meter
from knitstudy.loading.follow import follow
from knitstudy.loading.history import Recorder
from knitstudy.loading.load_path import load_path
from knitstudy.loading.problem import Problem
from knitstudy.loading.run import IN_MEMORY, Run
from knitstudy.mechanics.increment import Increment, Settings
from knitstudy.mechanics.linear.lu import LU
from knitstudy.networks.beams.beam_knit import BeamKnit, beam_knit
from knitstudy.networks.beams.crossings import CrossingRecord
from knitstudy.networks.beams.neighbours import Gaps
from knitstudy.networks.rom.grips import grips, tension
from knitstudy.study.scene import Scene

UNSEEN = 0.02
"""Penetration that no contact has seen, over the radius, beyond which a state is refused.

Beside pins in wale tension beams come to 1 %. Solids that carry what such a crossing does, 10 to 30 N, approach each
other by 5 to 10 % (Hertz), so that this much is no second contact that would carry a share of its own.
"""


def simulate(scene: Scene, geometry: xr.Dataset, run: Run = IN_MEMORY) -> xr.Dataset:
    """Return the history of a scene of fidelity "beam".

    Parameters
    ----------
    scene : Scene
    geometry : Dataset
        Of the scene, in the format of docs/architecture.md.
    run : Run

    Raises
    ------
    GeometryError
        As `problem`.
    ConvergenceError, DataFileError
        As `knitstudy.loading.follow.follow`.
    """
    return follow(problem(scene, Knit.from_dataset(geometry)), run)


def run(scene: Scene, knit: Knit, how: Run = IN_MEMORY) -> xr.Dataset:
    """Return the history of a scene: `problem`, followed; see `simulate`."""
    return follow(problem(scene, knit), how)


def problem(scene: Scene, knit: Knit) -> Problem:
    """Return a scene of fidelity "beam" as a problem.

    Parameters
    ----------
    scene : Scene
        What to load and how.
    knit : Knit
        The knit of the scene.

    Raises
    ------
    GeometryError
        If no beams can be made of the yarns.
    """
    meter = Meter()
    return problem_of(beam_knit(scene, knit), scene, knit, meter)


def problem_of(beams: BeamKnit, scene: Scene, knit: Knit, meter: Meter | None = None) -> Problem:
    """Return beams in contact with the load of a scene, and with what is seen and refused on the way."""
    meter = meter or Meter()
    network, model = beams.network, beams.model
    motion = load_path(scene, knit)
    ends = grips(network, knit, scene.load.direction)
    observer = BeamObserver(beams, knit, scene)
    law = model.contact
    return Problem(
        scene=scene,
        model=model,
        prescribed=tension(ends, motion, scene.load.lateral),
        solver=LU(),
        # Where contact begins, a parabola through what came before overshoots far into the other yarn.
        settings=replace(Settings.of(scene.solver), predictor=1),
        motion=motion,
        driven=6 * ends.driven[:, None] + np.arange(3),
        stations=network.stations,
        observers=(observer,),
        checks=(observer.require_seen, partial(require_sound, scene, None)),
        constants={"crossing_tied": beams.tied.astype(np.int8)},
        attributes={
            "dof": model.block * network.beam_nodes,
            "elements": len(network.ends),
            "beam_contact": scene.beam.contact,
            "beam_section": scene.beam.section,
            "beam_ties": scene.beam.tie,
            "contact_coefficient": law.law.coefficient,
            "contact_exponent": law.law.exponent,
            "stick_stiffness": law.friction.tangential,
            "friction": law.friction.friction,
            "contact_points": len(law.crossing.weight),
        },
        meter=meter,
    )


class BeamObserver:
    """Sees the motion of the stations, what happens at crossings, and gaps of yarns that are near each other.

    Parameters
    ----------
    beams : BeamKnit
    knit : Knit
    scene : Scene
    """

    def __init__(self, beams: BeamKnit, knit: Knit, scene: Scene) -> None:
        self._beams, self._radius = beams, scene.yarn.radius
        self._crossings = CrossingRecord(beams, knit.crossings, scene)
        self._gaps: Gaps | None = None

    def record(self, increment: Increment) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return columns of the history."""
        state, model, network = increment.state, self._beams.model, self._beams.network
        self._gaps = self._beams.neighbours.gaps(model.places(state.beams).position)
        smallest = self._gaps.smallest
        columns = {
            "centreline_displacement": network.station_displacement(model.beams, state.beams),
            "smallest_gap": smallest if np.isfinite(smallest) else np.nan,
            **self._crossings.columns(state),
        }
        return columns, {}

    def require_seen(self, increment: Increment, recorder: Recorder) -> None:
        """Refuse the increment that was recorded last if yarns penetrate each other where no contact acts.

        Raises
        ------
        ConvergenceError
            As the function `require_seen`.
        """
        contact_gap = recorder.columns["crossing_gap"][-1]
        require_seen(self._beams, self._gaps, contact_gap, increment, self._radius)


def require_seen(
    beams: BeamKnit, gaps: Gaps, contact_gap: np.ndarray, increment: Increment, radius: float
) -> None:
    """Refuse a state in which yarns penetrate each other where no contact acts.

    Raises
    ------
    ConvergenceError
        If pieces of yarn away from crossings, or deeper than the contact or the tie at a crossing knows, overlap by
        more than `UNSEEN` radii. A tie that yields lets yarns approach each other as much as their patches are
        indented.
    """
    known = np.minimum(np.where(np.isfinite(contact_gap), contact_gap, 0.0), 0.0)  # (K,)
    unseen = gaps.crossing - known
    if gaps.elsewhere < -UNSEEN * radius:
        (one, other), (s, t) = gaps.yarn, gaps.arc_length
        where = f"yarns {one} and {other} at arc lengths {s:.4g} and {t:.4g} m, which is no crossing,"
        depth = -gaps.elsewhere
    elif unseen.min(initial=np.inf) < -UNSEEN * radius:
        k = int(np.argmin(unseen))
        kind = "tied" if beams.tied[k] else "touching"
        where, depth = f"the yarns of crossing {k}, beside the {kind} points,", -unseen[k]
    else:
        return
    raise ConvergenceError(
        f"increment {increment.index}: {where} penetrate each other by {depth:.3g} m, unseen by the beams' contact; "
        f"allowed is {UNSEEN * radius:.3g} m. Use a smaller load.strain or beam.contact 'line'"
    )
