"""Histories of small scenes, one of nearly every kind, against recorded ones; and which keys they read.

Where a change of numbers is wanted, ``python tests/regression/test_histories.py`` records the present histories, and
the change says by how much they moved.
"""

import os
import platform
import sys
from functools import cache
from pathlib import Path

if platform.machine() == "x86_64":  # as tests/conftest.py does, where this file is not run by pytest
    os.environ.setdefault("OPENBLAS_CORETYPE", "Haswell")

import numpy as np
import pandas as pd
import pytest
import yaml

from knitstudy import simulate
from knitstudy.knit.scene.keys import Section
from knitstudy.run.configuration import load_scene

RECORDED = Path(__file__).with_suffix(".csv")

SHORT = {"load.strain": 0.01, "load.stops": [], "solver.increments": 2}
SCENES = yaml.safe_load(RECORDED.with_suffix(".yaml").read_text())
"""Scenes and the keys in which the recorded ones differ from them."""


IDLE = {"CellOfBeams": {"beam.section", "geometry.free"}}  # a yarn with a law of its own; drawn loops
"""Keys that the scenes here do not read, as other keys make them idle, by class of scenes."""


@cache
def simulated(name):
    """Return the history of a scene, its class, and the keys that nothing read."""
    scene = load_scene(name)
    scene = scene.vary(
        {key: value for key, value in SHORT.items() if scene.value(key) is not None} | SCENES[name]
    )
    read, get = set(), Section.__getattribute__

    def getting(section, key):
        frame = sys._getframe(1)
        if "_own_values" not in (
            frame.f_code.co_name,
            frame.f_back.f_code.co_name,
        ):  # of a scene that gets a name
            read.add((type(section), key))
        return get(section, key)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Section, "__getattribute__", getting)
        history = simulate(scene).history
    sections = scene.kind.sections.items()
    unread = {f"{of}.{key}" for of, part in sections for key in part.model_fields if (part, key) not in read}
    return history, scene.kind.part.__name__, unread


def measured(name):
    """Return the sum, and the root of the sum of squares, of every quantity of a history."""
    history, *_ = simulated(name)
    rows = []
    for quantity in sorted(map(str, history.data_vars)):
        if history[quantity].dtype.kind in "fi" and "time" not in quantity and "seconds" not in quantity:
            values = np.nan_to_num(history[quantity].to_numpy().astype(float))
            rows.append((name, quantity, values.sum(), np.linalg.norm(values)))
    return pd.DataFrame(rows, columns=["scene", "quantity", "sum", "norm"])


@pytest.mark.parametrize("name", SCENES)
def test_history_is_as_recorded(name):
    kept = pd.read_csv(RECORDED).query("scene == @name").set_index("quantity")
    now = measured(name).set_index("quantity")
    assert list(now.index) == list(kept.index)
    # Sums cancel: they are compared on the scale of the norms. Processors and BLAS differ in the last digits, which
    # Newton's tolerance of 1e-6 lets grow.
    for column in ("sum", "norm"):
        wrong = (now[column] - kept[column]).abs() > 1e-6 * (kept["norm"] + 1e-12)
        assert not wrong.any(), (now[wrong], kept[wrong])


def test_every_key_is_read():
    """A key that a kind of scenes does not read does not exist there: it would be set in vain."""
    unread = {}
    for name in SCENES:
        _, of, keys = simulated(name)
        unread[of] = unread.get(of, keys) & keys
    assert {of: keys for of, keys in unread.items() if keys} == IDLE


if __name__ == "__main__":
    pd.concat(map(measured, SCENES)).to_csv(RECORDED, index=False)
