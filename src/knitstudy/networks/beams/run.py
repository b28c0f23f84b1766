"""Pulls a knit of beams in contact and records its history, with the solver and the format of the solids."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import xarray as xr

from knitstudy.cost import Meter
from knitstudy.errors import ConvergenceError
from knitstudy.gates.increment import require_sound
from knitstudy.geometry.pattern import Knit
from knitstudy.history import Recorder
from knitstudy.load_path import load_path
from knitstudy.mechanics.increment import Increment, Settings
from knitstudy.mechanics.linear.lu import LU
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.parallel import serial_blas
from knitstudy.networks.beams.build import BeamKnit, build
from knitstudy.networks.beams.crossings import CrossingRecord
from knitstudy.networks.beams.neighbours import Gaps
from knitstudy.networks.rom.grips import grips, tension
from knitstudy.study.scene import Scene

log = logging.getLogger(__name__)

UNSEEN = 0.01
"""Penetration that no contact has seen, over the radius, beyond which a state is refused."""


def run(scene: Scene, knit: Knit, progress: Callable[[Increment], None] | None = None) -> xr.Dataset:
    """Return the history of a scene of fidelity "beam".

    Beside the format of docs/architecture.md it holds, by increment and crossing, `crossing_gap` and `crossing_slip`.

    Parameters
    ----------
    scene : Scene
        What to load and how.
    knit : Knit
        The knit of the scene.
    progress : callable, optional
        Called with every converged increment.

    Raises
    ------
    GeometryError
        If no beams can be made of the yarns.
    ConvergenceError
        If the load cannot be reached, or yarns penetrate each other where no contact is computed.
    """
    meter = Meter()
    beams = build(scene, knit)
    network, model = beams.network, beams.model
    motion = load_path(scene, knit)
    ends = grips(network, knit, scene.load.direction)
    drive = tension(ends, motion, scene.load.lateral)
    driven = 6 * ends.driven[:, None] + np.arange(3)
    recorder = Recorder(network.stations, driven, motion.axis, motion.at, motion.length, meter=meter)
    record = CrossingRecord(beams, knit.crossings, scene)
    # Where contact begins, a parabola through what came before overshoots far into the other yarn.
    settings = replace(Settings.of(scene.solver), predictor=1)
    with serial_blas():
        for increment in trace(model, drive, settings, LU()):
            columns = record.add(increment.state)
            gaps = beams.neighbours.gaps(model.places(increment.state.beams).position)
            displacement = network.station_displacement(model.beams, increment.state.beams)
            smallest = gaps.smallest if np.isfinite(gaps.smallest) else np.nan
            recorder.add(increment, displacement, smallest_gap=smallest, **columns)
            log.info(
                "increment %d: strain %.4f, force %.6g N, %d Newton iterations, smallest gap %.3g R",
                increment.index,
                recorder.columns["strain"][-1],
                recorder.columns["force"][-1],
                increment.newton_iterations,
                smallest / scene.yarn.radius,
            )
            require_seen(beams, gaps, record.gap[-1], increment, scene.yarn.radius)
            require_sound(scene, recorder, increment)
            if progress:
                progress(increment)
    law = model.contact
    history = recorder.to_dataset(
        scene=scene.name,
        scene_hash=scene.hash,
        fidelity=scene.fidelity,
        interaction=scene.interaction,
        dof=model.block * network.beam_nodes,
        unknowns=model.size - len(drive.fixed),
        elements=len(network.ends),
        beam_contact=scene.beam.contact,
        beam_section=scene.beam.section,
        beam_ties=scene.beam.tie,
        contact_coefficient=law.law.coefficient,
        contact_exponent=law.law.exponent,
        stick_stiffness=law.friction.tangential,
        friction=law.friction.friction,
        contact_points=len(law.crossing.weight),
    )
    return history.assign(record.variables())


def require_seen(
    beams: BeamKnit, gaps: Gaps, contact_gap: np.ndarray, increment: Increment, radius: float
) -> None:
    """Refuse a state in which yarns penetrate each other where no contact acts.

    Raises
    ------
    ConvergenceError
        If pieces of yarn away from crossings, at tied crossings, or deeper than the contact at a crossing knows,
        overlap by more than `UNSEEN` radii.
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
