"""How a series of square knits is drawn: its model by colour and marker, what holds its yarns by dash and filling."""

from __future__ import annotations

from knitstudy.figures.style import MODELS, PAPER, Look
from knitstudy.measures.discretisation import SOLID_YARNS, discretisation, is_direct
from knitstudy.measures.domain import Series

YARNS = Look(SOLID_YARNS, "#0072B2", "-", "D")

BEAMS_IN_CONTACT = Look("beams", "#00704F", "-", "P")

LOOSE = "v"
"""Marker where yarns touch and no row is tied."""


def domain_line(series: Series) -> dict:
    """Return keywords of a matplotlib line, with a label."""
    look = _look(series)
    touches = series.scenes[0].kind.interaction.touches
    held = "ties" if not touches else "friction, no row tied" if series.free else "friction"
    return {
        "color": look.colour,
        "linestyle": ":" if series.free else "--" if touches else "-",
        "marker": LOOSE if series.free else look.marker,
        "markerfacecolor": PAPER if touches else look.colour,
        "label": f"{look.label}, {held}",
    }


def _look(series: Series) -> Look:
    scene = series.scenes[0]
    if not is_direct(scene):
        return BEAMS_IN_CONTACT if scene.fidelity == "beam" else MODELS[scene.fidelity]
    if discretisation(scene) == SOLID_YARNS:
        return YARNS
    return Look("hexahedra", MODELS["dns"].colour, "-", MODELS["dns"].marker)
