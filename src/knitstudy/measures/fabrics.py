"""Strips of measured fabrics between clamps, from cells whose width is free and cells whose width is held.

Clamps hold the width of a strip at its ends, and in its middle it contracts. Its strain at a force per width is

    strain = held + share (free - held)

of the strains of the two cells at that force. The share depends on the shape of the strip: it is that of a membrane
with the energy of a cell of acrylic stockinette, for strips of the shapes that were measured (docs/fabrics.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.loading.history import DIRECTIONS
from knitstudy.study.documents import RESOURCES

FORCES = (0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3)  # N/mm
JUDGED = slice(1, 6)  # of them: 0.05 to 0.25 N/mm

SHARE = {"course": (0.75, 0.10), "wale": (0.55, 0.15)}
"""Share of the free cell, and how far it is off at some force: strips of 66.6 x 69.1 mm and of 95.9 x 45.5 mm."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """Strains of a strip at `FORCES`; nan where a cell was not strained that far."""

    strain: np.ndarray
    clamps: np.ndarray  # by how much the share may change it


def strain_of_cell(history: xr.Dataset, direction: str) -> np.ndarray:
    """Return the strains at `FORCES` of a cell pulled in a direction; nan beyond its largest force."""
    axis = DIRECTIONS.index(direction)
    force = history["force_per_width"].to_numpy()[:, axis] / 1e3
    strain = history["cell_strain"].to_numpy()[:, axis]
    rising = np.append(
        True, force[1:] > np.maximum.accumulate(force)[:-1]
    )  # a snap is crossed at constant force
    return np.interp(FORCES, force[rising], strain[rising], right=np.nan)


def predict(free: xr.Dataset, held: xr.Dataset, direction: str) -> Prediction:
    """Return the strains of a strip between clamps from its two cells."""
    share, off = SHARE[direction]
    apart = strain_of_cell(free, direction) - strain_of_cell(held, direction)
    return Prediction(strain_of_cell(held, direction) + share * apart, off * np.abs(apart))


def measured(yarn: str, direction: str) -> np.ndarray:
    """Return the measured strains of stockinette at `FORCES`; DataFileError if there are none."""
    table = pd.read_csv(RESOURCES / "measured" / "stockinette.csv")
    table = table[(table["yarn"] == yarn) & (table["direction"] == direction)]
    if table.empty:
        raise DataFileError(
            f"resources/measured/stockinette.csv: has no curve of {yarn} in {direction} direction"
        )
    return np.interp(FORCES, table["force_per_width_N_mm"], table["strain"], right=np.nan)


def errors(predicted: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Return the relative errors of strains at the forces that are judged."""
    return predicted[JUDGED] / curve[JUDGED] - 1
