"""Solid mesh of a knit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from knitstudy.mesh.quality import OVERLAP_TOLERANCE, check
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import SweptMesh, sweep

if TYPE_CHECKING:
    from knitstudy.geometry.pattern import Knit

REACH = 1.0
"""Distance from a crossing up to which slices stand at their closest, over the yarn's radius."""

RAMP = 2.0
"""Distance over which their spacing then grows, over the yarn's radius."""


def mesh_knit(knit: Knit, size: float, growth: float = 1.0, overlap: float = OVERLAP_TOLERANCE) -> SweptMesh:
    """Mesh all yarns of a knit, and refuse the mesh if it fails a gate.

    All loops get the same slices, those of the outer yarns too, which are crossed only on one side.

    Parameters
    ----------
    knit : Knit
    size : float
        Element size across the yarn, and along it near crossings, m.
    growth : float
        Spacing of slices away from crossings over ``size``.
    overlap : float
        Share of the diameter by which yarns may overlap.

    Raises
    ------
    MeshError
        If the sizes are not allowed, elements are folded, the yarn bends too tightly, or yarns overlap.
    """
    radius = knit.loop.radius
    section = Section.for_size(2 * radius, size)
    mesh = sweep(knit.centrelines, section, radius, crossing_spacing(knit, size, growth), periods=knit.loops)
    check(mesh, knit.centrelines, overlap)
    return mesh


def crossing_spacing(knit: Knit, size: float, growth: float) -> Spacing:
    """Spacing along a yarn: ``size`` near all places of a loop that are crossed in any row (m)."""
    period = knit.centrelines[0].length / knit.loops
    stations = np.unique(np.round(knit.crossings.arc_length.ravel() % period / period, 9)) * period
    radius = knit.loop.radius
    return Spacing(size, growth, tuple(stations), period, reach=REACH * radius, ramp=RAMP * radius)
