"""Knits that other programs keep as graphs of loops: objects of knit-graphs and of knitout-interpreter.

Neither package is imported: objects are read by their attributes. A graph iterates over loops, which sort by the time
of their making. A loop has ``loop_id``, ``yarn``, ``parent_loops`` as they were stacked, and ``pull_direction``; one of
knitout-interpreter also ``source_instruction``. Crossings are ``graph.braid_graph.edge_iter``.
"""

import logging
from collections.abc import Sequence
from itertools import chain, groupby, product
from statistics import fmean
from typing import Any

from knitstudy.errors import ConfigurationError, printable
from knitstudy.knit.scene.knitting_machine import Machine, MachineLoop

log = logging.getLogger(__name__)

Places = dict[Any, tuple[int, str]]  # column and direction of loops
SIDES = {"Over_Right": 1, "Under_Right": -1}  # of a loop on the left that crosses, as in `MachineLoop.passed`


def machine_of(graph: Any) -> Machine:
    """Return a machine that has knitted a graph. Raises ConfigurationError where an object is no graph of loops."""
    try:
        sources = sorted(graph)
        edges = list(graph.braid_graph.edge_iter)
    except (AttributeError, TypeError):
        fact = f"an object of type {type(graph).__name__} is not a knit"
        raise ConfigurationError(f"{fact}: allowed are paths of knitout files, and knit graphs") from None
    if all(hasattr(loop, "source_instruction") for loop in sources):
        return _machine_of_instructions(sources, edges)
    return _machine_of_loops(sources, edges)


def _machine_of_loops(sources: Sequence[Any], edges: Sequence[Any]) -> Machine:
    """Return a machine that has knitted a graph of loops alone."""
    # Several loops are one stitch where yarns are plated.
    stitches = _stitches(sources, {loop: loop.parent_loops or loop for loop in sources})
    child = _children(sources)
    places = places_of([first for first, *_ in stitches], child, edges)
    if loose := [first.loop_id for first, *_ in stitches if first not in places]:
        log.warning("knit graph: tucks that no loop is drawn through are left out: loops %s", loose)
    stitches = [each for each in stitches if each[0] in places]
    lines = {first: first.loop_id for first, *_ in stitches}
    last = _last(sources)
    names = {yarn: str(number) for number, yarn in enumerate(last, 1)}
    machine = Machine("knit graph", "loop")
    made = _knit(machine, stitches, places, lines, names, set(last.values()))
    _cross(made, child, edges)
    return machine


def _machine_of_instructions(sources: Sequence[Any], edges: Sequence[Any]) -> Machine:
    """Return a machine that has knitted a graph whose loops name the instructions that made them."""
    orders = {loop: loop.source_instruction for loop in sources}
    places = {loop: (order.needle.position, str(order.direction)) for loop, order in orders.items()}
    lines = {loop: order.line_number for loop, order in orders.items()}
    last = _last(sources)
    names = {yarn: printable(str(yarn.carrier.carrier_id)) for yarn in last}
    machine = Machine("knit graph", "instruction")
    child = _children(sources)
    made = _knit(machine, _stitches(sources, orders), places, lines, names, set(last.values()))
    for source, loop in made.items():
        if source not in child and (fallen := getattr(source, "dropping_instruction", None)):
            loop.dropped = fallen.line_number
    _cross(made, child, edges)
    return machine


def _stitches(sources: Sequence[Any], key: dict[Any, Any]) -> list[list[Any]]:
    """Return loops that follow each other and have one key as one stitch."""
    return [list(loops) for _, loops in groupby(sources, key.get)]


def _children(sources: Sequence[Any]) -> dict[Any, Any]:
    """Return the loop that is drawn through each."""
    return {parent: source for source in sources for parent in source.parent_loops}


def _last(sources: Sequence[Any]) -> dict[Any, Any]:
    """Return the last loop of every yarn."""
    return {source.yarn: source for source in sources}


def _knit(
    machine: Machine,
    stitches: Sequence[list[Any]],
    places: Places,
    lines: dict[Any, int],
    names: dict[Any, str],
    last: set[Any],
) -> dict[Any, MachineLoop]:
    """Knit stitches at their places, and return the loop of the machine for every loop of the graph.

    `lines` and `names` are those of first loops and of yarns in messages; yarns end behind the loops `last`.
    """
    made: dict[Any, MachineLoop] = {}
    for every in stitches:
        first = every[0]
        parents = every[0].parent_loops
        machine.line = lines[first]
        column, way = places[first]
        needle = f"{'b' if first.pull_direction.name == 'FtB' else 'f'}{column}"
        carriers = [names[each.yarn] for each in every]
        machine.hand((made[parent] for parent in parents), needle)
        machine.run("inhook", *carriers)
        machine.run("knit" if parents else "tuck", way, needle, *carriers)
        made |= dict.fromkeys(every, machine.rows[-1][-1])
        machine.rows[-1][-1].cut = not last.isdisjoint(every)
    return made


def _cross(made: dict[Any, MachineLoop], child: dict[Any, Any], edges: Sequence[Any]) -> None:
    """Keep on which side loops pass each other.

    A machine names the loops that cross, a builder of graphs the loops that are drawn through these.
    """
    for one, other, way in edges:
        for a, b in [(one, other), *product(one.parent_loops, other.parent_loops)]:
            if {a, b} <= child.keys() and _passes(
                (made[a], made[b]), (made[child[a]], made[child[b]]), way.name
            ):
                break


def _passes(
    pair: tuple[MachineLoop, MachineLoop], children: tuple[MachineLoop, MachineLoop], way: str
) -> bool:
    """Whether two loops lie the other way round than those that are drawn through them; if so keep who passes whom."""
    (left, right), (before, after) = pair, children
    apart = right.position - left.position
    side = SIDES.get(way, 0)
    if apart * (after.position - before.position) >= 0:
        return False
    left.passed[right] = right.passed[left] = side if apart > 0 else -side
    return True


def places_of(sources: Sequence[Any], child: dict[Any, Any], edges: Sequence[Any]) -> Places:
    """Return the column and the direction of every loop of a graph that names no needles.

    The yarn of the first row goes to the right. A loop has the column of the loop that it is drawn through; columns
    follow the order of the yarn. A row ends where the next loop lies on a loop of this row, or where the yarn turns.
    """
    below: dict[Any, Sequence[Any]] = {}  # loops on the needle that each comes to, a tuck to those held there
    for loop in sources:
        if loop.parent_loops or loop in child:
            below[loop] = loop.parent_loops or [each for each in child[loop].parent_loops if each < loop]
    rows = _Rows(below, {loop for *pair, _ in edges for loop in pair})
    for loop in below:
        if rows.ends_before(loop):
            rows.end()
        rows.add(loop)
    rows.end()
    return rows.places


class _Rows:
    """Rows of a graph that names no needles, found along the yarn: `places` are those of the rows that have ended."""

    def __init__(self, below: dict[Any, Sequence[Any]], crossed: set[Any]) -> None:
        self.below, self.crossed, self.places = below, crossed, Places()
        self.row: dict[Any, list[int]] = {}  # its loops, with the columns of those below

    def add(self, loop: Any) -> None:
        """Add a loop to the row."""
        self.row[loop] = self._columns(loop)

    def _columns(self, loop: Any) -> list[int]:
        return [self.places[each][0] for each in self.below[loop] if each in self.places]

    def _known(self) -> dict[Any, float]:
        """Return the columns of loops of the row, of those that lie on loops with a place."""
        return {loop: fmean(columns) for loop, columns in self.row.items() if columns}

    def ends_before(self, loop: Any) -> bool:
        """Whether a loop is of the next row: it lies on a loop of this row, or the yarn has turned."""
        if not self.row.keys().isdisjoint(self.below[loop]):
            return True
        known = self._known()
        if columns := self._columns(loop):
            known[loop] = fmean(columns)
        at = [known[each] for each in known if self.crossed.isdisjoint([each, *self.below[each]])]
        return at not in (sorted(at), sorted(at, reverse=True))

    def end(self) -> None:
        """Give the loops of the row their places, and begin the next row with its tucks that are early."""
        known = list(self._known().values())
        way = "-" if known[-1:] < known[:1] else "+"
        cells = sorted(set(chain(*self.row.values())), reverse=way == "-")
        early = list(self.row)[len(cells) :]  # tucks ahead of the next row
        if not cells or len(cells) > len(self.row) or any(each.parent_loops for each in early):
            cells = [of[-1] if of else number for number, of in enumerate(self.row.values())]
            early = []
        self.places |= {each: (cell, way) for each, cell in zip(self.row, cells, strict=False)}
        self.row = {each: self._columns(each) for each in early}
