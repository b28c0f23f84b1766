"""What would not fit into memory is refused before anything is allocated."""

from __future__ import annotations

from collections.abc import Sequence

import psutil

from knitstudy.errors import MeshError
from knitstudy.mesh.section import nodes_for_size
from knitstudy.mesh.sweep import Curve

GIBIBYTE = 2**30


def require_memory(need: float, key: str, size: float, what: str, power: int, unit: str = "m") -> None:
    """Refuse a discretisation that takes more memory than is free.

    Parameters
    ----------
    need : float
        Bytes that it takes, estimated.
    key : str
        The key that sets its element size.
    size : float
        Its value.
    what : str
        What takes them, for the message.
    power : int
        Memory goes with size to the minus this power; the message says which size would fit.
    unit : str
        Of the key.

    Raises
    ------
    MeshError
        If there are fewer bytes available.
    """
    free = psutil.virtual_memory().available
    if need <= free:
        return
    fits = 1.05 * size * (need / free) ** (1 / power)
    raise MeshError(
        f"{key} is {size:g} {unit}: {what} would take about {need / GIBIBYTE:.3g} GiB of memory, and "
        f"{free / GIBIBYTE:.3g} GiB are free; use about {fits:.2g} {unit} or more"
    )


# ---- What a solid mesh and a simulation on it take of memory, before either is made


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
