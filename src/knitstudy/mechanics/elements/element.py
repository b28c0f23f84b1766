"""What a solid element answers, and the registry of them.

Nodes are in VTK order. An element maps its displacements u (e, 8, 3) to nodal forces (e, 8, 3), energies and, if
asked, stiffness blocks (e, 64, 9): pair of nodes (a, b), then components (i, k).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from knitstudy.mechanics.materials import Material
from knitstudy.registry import Registry


@dataclass(frozen=True)
class ElementResponse:
    """Batch of element forces (e, 8, 3) [N], energies (e,) [J] and stiffness (e, 64, 9) [N/m] or None."""

    force: np.ndarray
    internal: np.ndarray
    hourglass: np.ndarray
    stiffness: np.ndarray | None


class Hexahedron(Protocol):
    """A batch of elements that answers for any slice of itself, from several threads at once.

    Attributes
    ----------
    material : Material
    volume : ndarray, shape (E,)
        Undeformed [m3].
    """

    material: Material
    volume: np.ndarray

    def respond(
        self, batch: slice, displacement: np.ndarray, stiffness: bool, out: np.ndarray | None = None
    ) -> ElementResponse:
        """Return the response of the elements `batch` to their displacements (e, 8, 3) [m].

        `out` (e, 64, 9) is memory that the stiffness may be put into.
        """
        ...


@dataclass(frozen=True)
class Kind:
    """An element with its name.

    Attributes
    ----------
    name, meaning : str
    make : callable
        Class that takes corners (E, 8, 3) [m] and the material, and with `hourglass` the hourglass coefficient.
    hourglass : bool
        Whether it takes hourglass control.
    nodes : int
        Of an element: 8, or 20 with the middles of the edges.
    """

    name: str
    meaning: str
    make: Callable[..., Hexahedron]
    hourglass: bool = False
    nodes: int = 8

    def build(self, corners: np.ndarray, material: Material, hourglass: float) -> Hexahedron:
        """Return a batch of elements; `hourglass` is for those that take it."""
        if self.hourglass:
            return self.make(corners, material, hourglass)
        return self.make(corners, material)


ELEMENTS: Registry[Kind] = Registry("mesh.element", "knitstudy.mechanics.elements")


def element(name: str, meaning: str, hourglass: bool = False, nodes: int = 8) -> Callable[[type], type]:
    """Return a decorator that registers a class of elements; what the arguments are stands in `Kind`."""

    def register(make: type) -> type:
        ELEMENTS.register(Kind(name, meaning, make, hourglass, nodes), make.__module__)
        return make

    return register
