"""Pressure of contact on the surface points of yarns, from the points at which contact was computed."""

from __future__ import annotations

import numpy as np

from knitstudy.exchange.curved_cells import CurvedCells


def surface_pressure(
    cells: CurvedCells,
    area: np.ndarray,
    yarn: np.ndarray,
    s: np.ndarray,
    angle: np.ndarray,
    force: np.ndarray,
) -> np.ndarray:
    """Return the pressure (P,) [Pa] at all points of cells, 0 within yarns.

    Between neighbours on the surface it is bilinear, and every point of contact is shared out among the four around it:
    what the surface carries is what was computed, on a patch that is at least as wide as the drawn points are apart.

    Parameters
    ----------
    cells : CurvedCells
    area : ndarray, shape (P,)
        Undeformed surface a unit of arc length and of angle [m/rad]; read on the surface alone.
    yarn : ndarray of int, shape (k,)
        That every point of contact lies on.
    s, angle : ndarray, shape (k,)
        Its arc length [m], and its angle in the section [rad].
    force : ndarray, shape (k,)
        Pressure times the undeformed area that it stands for [N].
    """
    pressure = np.zeros(len(cells.stations) * len(cells.x))
    step = 0.5 * (np.roll(cells.angle, -1) - np.roll(cells.angle, 1)) % np.pi
    turned = cells.angle[0] + np.mod(angle - cells.angle[0], 2 * np.pi)
    closed = np.append(cells.angle, cells.angle[0] + 2 * np.pi)
    for number in np.unique(yarn):
        here = np.flatnonzero(yarn == number)
        grid = cells.surface(number)
        stations = cells.stations[cells.of_yarn(number)]
        row, up = _between(stations, s[here])
        column, round_ = _between(closed, turned[here])
        total = np.zeros(grid.shape)
        for i, along in ((0, 1 - up), (1, up)):
            for j, around in ((0, 1 - round_), (1, round_)):
                np.add.at(total, (row + i, (column + j) % grid.shape[1]), along * around * force[here])
        length = np.gradient(stations) * np.where(np.isin(stations, stations[[0, -1]]), 0.5, 1.0)
        pressure[grid] = total / (area[grid] * length[:, None] * step)
    return pressure


def _between(knots: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the number (k,) of the knot before every value, and the share (k,) of the way to the next one."""
    before = np.clip(np.searchsorted(knots, value, side="right") - 1, 0, len(knots) - 2)
    share = (value - knots[before]) / (knots[before + 1] - knots[before])
    return before, np.clip(share, 0.0, 1.0)
