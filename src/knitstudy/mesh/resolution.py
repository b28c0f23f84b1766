"""Whether the elements of a scene resolve its loop, before anything is simulated."""

from __future__ import annotations

import xarray as xr

from knitstudy.errors import MeshError
from knitstudy.geometry.fabric import Fabric, plain_knit
from knitstudy.mesh.mesher import check_shape, mesh_fabric
from knitstudy.study.scene import Scene

LARGEST_SAG = 0.02  # share of the length of an arc by which the chord of an element may be shorter


def require_resolution(scene: Scene, geometry: xr.Dataset) -> str:
    """Mesh one cell of a knit as its scene says, and return what the elements resolve, in words.

    A straight element of length h is shorter than its arc by about (h / rho)^2 / 24.
    Raises MeshError where elements are too long for the tightest bend of the loop, or the mesh fails a gate.
    """
    fabric = Fabric.from_dataset(geometry)
    check_shape(fabric)
    key = next((name for name in ("mesh.size", "mesh.beam_size") if scene.value(name) is not None), None)
    if fabric.loop is None or key is None:
        return "the curved spans of the yarns need no more than their gates ask for"
    bend = fabric.radius / float(geometry["radius_of_curvature"].isel(state=-1))
    size = scene.value(key)
    sag = (size * bend) ** 2 / 24
    if sag > LARGEST_SAG:
        most = (24 * LARGEST_SAG) ** 0.5 / bend
        raise MeshError(
            f"scene {scene.name!r}: {key} is {size:g} yarn radii but must be at most {most:.3g} where R / rho is "
            f"{bend:.3g}: chords of elements are {sag:.1%} shorter than the yarn, allowed is {LARGEST_SAG:.0%}"
        )
    if key == "mesh.size":
        mesh_fabric(plain_knit(fabric.loop, 1, 1), size, scene.mesh.growth, scene.mesh.refinement)
    return (
        f"chords of elements are at most {sag:.2%} shorter than the yarn ({key} {size:g}, R / rho {bend:.3g})"
    )
