"""Histories of small scenes, one of nearly every kind, against recorded ones.

Where a change of numbers is wanted, ``python tests/regression/test_histories.py`` records the histories of today, and
the change says by how much they moved.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from knitstudy import load_scene, simulate

RECORDED = Path(__file__).with_suffix(".csv")

ONE = {"pattern.loops": 1, "pattern.rows": 1}
SHORT = {"load.strain": 0.01, "load.stops": [], "solver.increments": 2}
SCENES = {
    "cell-course": {"mesh.degree": 2, "mesh.crossing_degree": 2},
    "cell-wale-isotropic": {},
    "fabric-acrylic-stockinette-wale-free": {"load.strain": 0.05, "load.deformation": "course"},
    "beam-hertz-patch-isotropic-course": {"load.strain": 0.02},
    "beam-isotropic-wale": {"load.strain": 0.02},
    "dns-tie-course-coarse": ONE,
    "dns-tie-course": ONE | {"mesh.size": 0.6},
    "extreme-pair": {},
    "pair-slid-coarse": {},
    "pair-tied-30": {"mesh.size": 0.5, "gates.elements_across": 3.0},
    "rom2d-tie-wale": {},
    "rom3d-printed-tie-course": {},
    "rom3d-patch-tie-wale": {},
    "reading-whole-beam-isotropic-course": {},
    "reading-whole-rom3d-tie-course": {},
}
"""Scenes and the keys in which the recorded ones differ from them."""


def measured(name):
    """Return the sum, and the root of the sum of squares, of every quantity of a history."""
    scene = load_scene(name)
    changes = {key: value for key, value in SHORT.items() if scene.value(key) is not None} | SCENES[name]
    history = simulate(scene.vary(changes)).history
    rows = []
    for quantity in sorted(map(str, history.data_vars)):
        if history[quantity].dtype.kind in "fi" and "time" not in quantity and "seconds" not in quantity:
            values = np.nan_to_num(history[quantity].to_numpy().astype(float))
            rows.append((name, quantity, values.sum(), np.linalg.norm(values)))
    return pd.DataFrame(rows, columns=["scene", "quantity", "sum", "norm"])


@pytest.mark.parametrize("name", SCENES)
def test_history_is_as_recorded(name):
    kept = pd.read_csv(RECORDED, float_precision="round_trip").query("scene == @name").set_index("quantity")
    now = measured(name).set_index("quantity")
    assert list(now.index) == list(kept.index)
    # Sums cancel: they are compared on the scale of the norms. Processors and BLAS differ in the last digits, which
    # Newton's tolerance of 1e-6 lets grow.
    for column in ("sum", "norm"):
        wrong = (now[column] - kept[column]).abs() > 1e-6 * (kept["norm"] + 1e-12)
        assert not wrong.any(), (now[wrong], kept[wrong])


if __name__ == "__main__":
    pd.concat(map(measured, SCENES)).to_csv(RECORDED, index=False)
