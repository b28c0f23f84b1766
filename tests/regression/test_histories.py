"""Numbers of small scenes, at least one of every group of models, against recorded ones; and which keys they read.

Where a change of numbers is wanted, ``python tests/regression/test_histories.py`` records the present ones, and the
change says by how much they moved. Committed tables of a group whose numbers moved are stale then
(`knitstudy.run.committed_tables`).
"""

import os
import platform
import sys
from functools import cache

if platform.machine() == "x86_64":  # as tests/conftest.py does, where this file is not run by pytest
    os.environ.setdefault("OPENBLAS_CORETYPE", "Haswell")

import numpy as np
import pandas as pd
import pytest
import yaml

from knitstudy.datasets import write_table
from knitstudy.knit.scene.keys import Section
from knitstudy.run.behaviour import GEOMETRY, HISTORIES, OF_SOLVERS, group_of, groups
from knitstudy.run.configuration import load_scene, load_scenes
from knitstudy.run.plan import Plan
from knitstudy.run.store import Store

SHORT = {"load.strain": 0.01, "load.stops": [], "solver.increments": 2}

SCENES = yaml.safe_load(HISTORIES.with_suffix(".yaml").read_text())

LONG = {"lace"}  # a minute and more

SAME = 1e-6
"""Relative to the norm: processors and BLAS differ in the last digits, which Newton's tolerance of 1e-6 lets grow."""

NOISE = 1e-9  # norm below which a number is rounding, in its unit

FREE = {
    "jersey-with-legs-in-contact": 1e-5,
    "fabric-acrylic-stockinette-wale-free": 1e-5,
    "jersey-cycle": 1e-5,
    "jersey-pressed": 1e-5,
    "stitches-seed-wale": 1e-4,
    "cotton-at-rest-and-bent": 1e-3,
    "garter-sheared": 2e-2,
}
"""Scenes whose yarns lie where rounding leaves them, along themselves or where the drawing of loops is flat, and how
close their totals are. Processors with and without AVX-512 differ by up to half of that: 3e-7 in most, 4e-5 in the
seed, 2e-4 in cotton at rest, and 1.2e-2 in the energy of garter (7e-4 in its force)."""

TOTALS = ("cell_strain", "displacement", "energy", "force", "reaction")
"""Quantities that are compared of these scenes."""

IDLE = {"CellOfBeams": {"beam.section", "geometry.free"}}  # a yarn with a law of its own; drawn loops
"""Keys that the scenes here do not read, as other keys make them idle, by class of scenes."""

ROW = ["scene", "group", "quantity"]  # columns that name a row

PARAMETERS = [pytest.param(name, marks=[pytest.mark.full] if name in LONG else []) for name in SCENES]


def scene_of(name):
    """Return a recorded scene, and the stages that are recorded of it."""
    keys = dict(SCENES[name])
    stages = [*keys.pop("stages", []), "simulation"]
    scene = load_scene(keys.pop("scene", name))
    short = {key: value for key, value in SHORT.items() if scene.value(key) is not None}
    return scene.vary(short | keys), stages


@cache
def simulated(name):
    """Return results of a scene by their groups and stages, its class, and the keys that nothing read."""
    scene, stages = scene_of(name)
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
        plan = Plan.of()
        steps = plan.steps_of(plan.labelled(scene))
        store = Store()
        results = {stage: store.get(steps[stage]) for stage in stages}
    sections = scene.kind.sections.items()
    unread = {f"{of}.{key}" for of, part in sections for key in part.model_fields if (part, key) not in read}
    return results, scene.kind.part.__name__, unread


def measured(name):
    """Return the sum, and the root of the sum of squares, of every quantity of the results of a scene."""
    scene, _ = scene_of(name)
    results, *_ = simulated(name)
    rows = []
    for stage, result in results.items():
        group = GEOMETRY if stage == "geometry" else group_of(scene)
        for quantity in sorted(map(str, result.data_vars)):
            if result[quantity].dtype.kind in "fi" and "time" not in quantity and "seconds" not in quantity:
                values = np.nan_to_num(result[quantity].to_numpy().astype(float))
                shown = quantity if stage == "simulation" else f"{stage}: {quantity}"
                rows.append((name, group, shown, values.sum(), np.linalg.norm(values)))
    return pd.DataFrame(rows, columns=[*ROW, "sum", "norm"])


def moved(now, kept):
    """Return the rows of a scene that differ from the recorded ones. Sums cancel: they are compared by the norms.

    How a scene was solved is not compared.
    """
    both = now.merge(kept, how="outer", on=ROW, suffixes=("", " recorded"))
    scale = both["scene"].map(FREE).fillna(SAME) * (both["norm recorded"] + NOISE)
    same = [(both[name] - both[f"{name} recorded"]).abs() <= scale for name in ("sum", "norm")]
    says_nothing = both["quantity"].isin(OF_SOLVERS) | (
        both["scene"].isin(FREE) & ~both["quantity"].isin(TOTALS)
    )
    known = both[["sum", "sum recorded"]].notna().all(axis=1)
    return both[~(same[0] & same[1] | says_nothing & known)]


@pytest.mark.parametrize("name", PARAMETERS)
def test_numbers_are_as_recorded(name):
    kept = pd.read_csv(HISTORIES).query("scene == @name")
    assert len(kept) > 0, "nothing is recorded of it: run python tests/regression/test_histories.py"
    differs = moved(measured(name), kept)
    assert differs.empty, differs.to_string()


def test_every_group_of_scenes_is_recorded():
    assert {group_of(scene) for scene in load_scenes().values()} | {GEOMETRY} == set(groups())


def test_every_key_is_read():
    """A key that a kind of scenes does not read does not exist there: it would be set in vain."""
    unread = {}
    for name in SCENES:
        if name not in LONG:
            _, of, keys = simulated(name)
            unread[of] = unread.get(of, keys) & keys
    assert {of: keys for of, keys in unread.items() if keys} == IDLE


def record():
    """Record the numbers that moved; others stay to their last digit."""
    kept = pd.read_csv(HISTORIES)
    tables = []
    for name in SCENES:
        now = measured(name)
        before = now[ROW].merge(kept, how="left", on=ROW)
        differs = moved(now, kept.query("scene == @name"))
        if len(differs):
            print(f"{name}: {len(differs)} quantities moved or are new", flush=True)
        whole = len(differs) > 0 and name in FREE  # what is not compared moves with the totals
        same = ~now["quantity"].isin(now["quantity"] if whole else differs["quantity"])
        tables.append(now.where(~same, before, axis=0))
    write_table(pd.concat(tables), HISTORIES)


if __name__ == "__main__":
    record()
