"""Figures of the paper: one file each, which registers its function in `run.catalogue.FIGURES`."""

from __future__ import annotations

import logging
from textwrap import fill
from typing import Any

from matplotlib.figure import Figure

from knitstudy.paper.scene_names import INTERACTIONS as NAMES
from knitstudy.paper.scene_names import MODEL_NAMES
from knitstudy.run.catalogue import FIGURES
from knitstudy.use.solids import RenderingError
from knitstudy.use.style import INK, Look, styled

log = logging.getLogger(__name__)

DIRECT = Look("DNS", INK, "-", "o")  # the direct simulation of a case, of either kind of elements
MODELS = {
    "rom3d": Look(MODEL_NAMES["rom3d"], "#7B3294", "--", "s"),
    "rom2d": Look(MODEL_NAMES["rom2d"], "#D9740B", "-.", "^"),
}
INTERACTIONS = {
    "tie": Look(NAMES["tie"], INK, "-", "o"),
    "rough": Look(NAMES["rough"], "#0072B2", "--", "s"),
    "isotropic": Look(NAMES["isotropic"], "#D9740B", "-.", "^"),
}


def draw(name: str, **sources: Any) -> Figure:
    """Draw a figure from the results that it takes; where solids cannot be rendered, a note in its place.

    Raises ConfigurationError when there is no such figure, or something that it needs is missing.
    """
    try:
        return styled(FIGURES.make)(name, **sources)
    except RenderingError as error:
        log.error("%s is left out: %s", name, error)
        note = Figure(figsize=(6.0, 1.5))
        text = fill(f"{FIGURES.find(name).title} is left out: {error}", 80)
        note.text(0.5, 0.5, text, ha="center", va="center", fontsize=8)
        return note
