"""Which cells of a knit a window takes in, and which arcs of yarns are solid for it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from knitstudy.crossings.tied_crossings import tied_crossings
from knitstudy.errors import ConfigurationError
from knitstudy.geometry.arcs import gripped_arcs
from knitstudy.geometry.pattern import Crossings, Knit
from knitstudy.geometry.pieces import Arcs
from knitstudy.study.scene import Scene


@dataclass(frozen=True, eq=False)
class Window(Arcs):
    """Crossings of which both yarns are solid, and the arcs that they lie on.

    Attributes
    ----------
    shown : ndarray of int, shape (W,)
        Crossings of the cells that are asked for; the others are of the margin.
    """

    shown: np.ndarray

    @cached_property
    def cuts(self) -> dict[int, np.ndarray]:
        """Arc lengths by yarn at which solid and beam meet, ascending [m]."""
        return {int(yarn): self.arc[self.yarn == yarn].ravel() for yarn in np.unique(self.yarn)}


def window_of(scene: Scene, knit: Knit) -> Window:
    """Return the window of a scene.

    Raises
    ------
    ConfigurationError
        If it does not lie within the knit, or reaches what is gripped or, where yarns touch, tied.
    """
    crossings, cells = knit.crossings, scene.window.cells // 2
    middle = _middle(scene, knit)
    shown = _around(crossings, middle, cells)
    crossing = _around(crossings, middle, cells + scene.window.margin)
    if scene.kind.interaction.touches:
        _require_untied(scene, crossings, crossing)
    yarn, arc = _arcs(knit, crossing)
    _require_ungripped(scene, knit, yarn, arc)
    return Window(crossing, yarn, arc, shown)


def _around(crossings: Crossings, middle: tuple[int, int], reach: int) -> np.ndarray:
    """Return the crossings of all cells that are not farther from the one at a row and a column than `reach`."""
    rows, columns = np.abs(crossings.row - middle[0]), np.abs(crossings.column - middle[1])
    return np.flatnonzero((rows <= reach) & (columns <= reach))


def _middle(scene: Scene, knit: Knit) -> tuple[int, int]:
    """Return row and column of the middle cell; refuse a window that is not wholly in the knit."""
    keys = scene.window
    reach, found = keys.cells // 2 + keys.margin, []
    for name, given, count in (("row", keys.row, knit.rows), ("column", keys.column, knit.loops)):
        middle = count // 2 if given is None else given
        lowest, highest = reach, count - 1 - reach
        if lowest > highest:
            raise ConfigurationError(
                f"scene {scene.name!r}: window.cells is {keys.cells} and window.margin {keys.margin}, but the knit has "
                f"{count} {name}s: use smaller ones, for together they must be at most that many"
            )
        if not lowest <= middle <= highest:
            why = "does not exist" if middle >= count else "is too near to the edge of the knit"
            raise ConfigurationError(
                f"scene {scene.name!r}: window.{name} is {middle}, which {why} for window.cells {keys.cells} and "
                f"window.margin {keys.margin}: use one from {lowest} to {highest}"
            )
        found.append(middle)
    return found[0], found[1]


def _require_untied(scene: Scene, crossings: Crossings, chosen: np.ndarray) -> None:
    """Refuse a window in which some crossings are tied and others are not."""
    tied = chosen[tied_crossings(scene, crossings)[chosen]]
    if len(tied):
        k = tied[0]
        raise ConfigurationError(
            f"scene {scene.name!r}: the window takes in row {crossings.row[k]}, column {crossings.column[k]}, which "
            "contact.tied_edges 'outer' ties: move window.row or window.column inwards, or use a smaller window.cells "
            "or window.margin"
        )


def _require_ungripped(scene: Scene, knit: Knit, yarn: np.ndarray, arc: np.ndarray) -> None:
    """Refuse a window whose arcs reach into a grip."""
    gripped = gripped_arcs(knit, scene.load.direction)
    for one, (low, high) in zip(yarn, arc, strict=True):
        ends = gripped.get(int(one), np.empty((0, 2)))
        if np.any((ends[:, 0] < high) & (ends[:, 1] > low)):
            raise ConfigurationError(
                f"scene {scene.name!r}: the window takes in a part of yarn {one} that is gripped in "
                f"{scene.load.direction} tension: move window.row inwards, or use a smaller window.cells or "
                "window.margin"
            )


def _arcs(knit: Knit, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return arcs of yarns (P,) that hold chosen crossings: (P, 2) [m], half the way to those next to them."""
    crossings = knit.crossings
    is_chosen = np.zeros(len(crossings.row), dtype=bool)
    is_chosen[chosen] = True
    yarns, arcs = [], []
    for number, line in enumerate(knit.centrelines):
        here, side = np.nonzero(crossings.yarn == number)
        order = np.argsort(crossings.arc_length[here, side])
        stations = crossings.arc_length[here, side][order]
        solid = is_chosen[here][order]
        middles = np.concatenate([[0.0], 0.5 * (stations[1:] + stations[:-1]), [line.length]])
        middles[[0, -1]] = 0.5 * stations[0], 0.5 * (stations[-1] + line.length)
        begins = np.flatnonzero(solid & ~np.append(False, solid[:-1]))
        ends = np.flatnonzero(solid & ~np.append(solid[1:], False))
        arcs.append(np.column_stack([middles[begins], middles[ends + 1]]))
        yarns.append(np.full(len(begins), number))
    return np.concatenate(yarns), np.concatenate(arcs)
