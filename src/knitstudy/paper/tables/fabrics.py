"""Measured stockinette and its prediction, and predictions of other fabrics of the same yarns."""

from __future__ import annotations

import pandas as pd

from knitstudy.paper.fabrics import CELLS, FITTED, measured_strain, predicted
from knitstudy.run.catalogue import TABLES, Datasets, several


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
        known = measured_strain(yarn, direction)
        strains = {
            "measured strain [1]": known,
            "predicted strain [1]": rows["strain"],
            "error [%]": 100 * (rows["strain"] / known - 1),
        }
        force = rows["force_per_width_N_mm"].rename("force per width [N/mm]")
        parts.append(pd.concat([rows[["yarn", "direction"]], force], axis=1).assign(**strains))
    return pd.concat(parts)


@TABLES.add(
    "predictions",
    "Predictions of fabrics from yarns that were fitted on stockinette alone",
    results={"cells": CELLS},
    order=7.1,
)
def tabulate_predictions(cells: Datasets) -> pd.DataFrame:
    """Return a row for every yarn, stitch but stockinette, direction and force (`paper.fabrics.predicted`)."""
    table = predicted(cells)
    return table[table["stitch"] != FITTED]
