"""The numbers of a sheet, a row each, from histories of its paths: construction, thickness, loads and bending."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import isnan, nan

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.files import STRAINS
from knitstudy.knit.models.beam import CellOfBeams
from knitstudy.measures.construction import at_rest
from knitstudy.mechanics.arrays import Floats
from knitstudy.use.decks.fabric import section_matrix
from knitstudy.use.measured_curve import (
    ENERGY,
    PRESSURE,
    PULL,
    STRAIN,
    THICKNESS,
    force_over_strain,
    left_by_cycle,
    loss_of_cycle,
)
from knitstudy.use.style import PERCENT

PRESS = "press"
SHEAR, SHEARED = 0.1, 0.01  # largest angle of shear, and that of the stiffness
# Curvatures [1/m] of the slope, and in the middle of the hysteresis: those of KES-FB2
BENT = (50.0, 100.0, 150.0)
SAME = 1e-9  # of a value: others that are as near differ by rounding alone, and say nothing of it
NOT_KNOWN = "not known"
SLACK = "slack, or the path ended early"
NEEDS_TEX = ("tightness factor", "mass per area")
GIVEN = ("length of yarn in a stitch", "tightness factor")  # of the scene: both starts have the same


def when(curve: pd.DataFrame, column: str, of: str, value: float) -> float:
    """Return a column of a curve where another one first reaches a value; nan where it never does.

    Examples
    --------
    >>> when(pd.DataFrame({"strain": [0.0, 0.25, 0.5], "force": [0.0, 2.0, 6.0]}), "strain", "force", 4.0)
    0.375
    """
    if not (reached := _reached(curve, of, value)):
        return nan
    pair = curve.iloc[reached - 1 : reached + 1]
    return float(np.interp(value, pair[of], pair[column]))


def _reached(curve: pd.DataFrame, of: str, value: float) -> int:
    """Return the row in which a column first reaches a value, but for rounding; 0 where it never does."""
    return int(np.argmax(curve[of] >= value - SAME * abs(value)))


def energy_to(curve: pd.DataFrame, along: str, of: str, value: float) -> float:
    """Return the energy where a force over a strain, or a pressure over a thickness, first reaches a value."""
    until = when(curve, along, of, value)
    if isnan(until):
        return nan
    last = curve.iloc[_reached(curve, of, value) - 1]
    way = abs(until - last[along]) * (1e-3 if along == THICKNESS else 1.0)
    return float(last[ENERGY] + 0.5 * (last[of] + value) * way)


def _row(quantity: str, values: Iterable[float], unit: str, remark: str = "") -> list[str]:
    """Return a row of the table of a value and others, whose largest difference is its uncertainty if they differ."""
    value, *others = values
    apart = float(np.max([abs(other - value) for other in others] or [nan]))
    apart = apart if apart > SAME * abs(value) else nan
    texts = [NOT_KNOWN if isnan(x) else f"{x:.{digits}g}" for x, digits in ((value, 4), (apart, 2))]
    return [quantity, *texts, unit, remark]


def construction_rows(
    cell: CellOfBeams, histories: Iterable[xr.Dataset], tex: Floats | float
) -> list[list[str]]:
    """Return the construction at rest, of one start and the other."""
    size = cell.pattern.loops, cell.pattern.rows, cell.radius
    starts = [{number.name: number for number in at_rest(history, *size, tex)} for history in histories]
    rows = []
    for name, number in starts[0].items():
        values = [float(start[name].value) for start in starts]
        quantity, value, uncertainty, *about = _row(name, values, number.unit)
        rows.append([quantity, value, "given" if name in GIVEN else uncertainty, *about])
    rows += [
        _row(name, [nan], "", "rows differ" if np.all(np.isfinite(tex)) else "needs the tex of the yarn")
        for name in NEEDS_TEX
        if name not in starts[0]
    ]
    return rows


def thickness_rows(curves: Sequence[pd.DataFrame], pressures: Iterable[float]) -> list[list[str]]:
    """Return the thickness between plates at pressures [Pa], and the work up to there."""
    numbers = (("thickness at", when, "mm"), ("energy of pressing to", energy_to, "J/m2"))
    return [
        _row(f"{what} {p:g} Pa", [number(curve, THICKNESS, PRESSURE, p) for curve in curves], unit)
        for what, number, unit in numbers
        for p in pressures
    ]


def load_rows(curves: Mapping[str, Sequence[pd.DataFrame]], force: float) -> list[list[str]]:
    """Return what columns of curves are where others reach a value, and the losses of cycles."""

    def row(load: str, quantity: str, unit: str, scale: float, column: str, of: str, value: float) -> None:
        rows.append(_row(quantity, [scale * when(curve, column, of, value) for curve in curves[load]], unit))

    rows: list[list[str]] = []
    for way, across in (STRAINS[:2], STRAINS[1::-1]):
        pull = PULL(way)
        for part in (0.1 * force, 0.5 * force, force):
            row(way, f"{way} strain at {part:g} N/m", "%", PERCENT, STRAIN(way), pull, part)
        row(way, f"{across} strain then", "%", PERCENT, STRAIN(across), pull, force)
        energies = [energy_to(curve, STRAIN(way), pull, force) for curve in curves[way]]
        rows.append(_row(f"{way} energy to {force:g} N/m", energies, "J/m2"))
        forces = force_over_strain(curves[way][0], way)
        loss, carries = loss_of_cycle(forces), forces.iloc[-1] > 0
        what = f"of {loss.work:.3g} J/m2, to {loss.peak:.3g} N/m and back" if loss else "it did not come back"
        rows.append(_row(f"{way} loss of a cycle", [PERCENT * loss.share if loss else nan], "%", what))
        what = "or less: the way back ends there" if carries else "least width of the band at rest"
        rows.append(_row(f"{way} strain that a cycle leaves", [PERCENT * left_by_cycle(forces)], "%", what))
    pull = PULL("course")
    for load in (load for load in curves if load not in (*STRAINS, PRESS)):
        row(load, f"{load}, course strain at {force:g} N/m", "%", PERCENT, STRAIN("course"), pull, force)
        row(load, f"{load}, wale force per width then", "N/m", 1.0, PULL("wale"), pull, force)
    stiffness = f"shear stiffness at {SHEARED:g} rad"
    row("shear", stiffness, "N/m", 1 / SHEARED, PULL("shear"), STRAIN("shear"), SHEARED)
    return rows


def bending_rows(bent: Sequence[xr.Dataset], error: float, tied: xr.Dataset | None) -> list[list[str]]:
    """Return bending and curling: from both starts, and of tied yarns at their drawn loops."""
    rows, units = [], ("N m", "N m", "N", "J/m2", "N")
    for k, way in enumerate(STRAINS[:2]):
        starts = [_bent(each.isel(direction=k)) for each in bent]
        for (name, (value, remark)), unit in zip(starts[0].items(), units, strict=True):
            others = [of[name][0] for of in starts[1:]] + ([(1 + error) * value] if error else [])
            values = [value, *(other for other in others if not isnan(other))]
            rows.append(_row(name.format(way), values, unit, SLACK if isnan(value) else remark))
    if tied is not None:
        matrix, drawn, front = section_matrix(tied), "drawn loops", "tension in front where positive"
        for k, way in enumerate(STRAINS[:2]):
            rows.append(_row(f"bending stiffness, {way}, yarns tied", [matrix[3 + k, 3 + k]], "N m", drawn))
            rows.append(
                _row(f"moment at 1 % strain, {way}, yarns tied", [0.01 * matrix[k, 3 + k]], "N", front)
            )
    return rows


def _bent(bent: xr.Dataset) -> dict[str, tuple[float, str]]:
    """Return numbers and remarks of bending in one direction, nan where the cell is slack or the path ended before."""
    curve = bent[["curvature", "moment_per_width", "friction_per_area"]].to_pandas()
    turn = int(curve["curvature"].argmax()) if len(curve) else 0
    low, middle, high = (when(curve, "moment_per_width", "curvature", at) for at in BENT)
    back = when(-curve[turn:], "moment_per_width", "curvature", -BENT[1])
    first = float(bent["first_bending_stiffness"])
    slack = nan if isnan(low) else 1.0
    return {
        "bending stiffness, {}": ((high - low) / (BENT[2] - BENT[0]), f"{BENT[0]:g} to {BENT[2]:g} 1/m"),
        "bending stiffness at first, {}": (slack * first, "yarns that touch stick"),
        "bending hysteresis, {}": (middle + back, f"there less back at {BENT[1]:g} 1/m"),
        "bending loss of a cycle, {}": (
            nan if isnan(back) else float(curve["friction_per_area"].iloc[-1]),
            "between 250 and -250 1/m",
        ),
        "curling moment at rest, {}": (
            slack * float(curve["moment_per_width"].iloc[0]),
            "holds the fabric flat",
        ),
    }
