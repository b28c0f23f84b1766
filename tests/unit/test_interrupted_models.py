"""Runs of all models that were interrupted go on as if nothing had happened."""

from functools import partial

import numpy as np
import pytest

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.loading.run import Run
from knitstudy.knit.simulate import solve
from knitstudy.run.configuration import load_scene

PAIR = {"fidelity": "spline_yarns", "pair.support": "ends", "pair.length": 3.7e-3}
PAIR |= {"load.path": [[0, 0, -4e-5], [5e-5, 0, -4e-5]]}


@pytest.fixture(scope="module")
def run(plain_scene, touching_cell, knit, contacts, knit_of):
    """Function that loads a reduced model, a planar one, beams that touch and slide, or solid yarns."""
    touching = touching_cell.vary({"mesh.beam_size": 10 / 9, "contact.friction": 0.1, "load.strain": 0.03})
    tied, cell = {"contacts": contacts}, knit_of(touching_cell)
    models = {
        "reduced": (plain_scene.replace("mesh.beam_size", 1.2), knit, tied),
        "planar": (plain_scene.replace("fidelity", "rom2d"), knit, tied),
        "touching": (touching, cell, {}),
    }

    def load(model, **files):
        if model in models:
            scene, fabric, data = models[model]
        else:
            changes = {"solver.increments": 6} | (PAIR if model.startswith("pair") else {})
            scene, data = load_scene(model).vary(changes), {}
            fabric = fabric_of(lay_out(scene))
        return solve(scene, fabric, run=Run(**files), **data)

    return load


def interrupted(run, restart, after, message):
    """Run until a load factor has been reached, then be interrupted; return the load factors that were reported."""
    seen = []

    def report(done, note):
        seen.append(done)
        assert note.startswith(message)
        if done >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(restart=restart, progress=report)
    return seen


LONG = pytest.param("extreme-yarns-slide", marks=pytest.mark.full)  # increments are halved for the ledger


@pytest.mark.parametrize(
    "model", ["reduced", "planar", "touching", "pair-slid-30", "extreme-yarns-tie", LONG]
)
def test_an_interrupted_run_goes_on(model, run, tmp_path):
    run, restart = partial(run, model), tmp_path / "a.npz"
    whole = run()
    middle = float(whole["load"][len(whole["load"]) // 2])
    before = interrupted(run, restart, middle, "leg " if model.startswith("pair") else "strain ")
    assert restart.exists()
    after = []
    history = run(restart=restart, progress=lambda done, note: after.append(done))
    assert history.drop_vars("seconds").equals(whole.drop_vars("seconds"))
    np.testing.assert_array_equal([*before, *after[1:]], whole["load"])  # nothing is computed again
    if model == "touching":
        assert history["crossing_slip"].max() > 0
