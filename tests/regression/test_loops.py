"""The kept table of loops that can be made is what the optimisation finds."""

from pathlib import Path

import pytest

from knitstudy.files import read_table
from knitstudy.geometry.lay_out import DIAMETERS, FREE, RATIOS, loop_row
from knitstudy.study.configuration import load_scene

KEPT = Path(__file__).resolve().parents[2] / "resources" / "reference" / "loops.csv"
KEYS = ["held fixed", "course ratio [1]", "yarn diameter [m]"]


def test_every_reading_and_value_is_in_the_table():
    assert len(read_table(KEPT)) == len(FREE) * (len(RATIOS) + len(DIAMETERS))


@pytest.mark.parametrize(
    ("keep", "ratio", "diameter"),
    [("shape", 0.9, 1.8e-3), ("length", 1.3, 1.8e-3)],
)
def test_loop_is_what_the_table_says(keep, ratio, diameter):
    kept = read_table(KEPT).set_index(KEYS).loc[(keep, ratio, diameter)].dropna()
    found = loop_row(load_scene("dns-tie-course"), keep, ratio, diameter)
    assert found["outcome"] == kept["outcome"]
    for name in ("wale spacing [m]", "yarn in a loop [m]", "interlock angle [deg]"):
        assert (name in found) == (name in kept)
        if name in found:
            # The minimum is found to 1e-6 of the gradient; angles beyond that vary with the order of sums.
            assert found[name] == pytest.approx(kept[name], rel=1e-4)
