"""Cross-sections at which yarns without a mesh of their own are seen and drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from knitstudy.geometry.pair import YarnPair
from knitstudy.mesh.knit import RAMP, REACH, loop_contacts
from knitstudy.mesh.quality import check_bending, check_overlap
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import SweptMesh, sweep

if TYPE_CHECKING:
    from knitstudy.geometry.pattern import Knit

ACROSS = 6
"""Elements over the diameter, and as close along the yarn near crossings."""

GROWTH = 3.0
"""Distance of sections on legs over that near crossings."""


def sampled_sections(specimen: Knit | YarnPair) -> SweptMesh:
    """Return sections of all yarns in frames without twist, past the gates on their shape.

    Raises
    ------
    MeshError
        If a yarn bends tighter than its radius, or yarns overlap.
    """
    pair = isinstance(specimen, YarnPair)
    radius = specimen.radius
    curves = specimen.centrelines
    size = 2 * radius / ACROSS
    stations = crossing_stations(specimen)
    periods = 1 if pair else specimen.loops
    spacing = Spacing(
        size, GROWTH, stations, curves[0].length / periods, reach=REACH * radius, ramp=RAMP * radius
    )
    mesh = sweep(curves, Section.for_size(2 * radius, size), radius, spacing, periods)
    check_bending(curves, radius)
    check_overlap(curves, radius)
    return mesh


def crossing_stations(specimen: Knit | YarnPair) -> tuple[float, ...]:
    """Return the arc lengths of all places of a loop, or of a pair's yarn, at which it is crossed [m]."""
    if isinstance(specimen, YarnPair):
        return (float(specimen.crossings.arc_length[0, 0]),)
    return tuple(loop_contacts(specimen).arc_length.tolist())
