"""Solid mesh of whatever a scene simulates."""

from __future__ import annotations

import xarray as xr

from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.geometry.specimen import read_specimen
from knitstudy.mesh.knit import mesh_knit
from knitstudy.mesh.pair import mesh_pair
from knitstudy.mesh.sampled import sampled_sections
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.study.scene import Scene


def mesh_specimen(
    specimen: Knit | YarnPair, size: float, growth: float, refinement: float = 1.0
) -> SweptMesh:
    """Mesh a knit or a pair of yarns; see `mesh_knit` and `mesh_pair` for the sizes and the errors."""
    mesh = mesh_pair if isinstance(specimen, YarnPair) else mesh_knit
    return mesh(specimen, size, growth, refinement)


def mesh(scene: Scene, geometry: xr.Dataset) -> xr.Dataset:
    """Return the solid mesh of a scene, from its geometry; both in the formats of docs/architecture.md.

    Yarns without elements across are sampled instead.
    """
    specimen, size = read_specimen(geometry), scene.value("mesh.size")
    if size is None:
        return sampled_sections(specimen).to_dataset()
    return mesh_specimen(specimen, size, scene.mesh.growth, scene.mesh.refinement).to_dataset()
