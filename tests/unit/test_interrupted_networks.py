"""Reduced models, beams in contact and windows that were interrupted go on as if nothing had happened."""

from functools import partial

import numpy as np
import pytest

from knitstudy.loading.restart import Run
from knitstudy.models.simulate import solve


@pytest.fixture(scope="module")
def run(plain_scene, touching_cell, knit, contacts, knit_of):
    """Function that loads a reduced model, a planar one, beams that touch and slide, or a window of one cell."""
    touching = touching_cell.vary({"mesh.beam_size": 10 / 9, "contact.friction": 0.1, "load.strain": 0.03})
    window = {"fidelity": "window", "contact.cell": 0.5, "solver.increments": 2, "load.strain": 0.01}
    tied, cell = {"contacts": contacts}, knit_of(touching_cell)
    models = {
        "reduced": (plain_scene.replace("mesh.beam_size", 1.2), knit, tied),
        "planar": (plain_scene.replace("fidelity", "rom2d"), knit, tied),
        "touching": (touching, cell, {}),
        "window": (touching_cell.vary({"mesh.beam_size": 1.2} | window), cell, {}),
    }

    def load(model, **files):
        scene, fabric, data = models[model]
        return solve(scene, fabric, run=Run(**files), **data)

    return load


def interrupted(run, restart, after):
    """Run until a load factor has been reached, then be interrupted; return the load factors that were reported."""
    seen = []

    def report(done, note):
        seen.append(done)
        assert note.startswith("strain ")
        if done >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(restart=restart, progress=report)
    return seen


@pytest.mark.parametrize("model", ["reduced", "planar", "touching", "window"])
def test_an_interrupted_run_goes_on(model, run, tmp_path):
    run, restart = partial(run, model), tmp_path / "a.npz"
    whole = run()
    middle = float(whole["load"][len(whole["load"]) // 2])
    before = interrupted(run, restart, middle)
    assert restart.exists()
    after = []
    history = run(restart=restart, progress=lambda done, note: after.append(done))
    assert history.drop_vars("seconds").equals(whole.drop_vars("seconds"))
    np.testing.assert_array_equal([*before, *after[1:]], whole["load"])  # nothing is computed again
    if model == "touching":
        assert history["crossing_slip"].max() > 0
