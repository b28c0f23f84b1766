"""Windows of solid yarns in knits of beams, beside the same knits of solid yarns in full."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
import xarray as xr

from knitstudy.measures.windows import distance, in_full, is_window
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

COLUMNS = [
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
def tabulate(
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
            _row(scenes[name], in_full(scenes[name], direct), windows, windows_contacts, windows_shown[name])
            for name in windows
            if is_window(scenes[name])
        ],
        columns=COLUMNS,
    )


def _row(
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
