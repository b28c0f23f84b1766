"""The response of a solid element, and the registry of elements.

An element of n nodes, hexahedra in VTK order, maps its displacements u (e, n, 3) to nodal forces (e, n, 3), energies
and, if asked, stiffness blocks (e, n^2, 9): pair of nodes (a, b), then components (i, k).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from knitstudy.mechanics.arrays import Floats
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


class Elements(Protocol):
    """Elements of n nodes each, a batch that answers for any slice of itself, from several threads at once."""

    material: Material
    volume: np.ndarray  # (E,), undeformed [m3]

    def respond(
        self, batch: slice, displacement: Floats, stiffness: bool, out: Floats | None = None
    ) -> ElementResponse:
        """Return the response of the elements `batch` to their displacements (e, n, 3) [m].

        `out` (e, n^2, 9) is memory that the stiffness may be put into.
        """


def in_parts(
    respond: Callable[..., tuple[np.ndarray, np.ndarray]],
    few: int,
    batch: slice,
    displacement: Floats,
    stiffness: bool,
    out: Floats | None = None,
    step: Floats | None = None,
) -> ElementResponse:
    """Return the response of a batch, about `few` elements at a time: their arrays fit into a processor's cache.

    `respond` takes their slice, displacements, memory for the stiffness or None and, if there is one, the step. It
    returns forces and energies.
    """
    count, nodes = displacement.shape[:2]
    force, energy = np.empty((count, nodes, 3)), np.empty(count)
    blocks = None
    if stiffness:
        blocks = np.empty((count, nodes**2, 9)) if out is None else out
    start = batch.start or 0
    # Parts of one size: a small one costs as many calls as a large one
    few = -(-count // max(1, round(count / few)))
    for first in range(0, count, few):
        part = slice(first, min(first + few, count))
        here = slice(start + part.start, start + part.stop)
        way = () if step is None else (step[part],)
        force[part], energy[part] = respond(
            here, displacement[part], None if blocks is None else blocks[part], *way
        )
    return ElementResponse(force, energy, np.zeros(count), blocks)


@dataclass(frozen=True, eq=False)
class ElementGroup:
    """Elements of one kind, with their nodes."""

    connectivity: np.ndarray  # int (E, n), nodes of every element
    elements: Elements  # the batch that answers for them
    # whether `respond` takes the `step` (e, n, 3) [m] that they came by, and leaves out of the stress in the
    # tangent what stretches of second order along it add
    mixed: bool = False


# Classes of hexahedra with a `name`, one line on their `meaning` and the number of `nodes` of an element: 8, or 20 with
# the middles of the edges. They take corners (E, nodes, 3) [m], the material and the coefficient of hourglass control.
ELEMENTS: Registry[type[Elements]] = Registry("mesh.element", "knitstudy.mechanics.elements")
