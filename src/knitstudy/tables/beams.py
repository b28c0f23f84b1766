"""Beams in contact beside solid yarns (Fig. 12b), and what each ingredient of their contact changes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.scene import Scene
from knitstudy.tables.cases import Case, Model, cases_of
from knitstudy.tables.response import (
    force_distance,
    largest_out_of_plane,
    out_of_plane_agreement,
    secant_stiffness,
)

PLAIN = ("point", "rigid", "rigid")
"""Contact, section and ties of the model that ingredients are added to."""


def is_plain(scene: Scene) -> bool:
    """Whether beams touch at a pair of points between rigid sections, and ties hold sections as the paper's do."""
    return (scene.beam.contact, scene.beam.section, scene.beam.tie) == PLAIN


COLUMNS = [
    "model",
    "scene",
    "strain [1]",
    "force [N]",
    "secant stiffness [N/m]",
    "stiffness over DNS's [1]",
    "stiffness over that of the first beams [1]",
    "L2 distance of force to DNS [1]",
    "largest |u_z| [m]",
    "correlation of u_z with DNS [1]",
    "increments [1]",
    "Newton iterations [1]",
    "time [s]",
]


def build(every: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return one row a model: direct simulation, main 3D reduced model, and beams in contact, by direction.

    Parameters
    ----------
    every : mapping of str to Dataset
        Histories of knits by scene (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    rows = [row for case in cases_of(every, scenes) if case.beams for row in _rows(case)]
    return pd.DataFrame(rows, columns=COLUMNS)


def _rows(case: Case) -> Iterator[dict]:
    dns = case.dns.history
    plain = [model for model in case.beams if is_plain(model.scene)]
    base = secant_stiffness(plain[0].history) if plain else np.nan
    beside = [case.main["rom3d"]] if "rom3d" in case.main else []
    for model in (case.dns, *beside, *case.beams):
        history = model.history
        stiffness = secant_stiffness(history)
        values = (
            _label(model, case),
            model.scene.name,
            float(history["strain"][-1]),
            float(history["force"][-1]),
            stiffness,
            stiffness / secant_stiffness(dns),
            stiffness / base if model in case.beams else np.nan,
            force_distance(history, dns),
            largest_out_of_plane(history),
            out_of_plane_agreement(history, dns).correlation,
            history.sizes["increment"] - 1,
            int(history["newton_iterations"].sum()),
            history.attrs["wall_seconds"],
        )
        yield dict(zip(COLUMNS, values, strict=True))


def _label(model: Model, case: Case) -> str:
    name = "DNS" if model is case.dns else model.label
    return f"{name}; {case.direction}"
