"""The numbers of a sheet, a row each, from histories of its paths: construction, thickness, loads and bending."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import isnan, nan

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.datasets import STRAINS
from knitstudy.knit.models.beam import CellOfBeams
from knitstudy.measures.construction import at_rest
from knitstudy.mechanics.core.arrays import Floats
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

PRESS = "press"
BOTH = "both ways"  # name of loads with both strains prescribed, before their ratio
PERCENT = 100.0  # over 1
SHARES = (0.1, 0.2, 0.5, 1.0)  # of the largest force, at which strains are given
SHEAR, SHEARED = 0.1, 0.01  # largest angle of shear, and that of the stiffness
# Curvatures [1/m] of the slope, and in the middle of the hysteresis: those of KES-FB2
BENT = (50.0, 100.0, 150.0)
SAME = 1e-9  # of a value: others that are as near differ by rounding alone, and say nothing of it
NOT_KNOWN, GIVEN = "not known", "given"
SLACK = "slack, or the path ended early: see the notes"
STIFFNESS = "bending stiffness, {}"
NEEDS_TEX = ("tightness factor", "mass per area")
SPACINGS = ("wales per cm", "courses per cm", "stitch density")
LENGTH = "length of yarn in a stitch"
THICKNESS_ERROR = 0.012  # of beams of 0.9 radii against 0.45 (docs/notes/beams.md, between plates)


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


def _unreached(curve: pd.DataFrame, of: str, value: float) -> str:
    """Return how far a curve goes where a column does not reach a value, in words; else an empty text."""
    return "" if _reached(curve, of, value) else f"the path ends at {curve[of].max():.3g}"


def energy_to(curve: pd.DataFrame, along: str, of: str, value: float) -> float:
    """Return the energy where a force over a strain, or a pressure over a thickness, first reaches a value."""
    until = when(curve, along, of, value)
    if isnan(until):
        return nan
    last = curve.iloc[_reached(curve, of, value) - 1]
    way = abs(until - last[along]) * (1e-3 if along == THICKNESS else 1.0)
    return float(last[ENERGY] + 0.5 * (last[of] + value) * way)


def _row(
    quantity: str, values: Iterable[float], unit: str, remark: str = "", least: float = 0.0
) -> list[str]:
    """Return a row of the table of a value and others, whose largest difference is its uncertainty if they differ.

    `least` is the smallest uncertainty, a share of the value.
    """
    value, *others = values
    apart = float(np.max([abs(other - value) for other in others] or [0.0]))
    apart = apart if isnan(apart) else max(apart, least * abs(value))
    apart = apart if apart > SAME * abs(value) else nan
    texts = [NOT_KNOWN if isnan(x) else f"{x:.{digits}g}" for x, digits in ((value, 4), (apart, 2))]
    return [quantity, *texts, unit, remark]


def given_numbers(cell: CellOfBeams) -> set[str]:
    """Return the names of the numbers of the construction that follow from the keys of the scene, without mechanics.

    Spacings are given if the fabric starts from its drawn loops. The yarn in a stitch is given if the scene sets
    `pattern.loop_length`, or control points that do not move; a loop drawn for its spacings alone has the length of
    least bending.
    """
    pattern = cell.pattern
    given = set[str]()
    if cell.load.start == "drawn":
        given |= {*SPACINGS}
    if pattern.loop_length is not None or (
        pattern.control_points is not None and not any(cell.geometry.free)
    ):
        given |= {LENGTH, "tightness factor"}
    return given | {"mass per area"} if given >= {*SPACINGS, LENGTH} else given


def construction_rows(
    cell: CellOfBeams, histories: Iterable[xr.Dataset], tex: Floats | float
) -> list[list[str]]:
    """Return the construction at rest, of one start and the other."""
    size = cell.pattern.loops, cell.pattern.rows, cell.radius
    starts = [{number.name: number for number in at_rest(history, *size, tex)} for history in histories]
    rows = []
    given = given_numbers(cell)
    for name, number in starts[0].items():
        values = [float(start[name].value) for start in starts]
        error = THICKNESS_ERROR if name == "thickness" else 0.0
        quantity, value, uncertainty, *about = _row(name, values, number.unit, least=error)
        rows.append([quantity, value, GIVEN if name in given else uncertainty, *about])
    rows += [
        _row(name, [nan], "", "rows differ" if np.all(np.isfinite(tex)) else "needs the tex of the yarn")
        for name in NEEDS_TEX
        if name not in starts[0]
    ]
    return rows


def thickness_rows(curves: Sequence[pd.DataFrame], pressures: Iterable[float]) -> list[list[str]]:
    """Return the thickness between plates at pressures [Pa], and the work up to there."""
    numbers = (
        ("thickness at", when, "mm", THICKNESS_ERROR),
        ("energy of pressing to", energy_to, "J/m2", 0.0),
    )
    return [
        _row(
            f"{what} {p:g} Pa", [number(curve, THICKNESS, PRESSURE, p) for curve in curves], unit, least=error
        )
        for what, number, unit, error in numbers
        for p in pressures
    ]


def is_slack(sheared: xr.Dataset) -> bool:
    """Return whether nothing but the drag on loose yarns resists the shear of the stiffness: loops do not touch yet."""
    reached = np.flatnonzero(np.abs(sheared["cell_strain"].to_numpy()[:, -1]) >= (1 - SAME) * SHEARED)
    if "energy" not in sheared or not len(reached):
        return False
    energy = sheared["energy"].isel(increment=int(reached[0])).to_series()
    return bool(energy["stabilisation"] > energy.drop(["external", "stabilisation"]).sum())


def load_rows(
    curves: Mapping[str, Sequence[pd.DataFrame]], force: float, slack: bool = False
) -> list[list[str]]:
    """Return what columns of curves are where others reach a value, and the losses of cycles.

    Where shear is `slack`, its stiffness is 0, and that of the drag its uncertainty.
    """

    def row(load: str, quantity: str, unit: str, scale: float, column: str, of: str, value: float) -> None:
        values = [scale * when(curve, column, of, value) for curve in curves[load]]
        rows.append(_row(quantity, values, unit, _unreached(curves[load][0], of, value)))

    rows: list[list[str]] = []
    for way, across in (STRAINS[:2], STRAINS[1::-1]):
        pull = PULL(way)
        for part in (share * force for share in SHARES):
            row(way, f"{way} strain at {part:g} N/m", "%", PERCENT, STRAIN(way), pull, part)
        row(way, f"{across} strain then", "%", PERCENT, STRAIN(across), pull, force)
        energies = [energy_to(curve, STRAIN(way), pull, force) for curve in curves[way]]
        unreached = _unreached(curves[way][0], pull, force)
        rows.append(_row(f"{way} energy to {force:g} N/m", energies, "J/m2", unreached))
        forces = force_over_strain(curves[way][0], way)
        loss = loss_of_cycle(forces)
        carries = forces.iloc[-1] > 0
        what = f"of {loss.work:.3g} J/m2, to {loss.peak:.3g} N/m and back" if loss else "it did not come back"
        rows.append(_row(f"{way} loss of a cycle", [PERCENT * loss.share if loss else nan], "%", what))
        what = "or less: the way back ends there" if carries else "least width of the band at rest"
        rows.append(_row(f"{way} strain that a cycle leaves", [PERCENT * left_by_cycle(forces)], "%", what))
    pull = PULL("course")
    for load in (load for load in curves if load not in (*STRAINS, PRESS)):
        row(load, f"{load}, course strain at {force:g} N/m", "%", PERCENT, STRAIN("course"), pull, force)
        row(load, f"{load}, wale force per width then", "N/m", 1.0, PULL("wale"), pull, force)
    stiffness = f"shear stiffness at {SHEARED:g} rad"
    if slack:
        drag = when(curves["shear"][0], PULL("shear"), STRAIN("shear"), SHEARED) / SHEARED
        remark = "slack: loops do not touch, and the drag of the computation alone resists"
        rows.append(_row(stiffness, [0.0, drag], "N/m", remark))
    else:
        row("shear", stiffness, "N/m", 1 / SHEARED, PULL("shear"), STRAIN("shear"), SHEARED)
    return rows


def bending_rows(bent: Sequence[xr.Dataset], error: float, tied: xr.Dataset | None) -> list[list[str]]:
    """Return bending and curling: from both starts, and of tied yarns at their drawn loops.

    Starts other than the first are bent to the front alone: what their slope there differs by is the uncertainty.
    """
    rows = []
    units = ("N m", "N m", "N", "J/m2", "N")
    for k, way in enumerate(STRAINS[:2]):
        starts = [_bent(each.isel(direction=k)) for each in bent]
        fronts = [_slope(_legs(each.isel(direction=k))[0]) for each in bent]
        for (name, (value, remark)), unit in zip(starts[0].items(), units, strict=True):
            others = [start[name][0] for start in starts[1:]]
            if name == STIFFNESS:
                others = [value + front - fronts[0] for front in fronts[1:]]
            others += [(1 + error) * value] if error else []
            values = [value, *(other for other in others if not isnan(other))]
            rows.append(_row(name.format(way), values, unit, SLACK if isnan(value) else remark))
    if tied is not None:
        matrix = section_matrix(tied)
        drawn = "drawn loops"
        front = "tension in front where positive"
        for k, way in enumerate(STRAINS[:2]):
            rows.append(_row(f"bending stiffness, {way}, yarns tied", [matrix[3 + k, 3 + k]], "N m", drawn))
            rows.append(
                _row(f"moment at 1 % strain, {way}, yarns tied", [0.01 * matrix[k, 3 + k]], "N", front)
            )
    return rows


def _legs(bent: xr.Dataset) -> list[pd.DataFrame]:
    """Return the legs of bending in one direction: to the front, from there to the back, and from there to flat.

    Later branches of a partial path, or of a path that does not turn, have one row or none.
    """
    curve = bent[["curvature", "moment_per_width", "friction_per_area"]].to_pandas().dropna()
    turn, back = (int(pick(curve["curvature"])) if len(curve) else 0 for pick in (np.argmax, np.argmin))
    back = max(turn, back)
    return [curve[: turn + 1], curve[turn : back + 1], curve[back:]]


def _moment(leg: pd.DataFrame, curvature: float) -> float:
    """Return the moment per width of a leg at a curvature [1/m]; nan where the leg does not reach it."""
    ordered = leg.sort_values("curvature")
    moments = (
        np.interp(curvature, ordered["curvature"], ordered["moment_per_width"], left=nan, right=nan)
        if len(ordered)
        else nan
    )
    return float(moments)


def _slope(leg: pd.DataFrame, side: float = 1.0) -> float:
    """Return the slope of the moment of a leg that bends to the front (1) or to the back (-1), as KES-FB2 takes it."""
    low, high = (_moment(leg, side * curvature) for curvature in BENT[::2])
    return side * (high - low) / (BENT[2] - BENT[0])


def _bent(bent: xr.Dataset) -> dict[str, tuple[float, str]]:
    """Return numbers and remarks of bending in one direction, nan where the cell is slack or the path ended before.

    Slope and hysteresis are means of front and back, as those of the KES-FB2 tester are.
    """
    legs = front, through, home = _legs(bent)
    slopes = np.array([_slope(front), _slope(through, -1.0)])
    between = f"{BENT[0]:g} to {BENT[2]:g} 1/m"
    sides = "mean of front and back" if np.isfinite(slopes).all() else "of the front alone"
    at = BENT[1]
    loss = legs[-1]["friction_per_area"]
    lost = np.array([_moment(front, at) - _moment(through, at), _moment(home, -at) - _moment(through, -at)])
    slack = nan if isnan(_moment(front, BENT[0])) else 1.0
    moments = np.concatenate([leg["moment_per_width"] for leg in legs])
    flat = float(moments[0]) if len(moments) else nan
    flat = 0.0 if abs(flat) <= SAME * np.max(np.abs(moments), initial=0.0) else flat
    return {
        STIFFNESS: (float(slopes[0] if isnan(slopes[1]) else slopes.mean()), f"{between}, {sides}"),
        "bending stiffness at first, {}": (
            slack * float(bent["first_bending_stiffness"]),
            "yarns that touch stick",
        ),
        "bending hysteresis, {}": (float(lost.mean()), f"at {at:g} 1/m, mean of front and back"),
        "bending loss of a cycle, {}": (
            nan if isnan(lost[1]) else float(loss.iloc[-1]),
            "between 250 and -250 1/m",
        ),
        "curling moment at rest, {}": (slack * flat, "holds the fabric flat"),
    }
