"""Questions about a knit, and the quantities that answer them by each model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from knitstudy.knit.scene.kinds import MODELS
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.sections import Pattern
from knitstudy.measures.centre_cell import centre_cell
from knitstudy.measures.estimate import UNKNOWN, Estimate
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import (
    FORCE,
    LARGEST_U_Z,
    NORMAL,
    QUANTITIES,
    RMS_U_Z,
    SLIP,
    TANGENTIAL,
    Values,
    at_strain,
)

TOTAL, BEAM_SLIP = "mean force of a crossing", "mean slip of a crossing of beams"
PRESSURE = "mean normal stress of a contact"
LOSS = "work lost in a cycle"
ZONES = 4  # Crossings of a cell: they are numbered row by row, column by column, zone by zone


@dataclass(frozen=True)
class Question:
    """A question (``ask.question``), and the quantities that answer it by the fidelities that can."""

    name: str
    words: str
    by: Mapping[str, tuple[str, ...]]


_SOLIDS = tuple(name for name, model in MODELS.all().items() if model.solid)
_ALL = MODELS.names()

SHARES = tuple(round(0.1 * tenth, 1) for tenth in range(1, 11))
"""Shares of the strain at which a curve is compared."""

BEGINS = (
    0.1  # of the force at full load: curves are compared above it, since slack yarns carry nearly no force
)


def curve_force(share: float) -> str:
    """Return the name of the force at a share of the strain."""
    return FORCE if share == 1.0 else f"{FORCE} at {share:.0%} of the strain"


CURVE = tuple(map(curve_force, SHARES))

# By name.
QUESTIONS: dict[str, Question] = {
    question.name: question
    for question in (
        Question("force", "force at full load", dict.fromkeys(_ALL, (FORCE,))),
        Question("curve", "force, whole curve", dict.fromkeys(_ALL, CURVE)),
        Question(
            "out_of_plane",
            "out-of-plane motion",
            dict.fromkeys((*_SOLIDS, "rom3d", "beam"), (LARGEST_U_Z, RMS_U_Z)),
        ),
        Question(
            "contact",
            "contact force and slip",
            dict.fromkeys(_SOLIDS, (NORMAL, TANGENTIAL, SLIP)) | {"beam": (TOTAL, BEAM_SLIP)},
        ),
        Question("stress", "normal stress at a contact", dict.fromkeys(_SOLIDS, (PRESSURE,))),
        Question("loss", LOSS, dict.fromkeys((*_SOLIDS, "beam"), (LOSS,))),
    )
}


def answers(
    question: Question, scene: Scene, history: xr.Dataset, contacts: xr.Dataset | None, strain: float
) -> dict[str, float]:
    """Return the quantities that answer a question at a strain of the history; none where a model cannot.

    Slip is an answer for friction only. Contacts come from a direct simulation. Where the load turns back, the work
    that does not come back is the only answer.
    """
    cycle = bool(scene.value("load.turns"))
    if cycle != (LOSS in question.by.get(scene.fidelity, ())):
        return {}
    if cycle:  # up to where the force ends: to press the cell further back takes work again
        turn = int(history["strain"].to_numpy().argmax())
        return {LOSS: float(history["energy"].sel(form="external")[turn:].min())}
    wanted = _wanted(question, scene, contacts is not None)
    both = history, history if contacts is None else contacts  # without contacts the history alone is read
    values = {name: _VALUES[name](*both) for name in wanted if name in _VALUES}
    for name in wanted:
        if name in _OF_BEAMS and _OF_BEAMS[name] in history:  # cells of beams do not say
            values[name] = _of_beams(history[_OF_BEAMS[name]].to_numpy(), scene.value("pattern"))
    answered = {name: at_strain(history, strain, series) for name, series in values.items()}
    if question.name == "curve":
        curve = PchipInterpolator(history["strain"], history["force"])
        answered |= {curve_force(share): float(curve(share * strain)) for share in SHARES[:-1]}
    return answered


def _wanted(question: Question, scene: Scene, has_contacts: bool) -> list[str]:
    """Return the quantities that a scene can answer a question by."""
    wanted = [*question.by.get(scene.fidelity, ())]
    if scene.interaction != "isotropic":
        wanted = [name for name in wanted if name not in (SLIP, BEAM_SLIP)]
    if scene.fidelity in _SOLIDS and not has_contacts:
        wanted = [name for name in wanted if name in (FORCE, LARGEST_U_Z, RMS_U_Z)]
    return wanted


def known(reference: Reference, quantity: str, strain: float) -> Estimate:
    """Return the reference value of a quantity; unknown: none, zero, or a force of a curve below its share `BEGINS`.

    The mean force of a crossing follows from the means of its normal and tangential part: the four crossings of a cell
    are alike within 0.3 % in direct simulations with ties and friction.
    """
    if quantity == TOTAL:
        parts = [reference.at(name, strain) for name in (NORMAL, TANGENTIAL)]
        if not all(part.known for part in parts):
            return UNKNOWN
        value = hypot(*(part.value for part in parts))
        if value == 0:
            return UNKNOWN
        return Estimate(value, hypot(*(part.uncertainty * part.value / value for part in parts)))
    estimate = reference.at(SLIP if quantity == BEAM_SLIP else quantity, strain)
    least = BEGINS * reference.at(FORCE, strain).value if quantity in CURVE[:-1] else 0.0
    return estimate if estimate.known and estimate.value > least else UNKNOWN


def _pressure(history: xr.Dataset, contacts: xr.Dataset) -> np.ndarray:
    """Return the normal force of the centre cell's contacts over their area (I,) [Pa], 0 where none touches."""
    here = centre_cell(contacts)
    force = np.linalg.norm(contacts["normal_resultant"].to_numpy()[:, here], axis=-1).sum(axis=1)
    area = contacts["contact_area"].to_numpy()[:, here].sum(axis=1)
    return np.divide(force, area, out=np.zeros_like(force), where=area > 0)


def _of_beams(values: np.ndarray, pattern: Pattern) -> np.ndarray:
    """Return the mean size (I,) over the crossings of the centre cell of values (I, k, ...) at all crossings."""
    middle = (pattern.rows // 2) * pattern.loops + pattern.loops // 2
    values = values[:, ZONES * middle : ZONES * (middle + 1)]
    return (np.linalg.norm(values, axis=-1) if values.ndim == 3 else np.nan_to_num(values)).mean(axis=1)


_VALUES: dict[str, Values] = {name: values for name, (_, values) in QUANTITIES.items()} | {
    PRESSURE: _pressure
}
_OF_BEAMS = {TOTAL: "crossing_force", BEAM_SLIP: "crossing_slip"}  # Variables of their histories
