"""Measured and predicted fabrics: strips between clamps, as membranes with the law of the fabric's cells.

A strip that is pulled along one axis is in states between the states of two cells: its clamps hold the width, and its
middle is free. At a strain e along, W is taken as quadratic in the strain l across,

    W(e, l) = W_free(e) + k(e) (l - l_free(e))^2 / 2 + G g^2 / 2,

where k is the force across of the cell whose width is held, over the strain across of the free one, and G the shear
modulus of the cell at rest. The force along of the held cell is not used.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from scipy.interpolate import BSpline

from knitstudy.errors import ConvergenceError, DataFileError
from knitstudy.knit.loading.history import DIRECTIONS
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.run.catalogue import TABLES, Datasets, several
from knitstudy.use.fabric_law import strain_at, stretch_strip
from knitstudy.use.membrane_law import MembraneLaw, Parts

log = logging.getLogger(__name__)

FORCES = (0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3)  # N/mm
JUDGED = slice(1, 6)  # of them: 0.05 to 0.25 N/mm
KNOTS, ELEMENTS = 30, 8
CELLS = several("simulation", "fabric-*", fewest=5)
UNKNOWNS = RESOURCES / "unknowns.csv"  # `benchmarks/widen.py`; of garter and of rib, whose values seed takes
SMALL = 2e-3  # strain across below which forces give no stiffness


@dataclass(frozen=True, eq=False)
class Pulled:
    """Strains along (n,) of a cell, rising, with strains across and forces per width along and across [N/m]."""

    along: Floats
    across: Floats
    force: Floats
    force_across: Floats

    @classmethod
    def of(cls, history: xr.Dataset, direction: str) -> Pulled:
        """Return the states of a cell that was pulled in a direction; a snap is crossed at constant force."""
        axis = DIRECTIONS.index(direction)
        strain, force = (history[name].to_numpy() for name in ("cell_strain", "force_per_width"))
        rising = np.append(True, force[1:, axis] > np.maximum.accumulate(force[:, axis])[:-1])
        return cls(*(values[rising, i] for values in (strain, force) for i in (axis, 1 - axis)))

    @property
    def strain(self) -> Floats:
        """Strains at `FORCES`; nan beyond the largest force."""
        return np.interp(FORCES, self.force / 1e3, self.along, right=np.nan)


@dataclass(frozen=True, eq=False)
class StripLaw(MembraneLaw):
    """The energy above; `force`, `across` and `stiffness` are curves over the strain along."""

    axis: int  # along
    force: BSpline
    across: BSpline
    stiffness: BSpline
    shear: float  # G [N/m]

    @classmethod
    def of(cls, free: Pulled, held: Pulled, axis: int, shear: float) -> StripLaw:
        """Return the law of a fabric that is pulled along an axis, from its two cells."""
        apart = np.interp(held.along, free.along, free.across)
        strained = np.abs(apart) > SMALL
        stiffness = -held.force_across[strained] / apart[strained]
        return cls(
            axis,
            _curve(free.along, free.force),
            _curve(free.along, free.across),
            _curve(held.along[strained], stiffness, before=0.0),
            shear,
        )

    def respond(self, strain: Floats) -> Parts:
        """Return energy, stress and tangent at strains (..., 3)."""
        a = self.axis
        b = 1 - self.axis
        one, two = np.sqrt(1 + 2 * strain[..., a]), np.sqrt(1 + 2 * strain[..., b])
        (T, dT), (f, df, ddf), (k, dk, ddk) = (
            [curve(one - 1, i) for i in range(many)]
            for curve, many in ((self.force, 2), (self.across, 3), (self.stiffness, 3))
        )
        r = two - 1 - f
        along = T + dk * r**2 / 2 - k * df * r
        across = k * r
        stress = np.stack([along / one, across / two, self.shear * strain[..., 2]], axis=-1)
        tangent = np.zeros((*strain.shape, 3))
        tangent[..., 0, 0] = (
            dT + ddk * r**2 / 2 - (2 * dk * df + k * ddf) * r + k * df**2 - along / one
        ) / one**2
        tangent[..., 1, 1] = (k - across / two) / two**2
        tangent[..., 0, 1] = tangent[..., 1, 0] = (dk * r - k * df) / one / two
        tangent[..., 2, 2] = self.shear
        order = [a, b, 2]
        work = self.force.antiderivative()
        energy = work(one - 1) - work(0) + k * r**2 / 2 + self.shear * strain[..., 2] ** 2 / 2
        return energy, stress[..., order], tangent[..., order, :][..., order]


def _curve(x: Floats, y: Floats, before: float = 1.0) -> BSpline:
    """Return a smooth curve near values (n,), straight beyond the last and, times a share, before the first.

    A cubic spline with values as coefficients at the means of its knots turns no more often than they do (Schoenberg).
    """
    parts = (np.diff(values, prepend=values[0]) / (np.ptp(values) or 1.0) for values in (x, y))
    path = np.cumsum(np.hypot(*parts))
    at = np.linspace(0, path[-1], KNOTS)
    x, y = (np.interp(at, path, values) for values in (x, y))
    first, last = (np.diff(y) / np.diff(x))[[0, -1]]
    x = np.r_[x[0] - 1, x, x[-1] + 4]
    y = np.r_[y[0] - before * first, y, y[-1] + 4 * last]
    knots = np.concatenate([[x[0]] * 3, x, [x[-1]] * 3])
    means = (knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3
    return BSpline(knots, np.interp(means, x, y), 3)


@dataclass(frozen=True, eq=False)
class Strip:
    """Strains at `FORCES` of a strip between clamps; nan where its cells were not strained that far."""

    strain: Floats
    clamps: Floats  # by how much strips of half and twice the length differ from it, the larger one
    loose: Floats  # relative change of the free cell's strains after a relaxation without friction


def strip_of(
    cells: Mapping[str, Pulled], sheared: xr.Dataset, yarn: str, stitch: str, direction: str
) -> Strip:
    """Return the strip of the specimen's size from cells by their names: free, held and, perhaps, loose."""
    axis = DIRECTIONS.index(direction)
    free = cells["free"]
    held = cells["held"]
    shear = sheared["force_per_width"].to_numpy()[-1, 2] / sheared["cell_strain"].to_numpy()[-1, 2]
    law = StripLaw.of(free, held, axis, float(shear))
    force = 1e3 * np.array(FORCES)
    size = measured("sizes", yarn=yarn, stitch=stitch, direction=direction)
    length, width = (size[name].iloc[0] / 1e3 for name in ("clamp_distance_mm", "width_mm"))

    def strain(times: float) -> Floats:
        far = np.nanmax(free.strain)
        size = (times * length, width)
        try:
            strip = stretch_strip(law, *size, far, axis, elements=ELEMENTS, largest_force=force[-1])
        except ConvergenceError as error:
            log.warning("%s; beyond it the share of the free cell stays the same", error)
            strip = error.history
        share = (strain_at(strip, force) - held.strain) / (free.strain - held.strain)
        return held.strain + pd.Series(share).ffill().to_numpy() * (free.strain - held.strain)

    between, *others = (strain(times) for times in (1.0, 0.5, 2.0))
    loose = cells["loose"].strain / free.strain - 1 if "loose" in cells else np.zeros(len(FORCES))
    return Strip(between, np.max(np.abs(np.array(others) - between), axis=0), loose)


def measured(name: str, **of: str) -> pd.DataFrame:
    """Return the rows of a file of ``resources/measured`` by values of columns; DataFileError if there are none."""
    table = pd.read_csv(RESOURCES / "measured" / f"{name}.csv")
    table = table[(table[list(of)] == pd.Series(of)).all(axis=1)]
    if table.empty:
        raise DataFileError(f"resources/measured/{name}.csv: has no row of {', '.join(of.values())}")
    return table


def measured_strain(yarn: str, direction: str) -> Floats:
    """Return the measured strains of stockinette at `FORCES`."""
    table = measured(FITTED, yarn=yarn, direction=direction)
    strain: Floats = np.interp(FORCES, table["force_per_width_N_mm"], table["strain"], right=np.nan)
    return strain


FITTED = "stockinette"  # the only stitch whose curves have a say in values of yarns
WITHDRAWN = (("rib", "wale"), ("seed", "course"), ("seed", "wale"))
"""Stitches and directions whose intervals do not hold, by the rule of docs/notes/fabrics.md."""


def _strips(cells: Mapping[str, xr.Dataset]) -> dict[tuple[str, str, str], Strip]:
    """Return strips by yarn, stitch and direction, where cells are there, free and held, and sheared."""
    strips = {}
    for yarn, stitch in dict.fromkeys(tuple(name.split("-")[1:3]) for name in cells):
        for direction in DIRECTIONS:
            names = {name.split("-")[-1]: name for name in cells if f"-{yarn}-{stitch}-{direction}-" in name}
            sheared = f"fabric-{yarn}-{stitch}-shear-free"
            if {"free", "held"} <= set(names) and sheared in cells:
                pulled = {other: Pulled.of(cells[name], direction) for other, name in names.items()}
                strips[yarn, stitch, direction] = strip_of(pulled, cells[sheared], yarn, stitch, direction)
    return strips


def predicted(cells: Mapping[str, xr.Dataset]) -> pd.DataFrame:
    """Return strains of all fabrics whose cells are there, at `FORCES`, and how low or high they may be.

    Cells are histories by the names of their scenes, fabric-YARN-STITCH-DIRECTION-OTHER. Parts of the interval are
    added as squares: twice the root mean square error of that yarn's stockinette in both directions, or the largest at
    that force; half or twice the length of the strip; the change by a rest without friction, less the same change of
    stockinette; `changes_by_unknowns`. A yarn without stockinette is left out.
    """
    strips = _strips(cells)
    parts = []
    for (yarn, stitch, direction), strip in strips.items():
        known = [strips[key] for key in ((yarn, FITTED, way) for way in DIRECTIONS) if key in strips]
        if len(known) < len(DIRECTIONS):
            continue
        curves = np.array([measured_strain(yarn, direction) for direction in DIRECTIONS])
        off = np.array([strip.strain for strip in known]) / curves - 1
        scatter = 2 * np.sqrt(np.nanmean(off[:, JUDGED] ** 2))
        scatter = np.fmax(scatter, np.fmax.reduce(np.abs(off)))
        loose = np.nan_to_num(strip.loose - strips[yarn, FITTED, direction].loose)
        half = np.hypot(strip.clamps, np.hypot(scatter, loose) * strip.strain)
        low, high = np.hypot(half, changes_by_unknowns(stitch, direction, strip.strain))
        rows = {
            "yarn": yarn,
            "stitch": stitch,
            "direction": direction,
            "force_per_width_N_mm": FORCES,
            "strain": strip.strain,
            "lower": np.maximum(strip.strain - low, 0.0),
            "upper": strip.strain + high,
        }
        parts.append(pd.DataFrame(rows))
    if not parts:
        raise DataFileError(
            "no yarn has cells of stockinette, free and held, in both directions, and sheared"
        )
    return pd.concat(parts, ignore_index=True)


def changes_by_unknowns(stitch: str, direction: str, strain: Floats) -> Floats:
    """Return how much strains (n,) at `FORCES` fall and rise (2, n) with what is not known of a fabric but stockinette.

    That is 10 % of the yarn in a stitch, and from where in its band of shapes at rest the fabric is pulled. Changes of
    the yarn beyond the last strain of its cell are those at that strain.
    """
    if stitch == FITTED:  # to which the yarn's values are fitted, with its loop length and its rest
        return np.zeros((2, len(strain)))
    table = pd.read_csv(UNKNOWNS)
    known = "rib" if stitch == "seed" else stitch
    table = table[(table["stitch"] == known) & (table["direction"] == direction)].ffill()
    by_length = strain * table[["less_yarn", "more_yarn"]].to_numpy().T
    ends = 1 + table[["rest_highest", "rest_lowest"]].to_numpy().T
    by_rest = (1 + strain) / ends - (1 + strain)
    parts = np.array([by_length, by_rest])
    fall, rise = np.minimum(parts.min(axis=1), 0.0), np.maximum(parts.max(axis=1), 0.0)
    return np.sqrt(np.sum(np.square([fall, rise]), axis=1))


@TABLES.add(
    "stockinette",
    "Stockinette between clamps: measured and predicted strains",
    results={"cells": several("simulation", f"fabric-*-{FITTED}-*", fewest=5)},
    order=7.0,
)
def tabulate_stockinette(cells: Datasets) -> pd.DataFrame:
    """Return a row for every yarn, direction and force."""
    parts = []
    for (yarn, direction), rows in predicted(cells).groupby(["yarn", "direction"]):
        known = measured_strain(str(yarn), str(direction))
        columns: dict[str, Any] = {
            "force per width [N/mm]": rows["force_per_width_N_mm"],
            "measured strain [1]": known,
            "predicted strain [1]": rows["strain"],
            "error [%]": 100 * (rows["strain"] / known - 1),
        }
        parts.append(rows[["yarn", "direction"]].assign(**columns))
    return pd.concat(parts)


@TABLES.add(
    "predictions",
    "Predictions of fabrics from yarns that were fitted on stockinette alone",
    results={"cells": CELLS},
    order=7.1,
)
def tabulate_predictions(cells: Datasets) -> pd.DataFrame:
    """Return a row for every yarn, stitch but stockinette, direction and force (`predicted`, `with_status`)."""
    table = predicted(cells)
    return with_status(table[table["stitch"] != FITTED])


def with_status(table: pd.DataFrame) -> pd.DataFrame:
    """Return predictions with the column `status`: claimed, or withdrawn (`WITHDRAWN`)."""
    withdrawn = [key in WITHDRAWN for key in zip(table["stitch"], table["direction"], strict=True)]
    return table.assign(status=np.where(withdrawn, "withdrawn", "claimed"))
