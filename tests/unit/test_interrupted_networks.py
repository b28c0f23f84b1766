"""Reduced models and beams in contact that were interrupted go on as if nothing had happened, and report progress."""

import numpy as np
import pytest

from knitstudy.loading.restart import Run
from knitstudy.models.simulate import solve


@pytest.fixture(scope="module")
def reduced(plain_scene, knit, contacts):
    """Function that loads a reduced model."""
    scene = plain_scene.replace("mesh.beam_size", 3.3)
    return lambda **files: solve(scene, knit, contacts=contacts, run=Run(**files))


@pytest.fixture(scope="module")
def planar(plain_scene, knit, contacts):
    """Function that loads a planar model."""
    return lambda **files: solve(
        plain_scene.replace("fidelity", "rom2d"), knit, contacts=contacts, run=Run(**files)
    )


@pytest.fixture(scope="module")
def touching(touching_cell, knit_of):
    """Function that loads one cell of beams whose yarns touch and slide."""
    keys = {"name": "beam", "mesh.beam_size": 10 / 9, "contact.friction": 0.1}
    scene = touching_cell.vary(keys | {"load.strain": 0.03})
    return lambda **files: solve(scene, knit_of(scene), Run(**files))


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


@pytest.mark.parametrize("model", ["reduced", "planar", "touching"])
def test_an_interrupted_run_goes_on(model, request, tmp_path):
    run, restart = request.getfixturevalue(model), tmp_path / "a.npz"
    whole = run()
    middle = float(whole["load"][len(whole["load"]) // 2])
    before = interrupted(run, restart, middle)
    assert restart.exists()
    after = []
    history = run(restart=restart, progress=lambda done, note: after.append(done))
    assert history.drop_vars("seconds").equals(whole.drop_vars("seconds"))
    np.testing.assert_array_equal([*before, *after[1:]], whole["load"])  # nothing is computed again
    after.clear()
    again = run(restart=restart, progress=lambda done, note: after.append(done))
    assert again.drop_vars("seconds").equals(history.drop_vars("seconds"))
    assert after == [1.0]
    if model == "touching":
        assert history["crossing_slip"].max() > 0
