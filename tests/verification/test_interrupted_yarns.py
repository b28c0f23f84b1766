"""Runs of solid yarns that go on from a restart file: the same history to the last bit."""

import numpy as np
import pytest

from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.restart import Run
from knitstudy.loading.solve import solve_load_path
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models.simulate import build
from knitstudy.stages.table import STAGES
from knitstudy.study.configuration import load_scene


@pytest.fixture(scope="module", params=["extreme-yarns-tie", "extreme-yarns-slide"])
def begin(request):
    """Return the problem of a cell anew: nothing of an earlier run is left."""
    scene = load_scene(request.param).vary({"solver.increments": 6})
    geometry = STAGES["geometry"].function(scene)
    mesh = STAGES["mesh"].function(scene, geometry)
    return lambda: build(scene, Fabric.from_dataset(geometry), mesh=SweptMesh.from_dataset(mesh))


def test_what_goes_on_is_what_was_never_interrupted(begin, tmp_path, verify):
    """Tied, and sliding with increments that are halved for the ledger."""
    seen = []

    def end(load, place):
        seen.append(load)
        if load > 0.5:
            raise KeyboardInterrupt

    restart = tmp_path / "a.npz"
    with pytest.raises(KeyboardInterrupt):
        solve_load_path(begin(), Run(restart=restart, progress=end))
    gone_on, whole = solve_load_path(begin(), Run(restart=restart)), solve_load_path(begin())
    assert 0.5 < seen[-1] < 1
    computed = [name for name in whole if "seconds" not in name]
    apart = [name for name in computed if not np.array_equal(gone_on[name], whole[name], equal_nan=True)]
    verify.at_most(
        f"{whole.attrs['scene']}, gone on with at {seen[-1]:.2g}: variables that differ", len(apart), 0
    )
    assert int(gone_on["krylov_iterations"].sum()) == int(whole["krylov_iterations"].sum())
