"""A model beside the reference, by the columns that tables have in common."""

from __future__ import annotations

import xarray as xr

from knitstudy.measures.reference import Reference
from knitstudy.measures.response import (
    RMS_U_Z,
    largest_out_of_plane,
    out_of_plane_agreement,
    rms_out_of_plane,
    secant_stiffness,
)

OVER_REFERENCE, DISTANCE = "force over the reference's [1]", "L2 distance of force to the reference [1]"
AMPLITUDE = "amplitude of u_z over the reference's [1]"
SHAPE = "correlation of u_z with DNS [1]"

UNCERTAIN = {
    OVER_REFERENCE: "uncertainty of that ratio [1]",
    DISTANCE: "uncertainty of that distance [1]",
    AMPLITUDE: "uncertainty of that amplitude [1]",
}
"""Columns of the uncertainties that the reference brings, by what they belong to."""

COLUMNS = [
    "strain [1]",
    "force [N]",
    "secant stiffness [N/m]",
    OVER_REFERENCE,
    UNCERTAIN[OVER_REFERENCE],
    DISTANCE,
    UNCERTAIN[DISTANCE],
    "largest |u_z| [m]",
    AMPLITUDE,
    UNCERTAIN[AMPLITUDE],
    SHAPE,
]


def comparison(history: xr.Dataset, dns: xr.Dataset, reference: Reference) -> dict[str, float]:
    """Return what a model does at its largest strain and how far from the reference it is, by column.

    Ratios are at the largest strain that both reach. The reference is of numbers: shapes of u_z are compared with the
    direct simulation.

    Parameters
    ----------
    history : Dataset
        Of the model (see docs/architecture.md).
    dns : Dataset
        Of the direct simulation of its case.
    reference : Reference
        Of the problem.
    """
    row = {
        "strain [1]": float(history["strain"][-1]),
        "force [N]": float(history["force"][-1]),
        "secant stiffness [N/m]": secant_stiffness(history),
        "largest |u_z| [m]": largest_out_of_plane(history),
        SHAPE: out_of_plane_agreement(history, dns).correlation,
    }
    estimates = {
        OVER_REFERENCE: reference.force_ratio(history),
        DISTANCE: reference.force_distance(history),
        AMPLITUDE: reference.ratio(history, RMS_U_Z, rms_out_of_plane(history)),
    }
    for column, estimate in estimates.items():
        row |= {column: estimate.value, UNCERTAIN[column]: estimate.uncertainty}
    return row
