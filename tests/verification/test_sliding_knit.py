"""Direct simulation of a knit whose yarns slide on each other: its ledger, stabilisation."""

import numpy as np
import pytest
from pull import pull

from knitstudy.measures.response import ledger_gap
from knitstudy.mechanics.batches import VARIABLE
from knitstudy.run.configuration import load_scene

WHOLE = {"specimen": "knit", "interaction": "isotropic", "load.stops": []}
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
    return load_scene("dns-tie-course-coarse").vary(whole if full else CELL)


@pytest.fixture(scope="module")
def history(scene):
    """Pulled in one go by one thread."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, "1")
        return pull(scene)


def test_ledger_of_energies(history, scene, verify):
    assert history["contact_slip"].max() > 1e-2 * scene.metres("mesh.size"), (
        "the cases here are about sliding"
    )
    verify.at_most("sliding knit: ledger of energies over external work", ledger_gap(history), 0.01)
    end = history["energy"].isel(increment=-1)
    assert end.sel(form="friction") > 0.05 * end.sel(form="external")


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
