"""Knits without a file: graphs of loops with the attributes of knit-graphs, and the packages where there are any."""

import warnings
from importlib import import_module
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace

import pytest
from refusals import refusal

from knitstudy import repeat_of
from knitstudy.knit.scene.stitches import MARKS, stitches_of_row

FILES = sorted((Path(__file__).resolve().parents[2] / "examples" / "knitout").glob("*.k"))


class Loop:
    def __init__(self, number, yarn, parents, side):
        self.loop_id, self.yarn, self.parent_loops = number, yarn, list(parents)
        self.pull_direction = SimpleNamespace(name=side)

    def __lt__(self, other):
        return self.loop_id < other.loop_id


class Graph(list):
    """Loops in the order of their making; a list iterates over them as a graph of knit-graphs does."""

    def __init__(self):
        super().__init__()
        self.braid_graph = SimpleNamespace(edge_iter=[])

    def loop(self, *parents, yarn="yarn", side="BtF"):
        self.append(Loop(len(self), yarn, parents, side))
        return self[-1]

    def rows(self, count, loops, yarn="yarn"):
        """Knit rows on loops, to and fro, and return the last one from left to right."""
        for _ in range(count):
            loops = [self.loop(*([loop] if loop else []), yarn=yarn) for loop in loops[::-1]]
        return loops[:: 1 if count % 2 == 0 else -1]


def knitted(stitches, across=3, up=4):
    """Return the graph of some repeats, cast on from left to right, with the crossings of its moved loops."""
    graph, rows = Graph(), [stitches_of_row(row) * across for row in stitches] * up
    on = [[graph.loop()] for _ in rows[0]]
    for number, row in enumerate(rows):
        made = {}
        for column in range(len(row)) if number % 2 else reversed(range(len(row))):
            letter = row[column][0]
            if letter in "KP":
                made[column] = graph.loop(*on[column], side="BtF" if letter == "K" else "FtB")
                on[column] = [made[column]]
            elif letter == "T":
                made[column] = graph.loop()
                on[column].append(made[column])
        marks = {column: row[column][1:] for column in made}
        to = {c: min(max(c + sum(MARKS[mark][0] for mark in marks[c]), 0), len(row) - 1) for c in made}
        for column in (column for column in made if marks[column]):
            on[column].remove(made[column])
        for column in (column for column in made if marks[column]):
            front = MARKS[marks[column][0]][1]
            on[to[column]].insert(0 if front else len(on[to[column]]), made[column])
        for left, right in combinations(sorted(made), 2):
            if to[left] > to[right]:
                over = MARKS[marks[left][0]][1] if marks[left] else not MARKS[marks[right][0]][1]
                side = SimpleNamespace(name="Over_Right" if over else "Under_Right")
                graph.braid_graph.edge_iter.append((made[left], made[right], side))
    return graph


REPEATS = ["K", "KP", "K P", "KP PK", "KP KT", "PK TK", "K- -K", "K- -P KP", "K T", "TK KT KK", "K>K( KK"]
REPEATS += ["K)K< KK", "K)K TK", "PK>K(P PKKP", "K>>K>>K((K(( KKKK", "KK)KKKK( KTKKKT"]


@pytest.mark.parametrize("repeat", REPEATS)
def test_letters_come_back_from_the_graph_that_they_say(repeat):
    """Neither needles nor rows are in the graph: only loops along a yarn, and what each is drawn through."""
    rows = [stitches_of_row(row) for row in repeat.split()]
    read = [stitches_of_row(row) for row in repeat_of(knitted(repeat.split()))]
    turned = [
        [row[along:] + row[:along] for row in rows[up:] + rows[:up]]
        for up in range(len(rows))
        for along in range(len(rows[0]))
    ]
    assert read in turned


@pytest.mark.parametrize("side", [1, 0])
def test_crossings_are_of_the_loops_that_cross_or_of_those_drawn_through_them(side):
    """A machine names the former, builders of knit-graphs the latter."""
    graph = knitted(["K>K(", "KK"])
    child = {parent: loop for loop in graph for parent in loop.parent_loops}
    if side:
        graph.braid_graph.edge_iter = [(child[a], child[b], way) for a, b, way in graph.braid_graph.edge_iter]
    assert repeat_of(graph) == ("K>K(", "KK")


def cable_without_crossings():
    graph = knitted(["KPKK", "KKKK", "K>K(KK", "KKKK"])
    graph.braid_graph.edge_iter = []
    return graph


def dropped():
    """Every second row lets a loop fall and begins again on its needle."""
    graph = Graph()
    row = graph.rows(2, [None] * 6)
    for _ in range(4):
        row = graph.rows(1, row)
        row = graph.rows(1, [*row[:3], None, *row[4:]])
    graph.rows(1, row)
    return graph


def narrowed():
    graph = Graph()
    row = graph.rows(3, [None] * 4)
    for _ in range(4):
        row = graph.rows(1, [row[0], *row[2:], None])
    return graph


def tube():
    graph = Graph()
    row = [graph.loop() for _ in range(8)]
    for _ in range(4):
        row = [graph.loop(loop) for loop in row]
    return graph


def split():
    """Every loop of a row is drawn through twice."""
    graph = Graph()
    row = graph.rows(2, [None] * 4)
    for _ in range(3):
        graph.rows(1, row)
        row = graph.rows(1, row)
    return graph


def plated():
    graph = Graph()
    row = [[loop] for loop in graph.rows(1, [None] * 4)]
    for _ in range(4):
        row = [[graph.loop(*loops), graph.loop(*loops, yarn="other")] for loops in row[::-1]]
    return graph


def intarsia():
    graph = Graph()
    left, right = [graph.rows(1, [None] * 4, yarn) for yarn in ("a", "b")]
    for _ in range(4):
        left, right = graph.rows(2, left, "a"), graph.rows(2, right, "b")
    return graph


WRONG = {
    "cable without crossings": (cable_without_crossings, "knit graph, loop"),
    "dropped": (dropped, "drop: a loop falls"),
    "narrowed": (narrowed, "knit graph, loop"),
    "tube": (tube, r"knit graph, loop 8: .* from needle f7 \(loop 7\) to f0: no step along a row"),
    "split": (split, "knit graph, loop .* split"),
    "plated": (plated, "plating: a loop of the carriers 1 and 2"),
    "intarsia": (intarsia, "yarn of carrier"),
    "empty": (Graph, "knit graph: has no stitches"),
    "tucks alone": (lambda: knitted(["T"], up=1), "has no stitches"),
    "another object": (lambda: (1, None, 2), "an object of type tuple is not a knit"),
}


@pytest.mark.parametrize(("graph", "reason"), WRONG.values(), ids=WRONG)
def test_what_no_letter_says_is_refused_as_in_a_file(graph, reason):
    with refusal(reason):
        repeat_of(graph())


def test_tucks_of_the_last_row_are_named(caplog):
    assert repeat_of(knitted(["KP", "KT"], up=3)) in (("KP", "KT"), ("KT", "KP"))
    assert "tucks that no loop is drawn through are left out" in caplog.text


def test_a_scene_takes_the_letters(plain_scene):
    cell = {"specimen": "cell", "fidelity": "beam", "interaction": "isotropic", "pattern.loops": 2}
    letters = {"pattern.rows": 2, "pattern.stitches": repeat_of(knitted(["KP", "PK"]))}
    scene = plain_scene.vary(cell | letters)
    assert scene.pattern.stitches in (("KP", "PK"), ("PK", "KP"))


SWATCHES = {
    "jersey_swatch": ("K",),
    "kp_rib_swatch": ("KP",),
    "seed_swatch": ("PK", "KP"),
    "lace_mesh": ("KK)KKKK(", "KTKKKT"),
}


@pytest.mark.needs("python -m pip install knit-graphs", module="knit_graphs")
@pytest.mark.parametrize("name", [*SWATCHES, "twist_cable", "jersey_tube"])
def test_swatches_of_knit_graphs(name):
    made = getattr(import_module("knit_graphs.basic_knit_graph_generators"), name)
    if name == "jersey_tube":
        with refusal("no step along a row"):
            repeat_of(made(6, 6))
    elif name == "twist_cable":
        assert repeat_of(made(8, 9)) == ("PK>K(P", "PKKP", "PK)K<P", "PKKP")
    else:
        assert repeat_of(made(13, 9)) == SWATCHES[name]


@pytest.mark.needs("python -m pip install knitout-interpreter", module="knitout_interpreter")
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_results_of_knitout_interpreter_have_the_letters_of_the_file(path):
    interpreter = import_module("knitout_interpreter.run_knitout")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        graph = interpreter.run_knitout(str(path))[2]
    assert repeat_of(graph) == repeat_of(path)
