"""Committed tables know what made their rows, and are stale where recorded numbers have moved."""

import sys

import keep
import pandas as pd
import promises
import pytest
from refusals import refusal

from knitstudy.run import behaviour as behaviour_module
from knitstudy.run import committed_tables
from knitstudy.run.behaviour import GEOMETRY, HISTORIES, behaviour, group_of, groups
from knitstudy.run.committed_tables import (
    RUN,
    is_up_to_date,
    keep_table,
    require_up_to_date,
    runs_of,
    stale_runs,
    with_runs,
)
from knitstudy.run.configuration import load_scene

TIED, TOUCHING = "cell spline_yarns tied", "cell spline_yarns touching"


@pytest.fixture
def moved(monkeypatch, tmp_path):
    """Function that changes the recorded numbers of a group by a share, of a quantity or of all."""

    def move(group, share, quantity=None):
        table = pd.read_csv(HISTORIES)
        rows = table["group"] == group
        if quantity is not None:
            rows &= table["quantity"] == quantity
        assert rows.any()
        table.loc[rows, ["sum", "norm"]] *= 1 + share
        path = tmp_path / "histories.csv"
        table.to_csv(path, index=False)
        monkeypatch.setattr(behaviour_module, "HISTORIES", path)
        behaviour_module._recorded.cache_clear()

    yield move
    behaviour_module._recorded.cache_clear()


def test_groups_are_of_specimen_model_and_contact():
    assert group_of(load_scene("cell-course")) == TIED
    assert group_of(load_scene("cell-wale-isotropic")) == TOUCHING
    cut, whole = "beam-isotropic-course", "reading-whole-beam-isotropic-course"
    assert group_of(load_scene(cut)) == group_of(load_scene(whole)) == "knit beam touching"
    assert {TIED, TOUCHING, GEOMETRY} < set(groups())


def test_behaviour_is_that_of_its_groups_to_five_digits(moved):
    before = {group: behaviour([group]) for group in groups()}
    assert len(set(before.values())) == len(before)
    moved(TIED, 1e-4)
    changed = {group for group in groups() if behaviour([group]) != before[group]}
    assert changed == {TIED}
    assert behaviour([TIED, TOUCHING]) == behaviour([TOUCHING, TIED])


@pytest.mark.parametrize(
    ("quantity", "share"), [("residual", 0.5), ("newton_iterations", 0.5), ("force", 1e-9)]
)
def test_what_solvers_leave_open_is_no_behaviour(moved, quantity, share):
    before = behaviour([TIED])
    moved(TIED, share, quantity)
    assert behaviour([TIED]) == before


def test_a_group_without_recorded_numbers_is_refused():
    with refusal("no recorded scene is of the group 'cell spline_yarns tie' .did you mean"):
        behaviour(["cell spline_yarns tie"])


def test_rows_know_their_runs_and_groups_their_staleness(moved, tmp_path):
    path = tmp_path / "table.csv"
    rows = pd.DataFrame({"scene": ["a", "b", "c"], "force [N]": [1.0, 2.0, 3.0]})
    kept = keep_table(rows, path, "make table", pd.Series([TIED, TOUCHING, TIED]))
    assert kept[RUN].tolist() == [1, 2, 1]
    assert runs_of(path)["groups"].to_dict() == {1: TIED, 2: TOUCHING}
    assert is_up_to_date(path)
    moved(TOUCHING, 1e-3)
    assert stale_runs(path) == [2]
    assert not is_up_to_date(path)
    again = pd.concat([kept[kept[RUN] == 1], rows[1:2]])
    assert keep_table(again, path, "make table", [TOUCHING])[RUN].tolist() == [1, 1, 2]
    assert stale_runs(path) == []
    assert list(runs_of(path).index) == [1, 2], "a run without rows goes"
    assert with_runs(path)["groups"].tolist() == [TIED, TIED, TOUCHING]


def test_a_table_without_groups_is_of_its_very_code(tmp_path, monkeypatch):
    path = tmp_path / "cases.csv"
    keep_table(pd.DataFrame({"case": ["a"]}), path, "make verify")
    assert is_up_to_date(path)
    monkeypatch.setattr(committed_tables, "physics_digest", lambda: "another")
    assert stale_runs(path) == [1]


def test_a_table_is_made_from_fresh_tables_alone(moved, tmp_path):
    """Else it would count as fresh itself; the message has the command of the table behind it."""
    path = tmp_path / "behind.csv"
    keep_table(pd.DataFrame({"value": [1.0]}), path, "make behind", [TIED])
    require_up_to_date(path)
    moved(TIED, 1e-3)
    with refusal(r"behind\.csv: is stale; run `make behind` first"):
        require_up_to_date(path)


@pytest.mark.parametrize(
    ("keep_it", "behind"),
    [
        (lambda: promises.main(), "trade.csv"),
        (lambda: keep.keep_verdicts(), "reference.csv"),
        (lambda: keep.keep_predictions(), "unknowns.csv"),
    ],
    ids=["promises", "verdicts", "predictions"],
)
def test_what_is_made_from_a_stale_table_is_not_kept(monkeypatch, keep_it, behind):
    monkeypatch.setattr(sys, "argv", ["keep"])
    monkeypatch.setattr(committed_tables, "behaviour", lambda groups: "moved")
    with refusal(rf"{behind}: is stale; run `"):
        keep_it()


def test_tables_of_a_folder_share_a_file_of_runs(tmp_path):
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    for path in (one, other, one):
        keep_table(pd.DataFrame({"value": [1.0]}), path, f"make {path.stem}", [GEOMETRY])
    assert runs_of(one)["command"].tolist() == ["make one"]
    assert runs_of(other)["command"].tolist() == ["make other"]
    assert not is_up_to_date(tmp_path / "absent.csv")
