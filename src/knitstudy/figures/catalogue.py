"""All figures by name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from knitstudy.measures.catalogue import Catalogue

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES = Catalogue("figure", "knitstudy.figures")


def draw(name: str, **sources: Any) -> Figure:
    """Draw a figure from the results that it takes.

    Raises
    ------
    ConfigurationError
        When there is no such figure, or something that it needs is missing.
    """
    return FIGURES.make(name, **sources)
