"""Stress in the yarns of a knit at full load, and its averages over the segments of the honeycomb (section 3.4).

What is averaged is the Cauchy stress, over the deformed volume of a segment: all of the yarns between the crossings
at its two ends, both yarns where two share a segment. The maximum principal stress is the largest by value, and its
direction an axis in space as the knit then is; `segment_rotation`, the rotation of the affine motion that fits the
segment best, takes it back to the undeformed knit (docs/principal_stress.md).
"""

from __future__ import annotations

from importlib import import_module

import numpy as np
import xarray as xr

from knitstudy.crossings.segments import KINDS, NO_SEGMENT, Segments, segments
from knitstudy.errors import DataFileError
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.columns import STRESSES
from knitstudy.mechanics.cauchy import principal_axes
from knitstudy.mechanics.materials.material import VOIGT
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.cell_stress import CellStress
from knitstudy.study.scene import Scene

EXTENTS = {"whole": 1.0, "middle": 0.5}
"""Share of every piece of yarn, about its middle, that is averaged over; what judges is the whole piece."""


def stress(scene: Scene, geometry: xr.Dataset, mesh: xr.Dataset, history: xr.Dataset) -> xr.Dataset:
    """Return the stresses of a scene, in the format of docs/architecture.md.

    Parameters
    ----------
    scene : Scene
    geometry, mesh, history : Dataset
        Of the scene; the history keeps its fields.

    Raises
    ------
    DataFileError
        If the history holds no displacement of nodes, or that of another discretisation.
    """
    if "node_displacement" not in history:
        raise DataFileError(
            "the history holds no node_displacement, which stresses come from: the scene's outputs must hold 'fields'"
        )
    knit, swept = Knit.from_dataset(geometry), SweptMesh.from_dataset(mesh)
    moved = history["node_displacement"].to_numpy()
    cells = import_module(scene.kind.fidelity.stress).cell_stress(scene, swept, knit, moved)
    parts = segments(knit.crossings, np.array([each.length for each in knit.centrelines]))
    values = {
        "cell_stress": cells.mean[:, VOIGT[:, 0], VOIGT[:, 1]],
        "cell_volume": cells.volume,
        "cell_place": cells.place,
        "cell_yarn": swept.yarn_of_slice[swept.slice_of_element].astype(np.int32),
        "piece_yarn": parts.yarn,
        "piece_arc_length": parts.arc_length,
        "piece_segment": parts.of_piece,
        "segment_kind": parts.kind,
        "segment_row": parts.row,
        "segment_column": parts.column,
        "segment_central": parts.central.astype(np.int8),
        **averages(parts, swept, cells),
    }
    return xr.Dataset(
        STRESSES.variables(values),
        coords={"extent": list(EXTENTS), "xyz": list("xyz"), "kind_of_segment": list(KINDS)},
        attrs={
            "strain": float(history["strain"][-1]),
            "force": float(history["force"][-1]),
            "direction": scene.load.direction,
        },
    )


def averages(parts: Segments, mesh: SweptMesh, cells: CellStress) -> dict[str, np.ndarray]:
    """Return stresses, principal values, axes, volumes and rotations of pieces and segments, by name."""
    volume, integral, moments = _of_pieces(parts, mesh, cells)
    inside = np.flatnonzero(parts.of_piece != NO_SEGMENT)

    def of_segments(values: np.ndarray) -> np.ndarray:
        total = np.zeros((len(parts.kind), *values.shape[1:]))
        np.add.at(total, parts.of_piece[inside], values[inside])
        return total

    segment_volume = of_segments(volume)
    mean = of_segments(integral) / segment_volume[..., None, None]
    value, axis = principal_axes(mean)
    return {
        "piece_stress": integral / volume[..., None, None],
        "piece_volume": volume,
        "segment_stress": mean,
        "segment_volume": segment_volume,
        "segment_principal": value,
        "segment_axis": axis,
        "segment_rotation": _rotations(of_segments(moments)),
    }


def _of_pieces(
    parts: Segments, mesh: SweptMesh, cells: CellStress
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return volume (P, x), integral of the stress (P, x, 3, 3) and moments (P, 4, 7) of pieces, for extents x.

    A piece takes its share of the layer of cells that it ends in. Moments are sums over cells of [1, X] (x) [1, X, x]
    by volume: what the best affine motion of a whole piece is made of.
    """
    one = np.ones((len(cells.volume), 1))
    before = np.concatenate([one, cells.reference], axis=1)
    both = np.concatenate([before, cells.place], axis=1)
    moments = cells.volume[:, None, None] * before[:, :, None] * both[:, None]
    flat = np.concatenate(
        [cells.volume[:, None], cells.integral.reshape(-1, 9), moments.reshape(-1, 28)], axis=1
    )
    layers = flat.reshape(-1, len(mesh.section.quads), flat.shape[1]).sum(axis=1)
    found = np.empty((len(parts.yarn), len(EXTENTS), flat.shape[1]))
    last = np.cumsum(np.diff(mesh.first_slice) - 1)
    for yarn, (stations, end) in enumerate(zip(mesh.stations, last, strict=True)):
        own = layers[end - len(stations) + 1 : end]
        upto = np.concatenate([np.zeros((1, own.shape[1])), own.cumsum(axis=0)])
        here = parts.yarn == yarn
        middle, half = (
            parts.arc_length[here].mean(axis=1),
            0.5 * np.diff(parts.arc_length[here], axis=1)[:, 0],
        )
        for i, share in enumerate(EXTENTS.values()):
            found[here, i] = _at(middle + share * half, stations, upto) - _at(
                middle - share * half, stations, upto
            )
    return found[..., 0], found[..., 1:10].reshape(*found.shape[:2], 3, 3), found[:, 0, 10:].reshape(-1, 4, 7)


def _at(s: np.ndarray, stations: np.ndarray, upto: np.ndarray) -> np.ndarray:
    """Return what is summed up to arc lengths s (k,) [m], from the sums (S, c) up to stations (S,)."""
    low = np.clip(np.searchsorted(stations, s) - 1, 0, len(stations) - 2)
    share = (s - stations[low]) / (stations[low + 1] - stations[low])
    return upto[low] + share[:, None] * (upto[low + 1] - upto[low])


def _rotations(moments: np.ndarray) -> np.ndarray:
    """Return the rotations (Q, 3, 3) of the affine motions that fit places best, from their moments (Q, 4, 7)."""
    volume = moments[:, :1, :1]
    first, now = moments[:, 0, 1:4] / volume[:, 0], moments[:, 0, 4:] / volume[:, 0]
    spread = moments[:, 1:, 1:4] / volume - first[:, :, None] * first[:, None]
    across = moments[:, 1:, 4:] / volume - first[:, :, None] * now[:, None]
    gradient = np.swapaxes(np.linalg.solve(spread, across), 1, 2)
    left, _, right = np.linalg.svd(gradient)
    return left @ right
