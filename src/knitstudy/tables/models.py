"""Models beside the reference, interactions beside each other, and windows beside the same knits in full."""

from __future__ import annotations

from collections.abc import Iterator
from math import nan

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.measures import response
from knitstudy.measures.cases import COMPARED, MODELS, Case, cases_of, comparison, is_plain
from knitstudy.measures.catalogue import Datasets, Scenes, several, solid
from knitstudy.measures.cost import effort
from knitstudy.measures.discretisation import INTERACTIONS, is_direct, made_of
from knitstudy.tables.catalogue import TABLES

OF_MODELS = ["model", "scene", "discretisation", *COMPARED]

OVER_FIRST = "stiffness over that of the first beams [1]"

OF_BEAMS = [
    *("model", "scene", *COMPARED, OVER_FIRST),
    *("increments [1]", "Newton iterations [1]", "time [s]"),
]

# Windows of solid yarns in knits of beams, with the same knit of solid yarns in full.
WINDOWS = {
    "window-tie-course-3x3": "yarns-tie-course",
    "window-tie-course-6x6": "domain-yarns-tie-course-6x6",
    "window-tie-course-10x10": "domain-yarns-tie-course-10x10",
    "window-tie-wale-3x3": "yarns-tie-wale",
    "window-isotropic-course-3x3": "yarns-isotropic-course",
    "window-springs-isotropic-course-3x3": "yarns-isotropic-course",
    "window-springs-isotropic-course-10x10": "domain-yarns-isotropic-course-10x10",
}

PLACE = ("row", "column", "zone")  # Labels of a crossing


@TABLES.add(
    "rom_distance", "Models and the reference", results={"models": several("simulation", *MODELS)}, order=1
)
def tabulate_models(models: Datasets, scenes: Scenes, reference: pd.DataFrame) -> pd.DataFrame:
    """Return one row a model of each of the four cases: direct simulations and reduced models."""
    rows = [
        {
            "model": f"{case.name_of(model)}; {case.label}",
            "scene": model.scene.name,
            "discretisation": made_of(model.scene) if is_direct(model.scene) else "beams",
            **comparison(model.history, case.dns.history, case.reference),
        }
        for case in cases_of(models, scenes, reference)
        for model in (case.dns, *case.others, *case.reduced)
    ]
    return pd.DataFrame(rows, columns=OF_MODELS)


@TABLES.add(
    "beams", "Beams in contact and solid yarns", results={"models": several("simulation", *MODELS)}, order=8
)
def tabulate_beams(models: Datasets, scenes: Scenes, reference: pd.DataFrame) -> pd.DataFrame:
    """Return one row a model: direct simulation, main 3D reduced model and beams in contact, by direction (Fig. 12b).

    Beams show what each ingredient of their contact changes.
    """
    cases = [case for case in cases_of(models, scenes, reference) if case.beams]
    return pd.DataFrame([row for case in cases for row in _rows_of_beams(case)], columns=OF_BEAMS)


def _rows_of_beams(case: Case) -> Iterator[dict]:
    plain = [model for model in case.beams if is_plain(model.scene)]
    base = response.secant_stiffness(plain[0].history) if plain else np.nan
    beside = [case.main["rom3d"]] if "rom3d" in case.main else []
    for model in (case.dns, *beside, *case.beams):
        history = model.history
        yield {
            "model": f"{case.name_of(model)}; {case.direction}",
            "scene": model.scene.name,
            **comparison(history, case.dns.history, case.reference),
            OVER_FIRST: response.secant_stiffness(history) / base if model in case.beams else np.nan,
            **effort(history),
        }


@TABLES.add(
    "interactions",
    "Ties, rough contact and isotropic friction",
    results={
        "tie": solid("simulation", "tie-course"),
        "rough": solid("simulation", "rough-course"),
        "isotropic": solid("simulation", "isotropic-course"),
        "geometry": solid("geometry", "isotropic-course"),
    },
    order=2,
)
def tabulate_interactions(
    tie: xr.Dataset, rough: xr.Dataset, isotropic: xr.Dataset, geometry: xr.Dataset
) -> pd.DataFrame:
    """Return one row an interaction (Figs. 8 and 9), at the largest strain that all have reached."""
    histories = {"tie": tie, "rough": rough, "isotropic": isotropic}
    strain, diameter = response.common_strain(histories.values()), 2 * float(geometry["radius"])
    rows = []
    for name, history in histories.items():
        u_z = response.at_strain(history, strain, response.out_of_plane(history))
        row = {
            "interaction": INTERACTIONS[name],
            "scene": history.attrs.get("scene", ""),
            "strain [1]": strain,
            "force [N]": response.at_strain(history, strain, history["force"].to_numpy()),
            "secant stiffness [N/m]": response.stiffness_at(history, strain),
            "stiffness over tie's [1]": response.stiffness_at(history, strain)
            / response.stiffness_at(tie, strain),
            "largest |u_z| [m]": u_z,
            "largest |u_z| over diameter [1]": u_z / diameter,
            "transverse contraction at full strain [1]": response.transverse_contraction(history),
        }
        rows.append(row | effort(history))
    return pd.DataFrame(rows)


@TABLES.add(
    "windows",
    "Windows of solid yarns, beside the same knits in full",
    results={
        "windows": several("simulation", *WINDOWS),
        "windows_contacts": several("contacts", *WINDOWS),
        "full": several("simulation", *WINDOWS.values()),
        "full_contacts": several("contacts", *WINDOWS.values()),
    },
    order=5.8,
)
def tabulate_windows(
    windows: Datasets, windows_contacts: Datasets, full: Datasets, full_contacts: Datasets, scenes: Scenes
) -> pd.DataFrame:
    """Return one row a window, at full load; pressures are nan where yarns are tied."""
    rows = []
    for name, ours in windows.items():
        if (other := WINDOWS[name]) not in full:
            continue
        scene, theirs = scenes[name], full[other]
        force, pressure = contact_errors(windows_contacts[name], full_contacts[other])
        rows.append(
            {
                "scene": name,
                "in full": other,
                "cells of the knit": f"{scene.pattern.loops} x {scene.pattern.rows}",
                "cells asked for [1]": scene.window.cells,
                "cells of margin [1]": scene.window.margin,
                "force over that in full [1]": float(ours["force"][-1] / theirs["force"][-1]),
                "largest distance of a contact's force [1]": force,
                "largest distance of a contact's pressure [1]": pressure,
                "largest jump of force at a seam [N]": float(ours["seam_jump"].max()),
                "unknowns [1]": int(ours.attrs["unknowns"]),
                "unknowns in full over these [1]": theirs.attrs["unknowns"] / ours.attrs["unknowns"],
                "time [s]": ours.attrs["wall_seconds"],
                "time in full over this [1]": theirs.attrs["wall_seconds"] / ours.attrs["wall_seconds"],
            }
        )
    return pd.DataFrame(rows)


def contact_errors(window: xr.Dataset, full: xr.Dataset) -> tuple[float, float]:
    """Return the largest relative errors of forces and of largest pressures at the crossings of a window.

    Both are at the last increment; the error of a force is the length of the difference over the force. That of
    pressures is nan where yarns are tied.
    Raises DataFileError if a crossing of the window is not among those of the full simulation.
    """
    wanted, known = (
        pd.MultiIndex.from_arrays([each[name].to_numpy() for name in PLACE]) for each in (window, full)
    )
    chosen, last = known.get_indexer(wanted), {"increment": -1}
    if (chosen < 0).any():
        row, column, zone = (int(each) for each in wanted[chosen < 0][0])
        raise DataFileError(f"the full simulation has no crossing of row {row}, column {column}, zone {zone}")
    window, full = window.isel(last), full.isel(last).isel(crossing=chosen)
    ours, theirs = (each["force"].to_numpy() for each in (window, full))
    force = np.linalg.norm(ours - theirs, axis=1) / np.linalg.norm(theirs, axis=1)
    ours, theirs = (each["largest_pressure"].to_numpy() for each in (window, full))
    known = np.isfinite(theirs) & (theirs > 0)
    pressure = np.abs(ours[known] / theirs[known] - 1)
    return float(force.max()), float(pressure.max()) if known.any() else nan
