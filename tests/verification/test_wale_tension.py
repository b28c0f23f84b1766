"""Direct simulation in wale tension: what holds in course tension holds there, yarn ends free."""

import numpy as np
import pytest
from pull import pull

from knitstudy.measures.history_checks import hourglass_share, ledger_gap
from knitstudy.study.configuration import load_scene

CELL = {"pattern.loops": 1, "pattern.rows": 1, "mesh.size": 0.6e-3}
"""One coarse cell; its yarns hold each other by nothing but their loops."""


@pytest.fixture(scope="module", params=["tie", "rough", "isotropic"])
def scene(request, full):
    """The 3 x 3 knit to 2%, or a cell to 1%."""
    changes = {"load.strain": 0.02, "mesh.size": 0.45e-3} if full else CELL | {"load.strain": 0.01}
    loose = {} if full or request.param == "tie" else {"contact.tied_edges": "none"}
    return load_scene(f"dns-{request.param}-wale").vary(changes | loose | {"solver.increments": 12})


@pytest.fixture(scope="module")
def history(scene):
    return pull(scene)


def test_every_increment_converges(history, scene, verify):
    what = f"wale tension, {scene.interaction}"
    verify.at_most(f"{what}: residual over mean internal force", float(history["residual"].max()), 1e-6)
    verify.at_most(f"{what}: last correction over h", float(history["correction"].max()), 1e-6)
    assert history["strain"][-1] == pytest.approx(scene.load.strain)
    if scene.interaction != "tie":
        deepest = -float(history["smallest_gap"].min())
        verify.at_most(f"{what}: penetration over h", deepest / scene.mesh.size, 0.01)


def test_ledger_of_energies(history, scene, verify):
    what = f"wale tension, {scene.interaction}"
    verify.at_most(f"{what}: ledger of energies over external work", ledger_gap(history), 0.01)
    verify.at_most(f"{what}: hourglass over internal energy", hourglass_share(history), 0.05)


def test_yarns_between_the_grips_are_in_balance(history, scene, verify):
    """What the rows pass on is what the grips pull; yarns with no grip take as much as they give."""
    force = history["yarn_force"].to_numpy()[-1]
    pulled = history["reaction"].to_numpy()[-1]
    what = f"wale tension, {scene.interaction}"
    scale = np.abs(pulled).max()
    verify.at_most(f"{what}: force on all yarns", np.abs(force.sum(axis=0)).max() / scale, 1e-5)
    verify.at_most(
        f"{what}: force on the top yarn and its grips", np.abs(force[-1] + pulled).max() / scale, 1e-5
    )
    if len(force) > 2:
        verify.at_most(f"{what}: force on a yarn between", np.abs(force[1:-1]).max() / scale, 1e-5)
