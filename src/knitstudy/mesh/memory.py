"""What a solid mesh and a simulation on it take of memory, before either is made."""

from __future__ import annotations

from collections.abc import Sequence

from knitstudy.errors import MeshError
from knitstudy.gates.memory import require_memory
from knitstudy.mesh.section import nodes_for_size
from knitstudy.mesh.sweep import Curve

BYTES_A_NODE = 250
"""Of a mesh that is made and checked, beside some 100 MB of a batch; measured were 165 to 215, of 0.07 and 0.1 mm."""

BYTES_AN_UNKNOWN = {8: 2000, 20: 3000}
"""Of a simulation of tied yarns without their factors, by the nodes of an element; yarns in contact were measured to
take up to twice as much."""

BYTES_AN_ENTRY = 4
"""Of those factors, in single precision."""


def require_memory_to_mesh(curves: Sequence[Curve], radius: float, size: float, growth: float) -> None:
    """Refuse a mesh that does not fit into memory.

    Parameters
    ----------
    curves : sequence of Curve
        Centrelines of the yarns.
    radius : float
        Of the yarns [m].
    size, growth : float
        ``mesh.size`` [m] and ``mesh.growth``.

    Raises
    ------
    MeshError
        Saying what it would take, and which size would do.
    """
    if not (size > 0 and growth >= 1):
        raise MeshError(f"mesh.size is {size} m and mesh.growth {growth}: must be positive and at least 1")
    slices = sum(curve.length for curve in curves) / (growth * size)
    nodes = slices * nodes_for_size(2 * radius, size)
    require_memory(nodes * BYTES_A_NODE, "mesh.size", size, f"a mesh of {nodes:.2g} nodes", power=3)


def require_memory_to_simulate(unknowns: int, bandwidth: int, size: float, nodes: int = 8) -> None:
    """Refuse a direct simulation that does not fit into memory.

    Parameters
    ----------
    unknowns : int
    bandwidth : int
        Largest difference of node numbers in an element: factors of single yarns are bands of it.
    size : float
        ``mesh.size`` [m].
    nodes : int
        Of an element.

    Raises
    ------
    MeshError
        Saying what it would take, and which size would do.
    """
    need = unknowns * (BYTES_AN_UNKNOWN[nodes] + 3.0 * bandwidth * BYTES_AN_ENTRY)
    require_memory(need, "mesh.size", size, f"a simulation of {unknowns:.2g} unknowns", power=4)
