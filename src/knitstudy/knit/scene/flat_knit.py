"""Whether a part of a knit is one flat fabric: what loops and yarns must be so that rows of letters describe them.

A yarn leads from needle to needle along rows and turns at the edges of the knit. Rows lie in one layer: a tube has two,
whose passes use other needles by turns, and the loops of one layer are all in front of the yarn of the other. In
interlock passes take turns as well, but each of the two yarns has loops in front of the other one and behind it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from knitstudy.knit.scene.knitting_machine import Machine, MachineLoop, Needle, is_back, name_of, some_of

EDGE = 2  # Columns between the edge of the knit and a loop where its yarn turns
PASSES_APART = (
    4  # of two layers in rows that do not repeat themselves, from which on they are a tube or a pocket
)
IDLE = 8  # Rows at the end in which a needle of rows that do not repeat themselves has a loop

SHORT_ROWS = "short rows"
LAYERS = "a tube or a pocket, two layers that are joined at their edges alone, which an endless fabric does not have"


@dataclass(frozen=True)
class Body:
    """A part of a knit: rows and columns that follow each other."""

    rows: range
    columns: range
    wide: int  # columns of its repeat
    repeats: bool  # whether its rows are two repeats or more

    def holds(self, row: int, column: int) -> bool:
        """Whether a place is of the part."""
        return row in self.rows and column in self.columns


@dataclass(frozen=True)
class Fault:
    """A feature of a knit that stitch letters cannot express."""

    line: int
    reason: str


def fault_of_knit(machine: Machine, column: Mapping[Needle, int], body: Body) -> Fault | None:
    """Return why a part of a knit is no flat fabric of rows that turn at its edges; None if it is one."""
    return (
        _layers(machine, column, body)
        or (None if body.repeats else _ending(machine, column, body))
        or _yarns(machine, column, body)
    )


def _layers(machine: Machine, column: Mapping[Needle, int], body: Body) -> Fault | None:
    """Return the first of two layers; of rows that do not repeat themselves of any `PASSES_APART` that follow."""
    trim = min(2 * EDGE, len(body.columns) // 4)  # where layers may be joined, or the yarn turns
    inner = body.columns[trim : len(body.columns) - trim]
    rows = [[loop for loop in machine.rows[row] if column[loop.needle] in inner] for row in body.rows]
    windows = [rows]
    if not body.repeats:
        windows = [rows[at : at + PASSES_APART] for at in range(len(rows) - PASSES_APART + 1)]
    for window in windows:
        if _takes_turns(window, column) and _apart(window):
            return Fault(
                next(row for row in window if row)[0].line, f"from here on passes take turns: {LAYERS}"
            )
    return None


def _takes_turns(rows: Sequence[list[MachineLoop]], column: Mapping[Needle, int]) -> bool:
    """Whether needles of both beds are in use, and no needle is in two passes that follow each other."""
    columns = [{column[loop.needle] for loop in row} for row in rows]
    beds = {is_back(needle) for row in rows for loop in row for _, needle in loop.stays}
    return len(beds) > 1 and any(one and other and one.isdisjoint(other) for one, other in pairwise(columns))


def _apart(rows: Sequence[list[MachineLoop]]) -> bool:
    """Whether loops are of two groups, of which one lies in front of all yarn of the other.

    Loops of one pass, and loops that are drawn through each other, are of one group; so are groups that have loops in
    front of each other's yarn and behind it.
    """
    loops = [loop for row in rows for loop in row]
    number = {loop: at for at, loop in enumerate(loops)}
    joined = [(number[one], number[other]) for row in rows for one, other in pairwise(row)]
    joined += [
        (number[loop], number[parent]) for loop in loops for parent in loop.parents if parent in number
    ]
    count, group = _groups(len(loops), joined)
    return count > 1 and _in_front(count, _beds(rows, {loop: group[at] for loop, at in number.items()}))


def _beds(
    rows: Sequence[list[MachineLoop]], group: Mapping[MachineLoop, int]
) -> dict[tuple[int, int], set[bool]]:
    """Return, for two groups, whether loops of the second are held on the back bed as the first one knits."""
    beds: dict[tuple[int, int], set[bool]] = {}
    for one, loop, needle in _held(rows):
        if group[one] != group[loop]:
            beds.setdefault((group[one], group[loop]), set()).add(is_back(needle))
    return beds


def _in_front(count: int, beds: Mapping[tuple[int, int], set[bool]]) -> bool:
    """Whether one of so many groups is in front of another, and nothing tangles the two."""
    apart = {pair for pair, of in beds.items() if of == {True} and beds.get(pair[::-1]) == {False}}
    tangled = [pair for pair in beds if not {pair, pair[::-1]} & apart]
    _, fabric = _groups(count, tangled)
    return any(fabric[one] != fabric[other] for one, other in apart)


def _groups(count: int, joined: Sequence[tuple[int, int]]) -> tuple[int, list[int]]:
    """Return the number of groups of things that are joined in pairs, and the group of each."""
    # Imported here: help and completion, which need the keys of scenes, need no scipy.
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = np.array(joined, dtype=int).reshape(-1, 2)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    groups, group = connected_components(graph, directed=False)
    return groups, group.tolist()


def _held(rows: Sequence[list[MachineLoop]]) -> Iterator[tuple[MachineLoop, MachineLoop, Needle]]:
    """Return a loop of every row, with each loop that is held behind or in front of it, and its needle."""
    held: list[MachineLoop] = []
    for row in (each for each in rows if each):
        first, *_ = row
        low, high = min(loop.position for loop in row), max(loop.position for loop in row)
        held = [loop for loop in held if loop.gone is None or first.row < loop.gone]
        for loop in held:
            needle = loop.needle_at(first.row)
            if needle and low <= loop.position <= high:
                yield first, loop, needle
        held += row


def _yarns(machine: Machine, column: Mapping[Needle, int], body: Body) -> Fault | None:
    """Return the first yarn that does not lead along a row or turn at an edge of the knit."""
    steps = [
        (carrier, loop, after)
        for carrier, yarn in machine.loops_by_carrier().items()
        for loop, after in pairwise(yarn)
        if not loop.cut and any(body.holds(each.row, column.get(each.needle, -1)) for each in (loop, after))
    ]
    live = _LiveColumns(machine, column)
    for carrier, loop, after in sorted(steps, key=lambda step: (step[2].row, step[2].line)):
        if shape := _wrong_step(loop, after, column, body, live):
            text, several = _extents(machine)
            if shape == SHORT_ROWS and several:
                shape = f"intarsia or {SHORT_ROWS}"
            return Fault(
                after.line,
                f"the yarn of carrier {carrier} leads from needle {name_of(loop.needle)} ({machine.unit} {loop.line}) "
                f"to {name_of(after.needle)}: no step along a row and no turn at an edge of the knit, as in {shape} "
                f"({text})",
            )
    return None


def _wrong_step(
    loop: MachineLoop, after: MachineLoop, column: Mapping[Needle, int], body: Body, live: _LiveColumns
) -> str:
    """Return the kind of knit whose yarn makes this step, if it is not a flat fabric; an empty text if it is one."""
    if loop.needle not in column or after.needle not in column:
        return ""  # from or to rows that are left out
    here, there = column[loop.needle], column[after.needle]
    along = (there - here) * (1 if loop.way == "+" else -1)
    if loop.row == after.row:
        return "" if along > 0 else "racked ribs and needles out of order"
    left, right, columns = live.beside(after.row, here, there)
    inside = min(left, right) > max(EDGE, min(body.wide, len(live.loops) // 4))
    both = loop.row in body.rows and after.row in body.rows
    if after.way == loop.way and -2 * along >= columns and (both or inside):
        return "a cord or a tube that is knitted round, whose yarn comes back without knitting"
    return SHORT_ROWS if inside else ""


def _extents(machine: Machine) -> tuple[str, bool]:
    """Return the needles of every carrier in words, and whether carriers have other needles than others."""
    needles = {name: [loop.needle[1] for loop in yarn] for name, yarn in machine.loops_by_carrier().items()}
    ends = {name: (min(of), max(of)) for name, of in needles.items()}
    text = some_of(f"carrier {name}: needles {first} to {last}" for name, (first, last) in ends.items())
    return text, len(set(ends.values())) > 1


class _LiveColumns:
    """Columns with loops on their needles as rows begin, from row to row upwards."""

    def __init__(self, machine: Machine, column: Mapping[Needle, int]) -> None:
        self.row = -1
        self.at = 0
        rows = len(machine.rows)
        changes: list[tuple[int, int, int]] = []
        for loop in (each for row in machine.rows for each in row):
            for begun, end, needle in loop.spans(rows):
                if needle in column:
                    changes += [(begun, column[needle], 1), (end, column[needle], -1)]
        self.changes = sorted(changes)
        self.loops = np.zeros(len(set(column.values())), dtype=int)

    def beside(self, row: int, *columns: int) -> tuple[int, int, int]:
        """Return how many live columns lie left of the last of some columns, and right of the first, and in all."""
        while self.at < len(self.changes) and self.changes[self.at][0] <= row:
            _, column, change = self.changes[self.at]
            self.loops[column] += change
            self.at += 1
        live = self.loops > 0
        live[list(columns)] = True
        left = np.count_nonzero(live[: max(columns)])
        right = np.count_nonzero(live[min(columns) + 1 :])
        return int(left), int(right), int(np.count_nonzero(live))


def _ending(machine: Machine, column: Mapping[Needle, int], body: Body) -> Fault | None:
    """Return the first needle whose loops end before the rows do, as where a piece becomes narrower."""
    last: dict[int, MachineLoop] = {}
    for row in body.rows:
        for loop in machine.rows[row]:
            if column[loop.needle] in body.columns:
                last[column[loop.needle]] = loop
    idle = max(IDLE, 2 * len({carrier for loop in last.values() for carrier in loop.carriers}))
    for loop in sorted(last.values(), key=lambda loop: loop.line):
        if loop.row < body.rows[-1] - idle:
            return Fault(
                loop.line,
                f"needle {name_of(loop.needle)} has no loop after row {loop.row + 1} of {body.rows[-1] + 1}: a piece "
                f"whose needles end, as where it becomes narrower ({width_of(machine, body)}), is not an endless "
                "fabric",
            )
    return None


def width_of(machine: Machine, body: Body) -> str:
    """Return how many loops the first and the last row of a part have, in words."""
    first, last = (len(machine.rows[row]) for row in (body.rows[0], body.rows[-1]))
    return f"{first} loops in row {body.rows[0] + 1}, {last} in row {body.rows[-1] + 1}"
