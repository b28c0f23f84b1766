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
    specimen: Knit | YarnPair,
    size: float,
    growth: float,
    refinement: float = 1.0,
    direction: str | None = None,
) -> SweptMesh:
    """Mesh a knit or a pair of yarns; see `mesh_knit` and `mesh_pair` for the sizes and the errors.

    The direction of the load tells where a knit is gripped; a pair has none.
    """
    if isinstance(specimen, YarnPair):
        return mesh_pair(specimen, size, growth, refinement)
    return mesh_knit(specimen, size, growth, refinement, direction)


def mesh_scene(scene: Scene, specimen: Knit | YarnPair) -> SweptMesh:
    """Mesh a scene's specimen with hexahedra, as its keys say."""
    keys, direction = scene.mesh, scene.value("load.direction")
    return mesh_specimen(specimen, keys.size, keys.growth, keys.refinement, direction)


def mesh(scene: Scene, geometry: xr.Dataset) -> xr.Dataset:
    """Return the solid mesh of a scene, from its geometry; both in the formats of docs/architecture.md.

    Yarns without elements across are sampled instead.
    """
    specimen = read_specimen(geometry)
    swept = sampled_sections(specimen) if scene.value("mesh.size") is None else mesh_scene(scene, specimen)
    return swept.to_dataset()
