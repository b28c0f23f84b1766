"""The price of accuracy, from the box to a promise: two tiny knits by two coarse models, and one of one's own."""

from pathlib import Path

import pytest
import yaml

from knitstudy.datasets import read_table

SMALL = yaml.safe_load(Path(__file__).with_name("sample.yaml").read_text())
BOX = {"loops": [1, 1], "rows": [1, 1], "lateral": ["fixed", "fixed"], "strain": [0.01, 0.05]}
KEYS = {"pattern.loops": 1, "pattern.rows": 1, "load.strain": 0.02}
KEYS |= {"pattern.course_spacing": 5e-3, "pattern.wale_spacing": 6e-3, "yarn.diameter": 1e-3}
ONE = [each for key, value in KEYS.items() for each in ("--set", f"{key}={value}")]


@pytest.mark.full  # a dozen simulations in processes of their own; its parts are tests/unit/test_trade and test_choice
def test_from_a_sample_to_a_promise(fresh):
    declared = fresh.folder / "config" / "trade.yaml"
    document = yaml.safe_load(declared.read_text()) | SMALL
    document["box"] |= BOX
    declared.write_text(yaml.safe_dump(document))
    (fresh.folder / "resources" / "trade.csv").unlink()

    def plan(*changes):
        asks = ("--question", "force", "--accuracy", "0.5")
        return fresh.run("-m", "knitstudy", "plan", "yarns-tie-course", *asks, *ONE, *changes)

    assert "no knits have been measured of cut-knit-tied" in plan().stderr
    ended = fresh.run("benchmarks/trade.py", "--first", "2")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert ended.stdout.count(": ended, ") == 12
    table = read_table(fresh.folder / "results" / "trade" / "trade.csv")
    assert set(table["case"]) == {"cut-knit-tied", "cell-tied", "cut-knit-tied-large", "cell-tied-large"}
    assert (table["question"].value_counts()[["force", "curve"]] == 12).all()
    assert (table["error [1]"] < 1).all(), table[["case", "model setting", "question", "error [1]", "reason"]]
    assert ": ended, " not in fresh.run("benchmarks/trade.py", "--first", "2").stdout

    assert "2 of 2 knits, " in ended.stdout
    assert ", 0 runs failed" in ended.stdout
    promised = plan()
    assert "take yarns2: error of the simulation at most" in promised.stdout, promised.stderr
    assert "on 50 % of the knits in the box of config/trade.yaml, at 50 % confidence" in promised.stdout

    beyond = ("--set", "yarn.poisson_ratio=0.47")
    assert "yarn.poisson_ratio is 0.47, but models were measured from 0.1 to 0.45" in plan(*beyond).stderr
    measured = fresh.run("-m", "knitstudy", "measure", "yarns-tie-course", *ONE, *beyond)
    assert "kept in measured.csv" in measured.stderr, measured.stderr
    own = plan(*beyond)
    assert "on this very knit\n" in own.stdout, own.stdout + own.stderr  # by this code
