"""What would not fit into memory is refused before anything is allocated."""

from __future__ import annotations

import psutil

from knitstudy.errors import MeshError

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
