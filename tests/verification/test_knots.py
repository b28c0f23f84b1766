"""Rods, and the rod benchmarks, `examples/knots`, on coarse meshes; `make knots` runs it in full."""

import ast
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from knitstudy.errors import ConfigurationError, ConvergenceError
from knitstudy.mechanics.beams.beam import BeamSection
from knitstudy.mechanics.beams.rods import CLAMPED, FREE, PINNED, End, Rods

BENCHMARKS = Path(__file__).resolve().parents[2] / "examples" / "knots"
SECTION = BeamSection(EA=4e6, kGA=1.5e6, EI=1.0, GJ=0.77)
LINE = np.linspace(0, 1, 17)[:, None] * [1, 0, 0]

# Meshes of the cheap version, and the largest error that its rows may have
CHEAP = {
    "elastica": ((16, 32), 0.01),
    "ring": ((8, 16), 1e-4),
    "frame": ((10,), 0.01),
    "writhing": ((48,), 0.03),
    "hertz": ((0.02,), 0.1),
    "sliding": ((0.04,), 0.1),
    "clasp": ((0.35,), 0.1),
}


def test_the_table_has_every_benchmark():
    """Made by `make knots`; theory is met within 3 %, or the page says why not."""
    table = pd.read_csv(BENCHMARKS.parents[1] / "resources" / "benchmarks.csv")
    assert table.benchmark.nunique() >= 10
    close = table.error.abs() <= 0.03
    assert close.groupby(table.benchmark).any().sum() >= 8


@pytest.mark.parametrize("name", CHEAP)
def test_benchmark(name, monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    meshes, bar = CHEAP[name]
    rows = import_module(name).main(meshes=meshes)
    assert rows.error.abs().max() <= bar


def test_braids_have_the_friction_of_both_theories(monkeypatch):
    """0.492 for one turn (Audoly et al. 2007), and what a turn of a long braid adds (Jawed et al. 2015)."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    braid = import_module("braid")
    friction = [braid.braid(turns).friction for turns in (1, 2, 3)]
    assert friction[0] == pytest.approx(0.492, abs=2e-3)
    np.testing.assert_allclose(np.diff(friction), braid.PER_TURN, rtol=0.01)


@pytest.mark.parametrize(("turns", "friction"), [(1, 0.0), (1, 0.1), (3, 0.1)])
def test_a_loose_knot_tends_to_its_leading_terms(turns, friction, monkeypatch):
    """F / k^2 = 1 / 2 + friction / e, on a loop that is a circle."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    e, braid = 1e-4, import_module("braid").braid(turns)
    knot = import_module("loose").knot(turns, e**2, friction)
    assert knot.force == pytest.approx(e**4 / 2 + friction * braid.friction * e**3, rel=0.015)
    assert knot.shortening == pytest.approx(2 * np.pi / e**2, rel=0.01)


def test_every_benchmark_is_one_short_documented_function():
    """`main` of at most 60 lines, through the public interface."""
    benchmarks = [
        path for path in BENCHMARKS.glob("*.py") if "\ndef main(" in path.read_text(encoding="utf-8")
    ]
    assert len(benchmarks) >= len(CHEAP)
    for path in benchmarks:
        (main,) = [
            part
            for part in ast.parse(path.read_text(encoding="utf-8")).body
            if getattr(part, "name", "") == "main"
        ]
        assert ast.get_docstring(main), path
        assert main.end_lineno - main.lineno < 60, path


def test_a_support_takes_over_a_dead_load():
    """A dead force pulls a rod; then its end is held where it is, and the support carries the force."""
    pull = {0: CLAMPED, 16: End(move=FREE, turn=FREE, force=(5.0, 0, 0))}
    *_, pulled = Rods([LINE], 1e-3, SECTION).path(pull, steps=1)
    assert not pulled.support[16].any()
    *_, held = pulled.rods.path({0: CLAMPED, 16: PINNED}, steps=1, start=pulled)
    np.testing.assert_allclose(held.support[[0, 16], 0], [-5.0, 5.0], rtol=1e-6)


def test_a_straight_rod_that_is_drawn_as_an_arc_straightens():
    """Its length stays, and no energy is left."""
    turn = np.linspace(0, 1.5, 25)
    drawn = np.column_stack([np.sin(turn), 1 - np.cos(turn), 0.1 * turn])
    *_, end = Rods([drawn], 1e-3, SECTION, natural=0.0).path({0: CLAMPED}, steps=4)
    length = np.linalg.norm(np.diff(drawn, axis=0), axis=1).sum()
    assert np.linalg.norm(end.curve()[-1] - end.curve()[0]) == pytest.approx(length, rel=1e-4)
    assert end.response.energy["internal"] < 1e-6


@pytest.mark.parametrize("steps", [10, 40])
def test_rods_that_slide_lose_their_work_whatever_the_increment(steps, monkeypatch):
    """Pressed and drawn over each other by a third of their patch at a time: Coulomb's force, and the energy it takes.

    Points come into contact and leave it; the work of those that part, and of the traction in the balanced state, was
    left out: 1 and 6 % of the force were missing.
    """
    monkeypatch.syspath_prepend(BENCHMARKS)
    hertz = import_module("hertz")
    rods, way = hertz.rigid(90, 0.04, hertz.MU), 0.2 * np.array([np.cos(0.5), np.sin(0.5), 0])
    pressed = hertz.moved(rods, (0, 0, -hertz.DEEP), 4)[-1]
    path = hertz.moved(rods, way, steps, pressed)[steps // 2 :]
    force = np.array([hertz.upper_force(rods, each) for each in path])
    energy = np.array([sum(each.response.energy.values()) for each in path])
    friction = np.array([each.response.energy["friction"] for each in path])
    work = np.trapezoid(force @ way, [each.load for each in path])
    # Without friction the force along the way is 1e-4 of that across it: of the points
    coulomb = force @ way / np.linalg.norm(way) / -force[:, 2]
    assert coulomb.mean() == pytest.approx(hertz.MU, rel=2e-3)
    assert energy[-1] - energy[0] == pytest.approx(work, rel=2e-3)
    assert np.diff(friction).min() > 0


def test_increments_of_rods_are_short_enough_for_the_balance_of_energies(monkeypatch):
    """Rods that stick at first: in five increments energies exceed the work by 5 %; a path takes more of them."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    hertz = import_module("hertz")
    rods, way = hertz.rigid(90, 0.04, hertz.MU), (0.05, 0.02, 0)
    pressed = hertz.moved(rods, (0, 0, -hertz.DEEP), 4)[-1]
    drawn = dict.fromkeys(rods.numbers[0], CLAMPED) | dict.fromkeys(rods.numbers[1], End(move=way))
    coarse, fine = (list(rods.path(drawn, 5, pressed, balance=share)) for share in (1.0, 0.02))
    assert len(coarse) == 5
    assert 6 < len(fine) < 40
    assert abs(coarse[-1].gap) > 0.05 * coarse[-1].work
    assert abs(fine[-1].gap) < 0.02 * fine[-1].work
    for path in coarse, fine:
        change = sum(path[-1].response.energy.values()) - sum(pressed.response.energy.values())
        assert path[-1].work - change == pytest.approx(path[-1].gap)
        force = np.array([hertz.upper_force(rods, each) for each in [pressed, *path]])
        work = np.trapezoid(force @ way, [0.0, *(each.load for each in path)])
        assert path[-1].work == pytest.approx(work)


def test_dead_loads_do_their_work():
    """A cantilever bent by a dead force and a dead moment, which are then taken off."""
    loads = {0: CLAMPED, 16: End(move=FREE, turn=FREE, force=(0, 0.5, 0), moment=(0, 0, 0.3))}
    *_, bent = Rods([LINE], 1e-3, SECTION).path(loads, 8)
    assert bent.work == pytest.approx(sum(bent.response.energy.values()), rel=5e-3)
    assert abs(bent.gap) < 5e-3 * bent.work
    *_, straight = bent.rods.path({0: CLAMPED, 16: End(move=FREE, turn=FREE)}, 8, bent)
    assert straight.work == pytest.approx(-bent.work, rel=0.01)


def test_nodes_that_do_not_exist_are_refused():
    with pytest.raises(ConfigurationError, match="rods have nodes 0 to 16, not"):
        next(Rods([LINE], 1e-3, SECTION).path({0: CLAMPED, 17: CLAMPED}))


def test_what_nothing_resists_is_named():
    """A straight rod that is pinned turns about its own axis for nothing, and about its end."""
    pinned = {0: PINNED, 16: End(move=FREE, turn=FREE, force=(0, 1.0, 0))}
    with pytest.raises(
        ConvergenceError, match=r"nothing resists a motion of node .* and the stiffness matrix is singular"
    ):
        list(Rods([LINE], 1e-3, SECTION).path(pinned, 1))


def test_arc_length_gives_up_where_nothing_balances():
    """Nothing holds the rod: its tangent is singular."""
    path = Rods([LINE], 1e-3, SECTION).arc_path({16: End(move=FREE, turn=FREE, force=(0, 1.0, 0))}, 0.1)
    with pytest.raises(ConvergenceError, match="no step by arc length"):
        next(path)
