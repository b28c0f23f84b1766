"""Models beside the reference and beside each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.cases import COMPARED, Case, cases_of, comparison, is_plain
from knitstudy.measures.discretisation import INTERACTIONS, is_direct, made_of
from knitstudy.measures.response import (
    at_strain,
    common_strain,
    out_of_plane,
    secant_stiffness,
    stiffness_at,
    transverse_contraction,
)
from knitstudy.measures.selection import ISOTROPIC_COURSE
from knitstudy.measures.windows import distance, in_full, is_window
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

# ---- How far models are from the reference: direct simulations on their meshes, and reduced models


@TABLES.add(
    "rom_distance",
    "Models and the reference",
    needs=("every", "scenes", "reference"),
    order=1,
)
def tabulate_models(
    every: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], reference: pd.DataFrame
) -> pd.DataFrame:
    """Return one row a model of each of the four cases, the direct simulation on another mesh among them.

    Parameters
    ----------
    every : mapping of str to Dataset
        Histories of knits by scene (see docs/files.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    """
    rows = [row for case in cases_of(every, scenes, reference) for row in _rows_of_models(case)]
    return pd.DataFrame(rows, columns=OF_MODELS)


OF_MODELS = ["model", "scene", "discretisation", *COMPARED]


def _rows_of_models(case: Case) -> Iterator[dict]:
    for model in (case.dns, *case.others, *case.reduced):
        yield {
            "model": f"{case.name_of(model)}; {case.label}",
            "scene": model.scene.name,
            "discretisation": made_of(model.scene) if is_direct(model.scene) else "beams",
            **comparison(model.history, case.dns.history, case.reference),
        }


# ---- Beams in contact beside solid yarns (Fig. 12b), and what each ingredient of their contact changes


OF_BEAMS = [
    "model",
    "scene",
    *COMPARED,
    "stiffness over that of the first beams [1]",
    "increments [1]",
    "Newton iterations [1]",
    "time [s]",
]


@TABLES.add(
    "beams",
    "Beams in contact and solid yarns",
    needs=("every", "scenes", "reference"),
    order=8,
)
def tabulate_beams(
    every: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], reference: pd.DataFrame
) -> pd.DataFrame:
    """Return one row a model: direct simulation, main 3D reduced model, and beams in contact, by direction.

    Parameters
    ----------
    every : mapping of str to Dataset
        Histories of knits by scene (see docs/files.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    """
    rows = [row for case in cases_of(every, scenes, reference) if case.beams for row in _rows_of_beams(case)]
    return pd.DataFrame(rows, columns=OF_BEAMS)


def _rows_of_beams(case: Case) -> Iterator[dict]:
    plain = [model for model in case.beams if is_plain(model.scene)]
    base = secant_stiffness(plain[0].history) if plain else np.nan
    beside = [case.main["rom3d"]] if "rom3d" in case.main else []
    for model in (case.dns, *beside, *case.beams):
        history = model.history
        yield {
            "model": f"{case.name_of(model)}; {case.direction}",
            "scene": model.scene.name,
            **comparison(history, case.dns.history, case.reference),
            "stiffness over that of the first beams [1]": (
                secant_stiffness(history) / base if model in case.beams else np.nan
            ),
            "increments [1]": history.sizes["increment"] - 1,
            "Newton iterations [1]": int(history["newton_iterations"].sum()),
            "time [s]": history.attrs["wall_seconds"],
        }


# ---- Ties, rough contact and isotropic friction compared: stiffness, out-of-plane motion and contraction (Figs. 8, 9)


@TABLES.add(
    "interactions",
    "Ties, rough contact and isotropic friction",
    needs=("tie", "rough", "isotropic", "geometry"),
    of=ISOTROPIC_COURSE,
    order=2,
)
def tabulate_interactions(
    tie: xr.Dataset, rough: xr.Dataset, isotropic: xr.Dataset, geometry: xr.Dataset
) -> pd.DataFrame:
    """Return one row an interaction, at the largest strain that all have reached.

    Parameters
    ----------
    tie, rough, isotropic : Dataset
        Histories of direct simulations that differ in nothing else (see docs/files.md).
    geometry : Dataset
        Result of the geometry stage, for the yarn's diameter.
    """
    histories = {"tie": tie, "rough": rough, "isotropic": isotropic}
    strain = common_strain(histories.values())
    diameter = 2 * float(geometry["radius"])
    stiffnesses = {name: stiffness_at(history, strain) for name, history in histories.items()}
    rows = []
    for name, history in histories.items():
        u_z = at_strain(history, strain, out_of_plane(history))
        rows.append(
            {
                "interaction": INTERACTIONS[name],
                "scene": history.attrs.get("scene", ""),
                "strain [1]": strain,
                "force [N]": at_strain(history, strain, history["force"].to_numpy()),
                "secant stiffness [N/m]": stiffnesses[name],
                "stiffness over tie's [1]": stiffnesses[name] / stiffnesses["tie"],
                "largest |u_z| [m]": u_z,
                "largest |u_z| over diameter [1]": u_z / diameter,
                "transverse contraction at full strain [1]": transverse_contraction(history),
                "increments [1]": history.sizes["increment"] - 1,
                "Newton iterations [1]": int(history["newton_iterations"].sum()),
                "time [s]": history.attrs.get("wall_seconds", np.nan),
            }
        )
    return pd.DataFrame(rows)


# ---- Windows of solid yarns in knits of beams, beside the same knits of solid yarns in full


OF_WINDOWS = [
    "scene",
    "in full",
    "cells of the knit",
    "cells asked for [1]",
    "cells of margin [1]",
    "force over that in full [1]",
    "largest distance of a contact's force [1]",
    "largest distance of a contact's pressure [1]",
    "largest jump of force at a seam [N]",
    "unknowns [1]",
    "unknowns in full over these [1]",
    "time [s]",
    "time in full over this [1]",
]


@TABLES.add(
    "windows",
    "Windows of solid yarns, beside the same knits in full",
    needs=("windows", "windows_contacts", "windows_shown", "scenes"),
    order=5.8,
)
def tabulate_windows(
    windows: Mapping[str, xr.Dataset],
    windows_contacts: Mapping[str, xr.Dataset],
    windows_shown: Mapping[str, xr.Dataset],
    scenes: Mapping[str, Scene],
) -> pd.DataFrame:
    """Return one row a window, at full load; pressures are nan where yarns are tied.

    Parameters
    ----------
    windows : mapping of str to Dataset
        Histories of windows and of the simulations that they are held against, by scene.
    windows_contacts, windows_shown : mapping of str to Dataset
        Contacts of those simulations, and of the windows.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    direct = [scenes[name] for name in windows_contacts]
    return pd.DataFrame(
        [
            _row_of_window(
                scenes[name], in_full(scenes[name], direct), windows, windows_contacts, windows_shown[name]
            )
            for name in windows
            if is_window(scenes[name])
        ],
        columns=OF_WINDOWS,
    )


def _row_of_window(
    scene: Scene,
    full: Scene,
    histories: Mapping[str, xr.Dataset],
    contacts: Mapping[str, xr.Dataset],
    shown: xr.Dataset,
) -> tuple:
    ours, theirs = histories[scene.name], histories[full.name]
    apart = distance(shown, contacts[full.name])
    return (
        scene.name,
        full.name,
        f"{scene.pattern.loops} x {scene.pattern.rows}",
        scene.window.cells,
        scene.window.margin,
        float(ours["force"][-1] / theirs["force"][-1]),
        apart.force,
        apart.pressure,
        float(ours["seam_jump"].max()),
        int(ours.attrs["unknowns"]),
        theirs.attrs["unknowns"] / ours.attrs["unknowns"],
        ours.attrs["wall_seconds"],
        theirs.attrs["wall_seconds"] / ours.attrs["wall_seconds"],
    )
