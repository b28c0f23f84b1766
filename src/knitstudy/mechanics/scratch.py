"""Arrays that a thread uses again and again."""

from __future__ import annotations

import math
import threading

import numpy as np


class Scratch(threading.local):
    """Arrays of one thread by name; what is in them lasts until the next use of the name.

    In fresh memory the system clears every page when it is first touched, which costs several times as much as what is
    computed into it, and threads wait for each other there.
    """

    def __init__(self) -> None:
        self._arrays: dict[str, np.ndarray] = {}

    def array(self, name: str, *shape: int) -> np.ndarray:
        """Return an array whose content is arbitrary."""
        size = math.prod(shape)
        flat = self._arrays.get(name)
        if flat is None or flat.size < size:
            flat = self._arrays[name] = np.empty(size)
        return flat[:size].reshape(shape)


SCRATCH = Scratch()
