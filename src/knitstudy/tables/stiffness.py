"""Stiffness of the three models, how far their force curves are apart, and their out-of-plane motion."""

from __future__ import annotations

import pandas as pd
import xarray as xr

from knitstudy.tables.response import (
    NAMES,
    force_distance,
    largest_out_of_plane,
    out_of_plane_agreement,
    secant_stiffness,
)


def build(dns: xr.Dataset, rom3d: xr.Dataset, rom2d: xr.Dataset, geometry: xr.Dataset) -> pd.DataFrame:
    """Return one row a model; ratios and distances refer to the DNS.

    Parameters
    ----------
    dns, rom3d, rom2d : Dataset
        Histories (see docs/architecture.md).
    geometry : Dataset
        Result of the geometry stage, for the yarn's diameter.
    """
    diameter = 2 * float(geometry["radius"])
    rows = []
    for model, history in {"dns": dns, "rom3d": rom3d, "rom2d": rom2d}.items():
        agreement = out_of_plane_agreement(history, dns)
        u_z = largest_out_of_plane(history)
        rows.append(
            {
                "model": NAMES[model],
                "scene": history.attrs.get("scene", ""),
                "strain [1]": float(history["strain"][-1]),
                "force [N]": float(history["force"][-1]),
                "secant stiffness [N/m]": secant_stiffness(history),
                "stiffness over DNS's [1]": secant_stiffness(history) / secant_stiffness(dns),
                "L2 distance of force to DNS [1]": force_distance(history, dns),
                "largest |u_z| [m]": u_z,
                "largest |u_z| over diameter [1]": u_z / diameter,
                "correlation of u_z with DNS [1]": agreement.correlation,
                "amplitude of u_z over DNS's [1]": agreement.amplitude,
            }
        )
    return pd.DataFrame(rows)
