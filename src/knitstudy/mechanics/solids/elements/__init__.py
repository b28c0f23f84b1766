"""The response of a solid element, and the registry of elements.

An element of n nodes, hexahedra in VTK order, maps its displacements u (e, n, 3) to nodal forces (e, n, 3), energies
and, if asked, stiffness blocks (e, n^2, 9): pair of nodes (a, b), then components (i, k).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.materials import Material
from knitstudy.registry import Registry


@dataclass(frozen=True)
class ElementResponse:
    """Batch of element forces (e, n, 3) [N], energies (e,) [J] and stiffness (e, n^2, 9) [N/m] or None."""

    force: Floats
    internal: Floats
    hourglass: Floats
    stiffness: Floats | None

    @property
    def tangent(self) -> Floats:
        """The stiffness of a response that was asked for with it."""
        assert self.stiffness is not None, "this response was asked for without its stiffness"
        return self.stiffness


class Elements(ABC):
    """Elements of n nodes each, a batch that answers for any slice of itself, from several threads at once."""

    material: Material
    volume: np.ndarray  # (E,), undeformed [m3]
    few: int  # elements whose arrays fit into a processor's cache together

    def respond(
        self,
        batch: slice,
        displacement: Floats,
        stiffness: bool,
        out: Floats | None = None,
        step: Floats | None = None,
    ) -> ElementResponse:
        """Return the response of the elements `batch` to their displacements (e, n, 3) [m], about `few` at a time.

        `out` (e, n^2, 9) is memory that the stiffness may be put into. `step` (e, n, 3) [m] is the straight way to the
        displacements from where a tangent was formed; a tangent may depend on it, see `Model.advance`.
        """
        count, nodes = displacement.shape[:2]
        force = np.empty((count, nodes, 3))
        energy = np.empty(count)
        blocks = None
        if stiffness:
            blocks = np.empty((count, nodes**2, 9)) if out is None else out
        start = batch.start or 0
        # Parts of one size: a small one costs as many calls as a large one
        few = -(-count // max(1, round(count / self.few)))
        for first in range(0, count, few):
            part = slice(first, min(first + few, count))
            here = slice(start + part.start, start + part.stop)
            known = (None if array is None else array[part] for array in (blocks, step))
            force[part], energy[part] = self._respond(here, displacement[part], *known)
        return ElementResponse(force, energy, np.zeros(count), blocks)

    @abstractmethod
    def _respond(
        self, here: slice, displacement: Floats, out: Floats | None, step: Floats | None
    ) -> tuple[Floats, Floats]:
        """Return force (e, n, 3) and energy (e,) of a few elements; put their stiffness into `out` (e, n^2, 9)."""


@dataclass(frozen=True, eq=False)
class ElementGroup:
    """Elements of one kind, with their nodes."""

    connectivity: np.ndarray  # int (E, n), nodes of every element
    elements: Elements  # the batch that answers for them


# Classes of hexahedra with a `name`, one line on their `meaning` and the number of `nodes` of an element: 8, or 20 with
# the middles of the edges. They take corners (E, nodes, 3) [m], the material and the coefficient of hourglass control.
ELEMENTS: Registry[type[Elements]] = Registry("mesh.element", "knitstudy.mechanics.solids.elements")
