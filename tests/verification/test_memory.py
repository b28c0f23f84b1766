"""Memory of a rib with friction, `examples/memory`, in coarse increments; `python examples/memory` runs all of it."""

import runpy
from pathlib import Path

import matplotlib.pyplot as plt

MEMORY = Path(__file__).resolve().parents[2] / "examples" / "memory" / "__main__.py"


def test_a_rib_wipes_out_cycles_and_repeats_them():
    """Return-point memory: cycles close, and are alike on loading and on unloading."""
    figure, axes = plt.subplots()
    rows = runpy.run_path(str(MEMORY))["rib"](axes, increments=100)
    plt.close(figure)
    upper, lower, alike = (row[4] for row in rows)
    assert abs(upper) < 0.02
    assert abs(lower) < 0.02
    assert abs(alike - 1) < 0.02
