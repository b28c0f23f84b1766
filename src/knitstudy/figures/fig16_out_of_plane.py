"""Fig. 16: out-of-plane displacement along the yarns, of the DNS and of the 3D reduced model."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.elevation import draw_elevations, elevation
from knitstudy.figures.renderer import MILLIMETRE
from knitstudy.measures.catalogue import Results, network, solid
from knitstudy.measures.discretisation import INTERACTIONS, NAMES
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.measures.response import RMS_U_Z, out_of_plane_correlation, rms_out_of_plane
from knitstudy.study.scene import Scene

THICKNESS = 0.62  # drawn over true diameter of the yarns, so that those behind are seen
SHOWN = ("tie", "isotropic")  # interactions, from above


def _results(direction: str) -> dict[str, Results]:
    """Return the results of a direction: both models with ties and with isotropic friction."""
    found = {"geometry": solid("geometry", f"tie-{direction}")}
    for kind in SHOWN:
        found[f"{kind}_dns"] = solid("simulation", f"{kind}-{direction}")
        found[f"{kind}_rom3d"] = network("rom3d", f"{kind}-{direction}")
    return found


def _figure(name: str, title: str, direction: str) -> Callable:
    return FIGURES.add(name, title, results=_results(direction), files=("reference",), scenes=True)


@_figure("fig16_out_of_plane", "Fig. 16: out-of-plane displacement along the yarns, course tension", "course")
@_figure("fig16_wale", "Fig. 16, wale tension: out-of-plane displacement along the yarns", "wale")
def draw(
    geometry: xr.Dataset, scenes: Mapping[str, Scene], reference: pd.DataFrame, **models: xr.Dataset
) -> Figure:
    """Draw the deformed yarns of both models, coloured on one scale, a row for each interaction."""
    rows = [(models[f"{kind}_dns"], models[f"{kind}_rom3d"]) for kind in SHOWN]
    titles = [
        _titles(kind, *row, reference_of(reference, scenes[f"{kind}_dns"]))
        for kind, row in zip(SHOWN, rows, strict=True)
    ]
    return draw_elevations(rows, titles, float(geometry["radius"]), THICKNESS)


def _titles(kind: str, dns: xr.Dataset, rom3d: xr.Dataset, true: Reference) -> tuple[str, str]:
    """Return model, interaction, largest motion, correlation with the DNS, and amplitude over the reference's."""
    found = []
    correlation = out_of_plane_correlation(rom3d, dns)
    for fidelity, history, second in (
        ("dns", dns, f"at {float(dns['strain'][-1]):.2%} strain"),
        ("rom3d", rom3d, f"correlation {correlation:.2f}"),
    ):
        largest = MILLIMETRE * float(np.abs(elevation(history)).max())
        said = f"{NAMES[fidelity]}, {INTERACTIONS[kind]}: largest $|u_z|$ {largest:.3g} mm"
        amplitude = true.ratio(history, RMS_U_Z, rms_out_of_plane(history))
        found.append(f"{said}\n{second}, amplitude {amplitude}")
    return found[0], found[1]
