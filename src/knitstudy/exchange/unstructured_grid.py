"""Cells with fields, in the XML format of VTK that ParaView opens."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import meshio
import numpy as np

from knitstudy.files.replacing import replacing


def write_cells(
    path: Path | str,
    points: np.ndarray,
    kind: str,
    cells: np.ndarray,
    point_fields: Mapping[str, np.ndarray],
    cell_fields: Mapping[str, np.ndarray],
) -> None:
    """Write cells of one kind as VTU, whole or not at all.

    Parameters
    ----------
    path : Path or str
    points : ndarray, shape (P, 3)
        Undeformed [m].
    kind : str
        As meshio has it: hexahedron, hexahedron20, hexahedron27.
    cells : ndarray of int, shape (C, n)
        Points of every cell, in the order of VTK.
    point_fields, cell_fields : mapping of str to ndarray (P, ...), (C, ...)

    Raises
    ------
    DataFileError
        If the file cannot be written.
    """
    fields = {name: [values] for name, values in cell_fields.items()}
    grid = meshio.Mesh(points, [(kind, cells)], point_data=dict(point_fields), cell_data=fields)
    with replacing(path) as temporary:
        grid.write(temporary)
