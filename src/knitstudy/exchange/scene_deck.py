"""The deck of a scene, as a stage leaves it."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from knitstudy.exchange.deck import specimen_deck
from knitstudy.exchange.inp import write_inp
from knitstudy.geometry.specimen import read_specimen
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.hexahedra import divide
from knitstudy.solids.tie import tie_of
from knitstudy.study.scene import Scene


def write_abaqus(scene: Scene, path: Path | str, geometry: xr.Dataset, mesh: xr.Dataset) -> None:
    """Write the deck of a scene for Abaqus."""
    _write(scene, path, geometry, mesh, "abaqus")


def write_calculix(scene: Scene, path: Path | str, geometry: xr.Dataset, mesh: xr.Dataset) -> None:
    """Write the deck of a scene for CalculiX."""
    _write(scene, path, geometry, mesh, "calculix")


def _write(scene: Scene, path: Path | str, geometry: xr.Dataset, mesh: xr.Dataset, dialect: str) -> None:
    specimen, swept = read_specimen(geometry), SweptMesh.from_dataset(mesh)
    tie = tie_of(scene, divide(scene, swept, specimen), specimen)
    write_inp(specimen_deck(scene, specimen, swept, tie), path, dialect)
