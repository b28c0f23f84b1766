"""Direct simulation of a knit whose yarns slide on each other: what friction remembers, its ledger, stabilisation."""

import numpy as np
import pytest
from pull import pull

from knitstudy.loading.restart import Run
from knitstudy.measures.history_checks import ledger_gap
from knitstudy.mechanics.batches import VARIABLE
from knitstudy.study.configuration import load_scene

WHOLE = {"specimen": "knit", "load.stops": []}
"""Whole yarns: pieces of a cut cell that nothing ties come apart without a force."""

CELL = WHOLE | {
    "contact.tied_edges": "none",
    "pattern.loops": 1,
    "pattern.rows": 1,
    "mesh.size": 2 / 3,
    "load.strain": 0.015,
    "solver.increments": 6,
    "solver.linear": "three_scale",
}
"""One coarse cell, none of it tied, in which friction takes an eighth of the work."""


@pytest.fixture(scope="module")
def scene(full):
    """The coarse 3 x 3 knit, or a cell."""
    whole = WHOLE | {"load.strain": 0.02, "solver.increments": 8}
    return load_scene("dns-isotropic-course-coarse").vary(whole if full else CELL)


@pytest.fixture(scope="module")
def history(scene):
    """Pulled in one go by one thread."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, "1")
        return pull(scene)


def difference(one, other, name):
    """Largest difference of a variable in two histories over its largest value."""
    one, other = one[name].to_numpy(), other[name].to_numpy()
    return float(np.abs(one - other).max() / np.abs(one).max())


def in_one_order(history):
    """Contact points ordered by increment, surfaces, and place."""
    reference = history["contact_reference"].to_numpy().T
    keys = (*reference, *(history[f"contact_{name}"] for name in ("target", "yarn", "increment")))
    return history.isel(point=np.lexsort(keys))


def test_ledger_of_energies(history, scene, verify):
    assert history["contact_slip"].max() > 1e-2 * scene.metres("mesh.size"), (
        "the cases here are about sliding"
    )
    verify.at_most("sliding knit: ledger of energies over external work", ledger_gap(history), 0.01)
    end = history["energy"].isel(increment=-1)
    assert end.sel(form="friction") > 0.05 * end.sel(form="external")


def test_interrupted_and_restarted(tmp_path, history, scene, monkeypatch, verify):
    """Two threads, interrupted and started again, against one thread in one go: forces, and what points have slid."""
    monkeypatch.setenv(VARIABLE, "2")
    seen = []

    def interrupt(load, place):
        seen.append(load)
        if len(seen) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pull(scene, Run(restart=tmp_path / "run.npz", progress=interrupt))
    restarted = pull(scene, Run(restart=tmp_path / "run.npz", progress=lambda load, place: seen.append(load)))
    np.testing.assert_array_equal(np.unique(seen), history["load"])
    assert len(seen) == len(history["load"]) + 1, "what had converged is not computed again"
    what = "sliding knit, 1 thread against 2 threads interrupted and restarted"
    verify.at_most(f"{what}: force", difference(history, restarted, "force"), 1e-6)
    verify.at_most(f"{what}: net forces on yarns", difference(history, restarted, "yarn_force"), 1e-6)
    one, two = in_one_order(history), in_one_order(restarted)
    for name in ("increment", "yarn", "target", "cell", "sticks"):
        np.testing.assert_array_equal(one[f"contact_{name}"], two[f"contact_{name}"], name)
    verify.at_most(f"{what}: slip of all points", difference(one, two, "contact_slip"), 1e-6)


@pytest.fixture(scope="module")
def stabilised(scene):
    """The same knit held by viscous forces, and by a tenth of them."""
    return [pull(scene.replace("solver.stabilisation", share)) for share in (1e-9, 1e-10)]


def test_work_of_stabilisation_is_booked(stabilised, verify):
    """It takes something of every increment but the one that ends at full load."""
    strong, weak = (run["energy"].sel(form="stabilisation").to_numpy() for run in stabilised)
    assert (np.diff(strong)[:-1] > 0).all()
    assert strong[-1] == strong[-2]
    verify.within("stabilisation: its work over that of a tenth of it", strong[-1] / weak[-1], 10, 0.05)
    verify.at_most("stabilised knit: ledger of energies over external work", ledger_gap(stabilised[0]), 0.01)
