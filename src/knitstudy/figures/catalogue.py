"""All figures by name."""

from __future__ import annotations

import logging
from textwrap import fill
from typing import Any

from matplotlib.figure import Figure

from knitstudy.figures.renderer import RenderingError
from knitstudy.figures.style import styled
from knitstudy.measures.catalogue import Catalogue, Results, solid

log = logging.getLogger(__name__)

FIGURES = Catalogue("figure", "knitstudy.figures")


def of_solid(case: str, *arguments: str) -> dict[str, Results]:
    """Return the results of the direct simulation of a case by stage, "dns" for the history."""
    return {name: solid("simulation" if name == "dns" else name, case) for name in arguments}


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
