"""Measured stockinette beside its prediction, and predictions of other fabrics of the same yarns."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from knitstudy.loading.history import DIRECTIONS
from knitstudy.measures.catalogue import Datasets, several
from knitstudy.measures.fabrics import FORCES, Prediction, errors, measured, predict
from knitstudy.tables.catalogue import TABLES

FITTED = "stockinette"  # the only stitch whose curves have a say in values of yarns


def predictions(cells: Datasets) -> Iterator[tuple[str, str, str, Prediction]]:
    """Yield yarn, stitch, direction and strains of all strips whose two cells are there."""
    for name, free in cells.items():
        _, yarn, stitch, direction, lateral = name.split("-")
        held = name.removesuffix("free") + "held"
        if lateral == "free" and held in cells:
            yield yarn, stitch, direction, predict(free, cells[held], direction)


@TABLES.add(
    "stockinette",
    "Stockinette between clamps: measured and predicted strains",
    results={"cells": several("simulation", f"fabric-*-{FITTED}-*")},
    order=7.0,
)
def tabulate_stockinette(cells: Datasets) -> pd.DataFrame:
    """Return a row for every yarn, direction and force."""
    rows = []
    for yarn, _, direction, found in predictions(cells):
        curve = measured(yarn, direction)
        for force, strain, known in zip(FORCES, found.strain, curve, strict=True):
            rows.append(
                {
                    "yarn": yarn,
                    "direction": direction,
                    "force per width [N/mm]": force,
                    "measured strain [1]": known,
                    "predicted strain [1]": strain,
                    "error [%]": 100 * (strain / known - 1),
                }
            )
    return pd.DataFrame(rows)


@TABLES.add(
    "predictions",
    "Predictions of fabrics from yarns that were fitted on stockinette alone",
    results={"cells": several("simulation", "fabric-*")},
    order=7.1,
)
def tabulate_predictions(cells: Datasets) -> pd.DataFrame:
    """Return a row for every yarn, stitch but stockinette, direction and force: strain, and how low or high it may be.

    The interval has two parts, added as squares: the share of clamps, and twice the root mean square error of that
    yarn's stockinette in both directions.
    """
    found = list(predictions(cells))
    known = {
        (yarn, direction): errors(strip.strain, measured(yarn, direction))
        for yarn, stitch, direction, strip in found
        if stitch == FITTED
    }
    rows = []
    for yarn, stitch, direction, strip in found:
        if stitch == FITTED or any((yarn, each) not in known for each in DIRECTIONS):
            continue
        off = np.concatenate([known[yarn, each] for each in DIRECTIONS])
        half = np.hypot(strip.clamps, 2 * np.sqrt(np.nanmean(off**2)) * strip.strain)
        for force, strain, by in zip(FORCES, strip.strain, half, strict=True):
            rows.append(
                {
                    "yarn": yarn,
                    "stitch": stitch,
                    "direction": direction,
                    "force_per_width_N_mm": force,
                    "strain": strain,
                    "lower": max(strain - by, 0.0),
                    "upper": strain + by,
                }
            )
    return pd.DataFrame(rows)
