"""What would not fit into memory is refused before anything is allocated."""

from __future__ import annotations

import psutil

from knitstudy.errors import MeshError

GIBIBYTE = 2**30


def require_memory(need: float, key: str, size: float, what: str, power: int) -> None:
    """Refuse a discretisation that takes more memory than is free.

    Parameters
    ----------
    need : float
        Bytes that it takes, estimated.
    key : str
        The key that sets its element size.
    size : float
        Its value [m].
    what : str
        What takes them, for the message.
    power : int
        Memory goes with size to the minus this power; the message says which size would fit.

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
        f"{key} is {size:g} m: {what} would take about {need / GIBIBYTE:.3g} GiB of memory, and {free / GIBIBYTE:.3g} "
        f"GiB are free; use about {fits:.2g} m or more"
    )
