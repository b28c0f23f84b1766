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

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.knitting_machine import Loop, Machine

log = logging.getLogger(__name__)

Places = dict[Any, tuple[int, str]]  # column and direction of loops
SIDES = {"Over_Right": 1, "Under_Right": -1}  # of a loop on the left that crosses, as in `Loop.passed`


def machine_of(graph: Any) -> Machine:
    """Return a machine that has knitted a graph. Raises ConfigurationError where an object is no graph of loops."""
    try:
        sources, edges = sorted(graph), list(graph.braid_graph.edge_iter)
    except (AttributeError, TypeError):
        fact = f"an object of type {type(graph).__name__} is no knit"
        raise ConfigurationError(f"{fact}: allowed are paths of knitout files, and knit graphs") from None
    child = {parent: source for source in sources for parent in source.parent_loops}
    plain = not all(hasattr(loop, "source_instruction") for loop in sources)
    machine = Machine("knit graph", "loop" if plain else "instruction")
    # Several loops are one stitch where yarns are plated.
    of = {loop: (loop.parent_loops or loop) if plain else loop.source_instruction for loop in sources}
    stitches = [list(loops) for _, loops in groupby(sources, of.get)]
    if plain:
        places = places_of([first for first, *_ in stitches], child, edges)
        if loose := [first.loop_id for first, *_ in stitches if first not in places]:
            log.warning("knit graph: tucks that no loop is drawn through are left out: loops %s", loose)
    else:
        places = {loop: (order.needle.position, str(order.direction)) for loop, order in of.items()}
    last = {source.yarn: source for source in sources}
    names = {yarn: str(n if plain else yarn.carrier.carrier_id) for n, yarn in enumerate(last, 1)}
    made: dict[Any, Loop] = {}
    for first, *others in (each for each in stitches if each[0] in places):
        machine.line = first.loop_id if plain else of[first].line_number
        column, way = places[first]
        needle = f"{'b' if first.pull_direction.name == 'FtB' else 'f'}{column}"
        every, parents = (first, *others), first.parent_loops
        carriers = [names[each.yarn] for each in every]
        machine.hand((made[parent] for parent in parents), needle)
        machine.run("inhook", *carriers)
        machine.run("knit" if parents else "tuck", way, needle, *carriers)
        made |= dict.fromkeys(every, machine.rows[-1][-1])
        machine.rows[-1][-1].cut = any(each is last[each.yarn] for each in every)
    for source, loop in made.items():
        if source not in child and (fallen := getattr(source, "dropping_instruction", None)):
            loop.dropped = fallen.line_number
    for one, other, way in edges:
        # A machine names the loops that cross, a builder of graphs the loops that are drawn through these.
        for a, b in [(one, other), *product(one.parent_loops, other.parent_loops)]:
            if {a, b} <= child.keys():
                left, right, before, after = (made[each] for each in (a, b, child[a], child[b]))
                apart, side = right.position - left.position, SIDES.get(way.name, 0)
                if apart * (after.position - before.position) < 0:
                    left.passed[right] = right.passed[left] = side if apart > 0 else -side
                    break
    return machine


def places_of(sources: Sequence[Any], child: dict[Any, Any], edges: Sequence[Any]) -> Places:
    """Return the column and the direction of every loop of a graph that names no needles.

    The yarn of the first row goes to the right. A loop has the column of the loop that it is drawn through; columns
    follow the order of the yarn. A row ends where the next loop lies on a loop of this row, or where the yarn turns.
    """
    below: dict[Any, Sequence[Any]] = {}  # loops on the needle that each comes to, a tuck to those held there
    for loop in sources:
        if loop.parent_loops or loop in child:
            below[loop] = loop.parent_loops or [each for each in child[loop].parent_loops if each < loop]
    below[None] = ()  # the end
    crossed, places = {loop for *pair, _ in edges for loop in pair}, Places()

    def columns(loop: Any) -> list[int]:
        return [places[each][0] for each in below[loop] if each in places]

    row: dict[Any, list[int]] = {}  # its loops, with the columns of those below
    for loop in below:
        known = {each: fmean(of) for each, of in (row | {loop: columns(loop)}).items() if of}
        at = [known[each] for each in known if crossed.isdisjoint([each, *below[each]])]
        turns = at not in (sorted(at), sorted(at, reverse=True))
        if turns or loop is None or not row.keys().isdisjoint(below[loop]):
            ends = [known[each] for each in row if each in known]
            way = "-" if ends[-1:] < ends[:1] else "+"
            cells = sorted(set(chain(*row.values())), reverse=way == "-")
            early = list(row)[len(cells) :]  # tucks ahead of the next row
            if not cells or len(cells) > len(row) or any(each.parent_loops for each in early):
                cells = [of[-1] if of else number for number, of in enumerate(row.values())]
                early = []
            places |= {each: (cell, way) for each, cell in zip(row, cells, strict=False)}
            row = {each: columns(each) for each in early}
        row[loop] = columns(loop)
    return places
