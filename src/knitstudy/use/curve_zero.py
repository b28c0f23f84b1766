"""Where a measured curve begins: the point of its record that has no strain and no force.

Records begin at a preload, at a position of the crosshead, or with a load cell that was not set to zero. A curve is
therefore anchored at its first point, as textile standards measure the extension from the pretension, unless the
origin continues its first rows. A toe of slack is taken off on request, by the tangent of ASTM D638, annex A1.
"""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.mechanics.core.arrays import Floats

log = logging.getLogger(__name__)

ZEROS = {
    "first": "its first point",
    "file": "the zero of the file",
    "toe": "where its straight part, extended, meets no force",
}
"""Points at which a curve can be anchored."""

SMALL = 0.005  # Share of a range below which a first value counts as zero
PRELOAD = 0.1  # Share of the range of forces up to which a first force is taken off without a question
STRAIGHT = 0.95  # Share of the steepest slope that the straight part of a curve has everywhere
SHORTEST = 0.1  # Share of the range of strains that a straight part has at least; a slope is measured over it
FEWEST = 3  # rows of a straight part
TINY = np.finfo(float).tiny
GRID = 100  # Intervals of the range of strains at which slopes are measured


def anchored(curve: pd.Series[float], zero: str | None, path: Path) -> pd.Series[float]:
    """Return a curve from its zero on, tension positive; what is turned or taken off is logged.

    Parameters
    ----------
    curve : Series
        Forces per width (n,) [N/m] by strains [1], in the order of the record.
    zero : str or None
        One of `ZEROS`. None: the zero of the file where the origin continues the first rows, else the first point.
    path : Path
        The file, for messages.

    Raises
    ------
    DataFileError
        If the first force is above `PRELOAD` of the range and `zero` is not given; if there is no straight part.
    """
    strain = curve.index.to_numpy(dtype=float)
    force = curve.to_numpy()
    first = f"{100 * strain[0]:.4g} % strain and {force[0]:.4g} N/m"
    strain = _turned(strain, "strain", path)
    force = _turned(force, "force", path)
    ranges = [float(np.abs(values - values[0]).max()) for values in (strain, force)]
    if zero is None:
        zero = _zero_of(strain, force, ranges[1], first, path)
    if zero == "toe":
        toe = _toe(strain, force, path)
        log.warning(
            "%s: the straight part meets no force at %.4g %% strain, which is taken off (ASTM D638, A1)",
            path,
            100 * toe,
        )
        return pd.Series(force, strain - toe)
    if zero == "file":
        return pd.Series(force, strain)
    if abs(strain[0]) > SMALL * ranges[0] or abs(force[0]) > SMALL * ranges[1]:
        log.warning("%s: begins at %s, which are taken off (--zero file keeps them)", path, first)
    return pd.Series(force - force[0], strain - strain[0])


def _zero_of(strain: Floats, force: Floats, force_range: float, first: str, path: Path) -> str:
    """Return the zero of a curve (n,) that nobody gave one; DataFileError where the first force is large."""
    if _origin_continues(strain, force):
        if strain[0] > SMALL * (strain.max() - strain[0]):
            log.warning(
                "%s: begins at %s, one row from its zero, which is kept (--zero first takes them off)",
                path,
                first,
            )
        return "file"
    if abs(force[0]) > PRELOAD * force_range > 0:
        share = 100 * abs(force[0]) / force_range
        raise DataFileError(
            f"{path}: begins at {first}, {share:.3g} % of the range of its forces: add --zero first if they are a "
            "preload or offsets, or --zero file if the zero of the file is right and earlier rows are missing"
        )
    return "first"


def _turned(values: Floats, name: str, path: Path) -> Floats:
    """Return values (n,) whose largest change from the first one is positive."""
    if values[np.argmax(np.abs(values - values[0]))] >= values[0]:
        return values
    log.warning("%s: the sign of the %s is turned: tension is positive here", path, name)
    return -values


def _origin_continues(strain: Floats, force: Floats) -> bool:
    """Return whether the origin continues a curve (n,) before its first row, no farther than its rows are apart.

    The first force is then above 0, and the line through the first two rows has no force left at no strain: fabrics
    stiffen. A curve whose first row is the origin continues, too.
    """
    steps = np.diff(strain)
    rising = steps[: max(int(np.argmax(strain)), 1)]
    rising = rising[rising > 0]
    if not len(rising):
        return False
    step = float(np.median(rising))
    second = int(np.argmax(strain > strain[0]))
    slope = (force[second] - force[0]) / (strain[second] - strain[0])
    small = SMALL * np.abs(force - force[0]).max()
    if abs(strain[0]) <= SMALL * step:
        return bool(abs(force[0]) <= small)
    near = 0 < strain[0] <= step * (1 + SMALL)
    return bool(near and force[0] > small and force[0] - slope * strain[0] <= small)


def _toe(strain: Floats, force: Floats, path: Path) -> float:
    """Return the strain at which the straight part of a loading curve (n,), extended, meets no force.

    The straight part is where slopes, each by least squares over `SHORTEST` of the range, are near the steepest one.
    """
    last = int(np.argmax(strain)) + 1
    order = np.argsort(strain[:last], kind="stable")
    rows, row_force = strain[order], force[order]
    grid = np.linspace(rows[0], rows[-1], GRID + 1)
    forces = np.interp(grid, rows, row_force)
    width = round(SHORTEST * GRID)
    windows = np.lib.stride_tricks.sliding_window_view(np.stack([grid, forces]), width + 1, axis=1)
    x, y = windows - windows.mean(axis=2, keepdims=True)  # (GRID - width + 1, width + 1)
    slopes = (x * y).sum(axis=1) / np.maximum((x * x).sum(axis=1), TINY)
    low = high = int(np.argmax(slopes))
    straight = slopes >= STRAIGHT * slopes[low]
    while low > 0 and straight[low - 1]:
        low -= 1
    while high < len(straight) - 1 and straight[high + 1]:
        high += 1
    part = (rows >= grid[low]) & (rows <= grid[high + width])
    if high - low < width or part.sum() < FEWEST or slopes.max() <= 0:
        raise DataFileError(
            f"{path}: the curve has no straight part that tells a toe of slack from a fabric that stiffens: "
            "use --zero first"
        )
    slope, offset = np.polyfit(rows[part], row_force[part], 1)
    return float(-offset / slope)
