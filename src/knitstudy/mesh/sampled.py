"""Cross-sections at which yarns without a mesh of their own are seen and drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

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

    All yarns of a knit are one, moved, and what three loops of three yarns do all others do: a large knit takes no
    longer to check.

    Raises
    ------
    MeshError
        If a yarn bends tighter than its radius, or yarns overlap.
    """
    radius, curves = specimen.radius, specimen.centrelines
    knit = None if isinstance(specimen, YarnPair) else specimen
    size, periods = 2 * radius / ACROSS, knit.loops if knit else 1
    spacing = Spacing(
        size,
        GROWTH,
        crossing_stations(specimen),
        curves[0].length / periods,
        reach=REACH * radius,
        ramp=RAMP * radius,
    )
    section = Section.for_size(2 * radius, size)
    part = replace(knit, loops=min(knit.loops, 3), rows=min(knit.rows, 2)) if knit else specimen
    check_bending(part.centrelines[:1] if knit else curves, radius)
    check_overlap(part.centrelines, radius)
    if knit is None:
        return sweep(curves, section, radius, spacing)
    rise = np.array([0.0, knit.loop.course_spacing, 0.0])
    return _repeated(sweep(curves[:1], section, radius, spacing, periods), len(curves), rise)


def _repeated(mesh: SweptMesh, yarns: int, step: np.ndarray) -> SweptMesh:
    """Return a yarn and its images, each moved by `step` (3,) [m] from the one before."""
    shift = np.multiply.outer(np.arange(yarns), step)[:, None]
    nodes = len(mesh.nodes) * np.arange(yarns, dtype=np.int32)[:, None, None]
    return replace(
        mesh,
        nodes=(mesh.nodes + shift).reshape(-1, 3),
        hexahedra=(mesh.hexahedra + nodes).reshape(-1, 8),
        centres=(mesh.centres + shift).reshape(-1, 3),
        frames=np.tile(mesh.frames, (yarns, 1, 1)),
        arc_length=np.tile(mesh.arc_length, yarns),
        first_slice=mesh.slices * np.arange(yarns + 1),
        pull=None,
    )


def crossing_stations(specimen: Knit | YarnPair) -> tuple[float, ...]:
    """Return the arc lengths of all places of a loop, or of a pair's yarn, at which it is crossed [m]."""
    if isinstance(specimen, YarnPair):
        return (float(specimen.crossings.arc_length[0, 0]),)
    return tuple(loop_contacts(specimen).arc_length.tolist())
