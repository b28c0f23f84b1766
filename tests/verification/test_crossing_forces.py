"""What is recorded of contact points against what the solids feel, where multipliers carry part of the pressure."""

import numpy as np
import pytest

from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.lay_out import lay_out
from knitstudy.mesh.mesher import mesh_fabric
from knitstudy.models.simulate import solve
from knitstudy.study.configuration import load_scene


@pytest.fixture(scope="module")
def history():
    """Two crossed yarns pressed so deep that the penalty alone would let them in too far."""
    scene = load_scene("pair-pressed-90").replace("mesh.size", 0.25e-3).replace("solver.increments", 6)
    pair = Fabric.from_dataset(lay_out(scene))
    return solve(scene, pair, mesh=mesh_fabric(pair, scene.mesh.size, scene.mesh.growth))


def test_crossing_force_is_what_the_yarn_feels(history, verify):
    assert history["augmentations"].max() > 0, "the case here is about multipliers"
    crossing = history["crossing_force"].to_numpy()[:, 0]
    yarn = history["yarn_force"].to_numpy()[:, 0]
    error = np.abs(crossing - yarn).max() / np.abs(yarn).max()
    verify.at_most("pressed pair: force of the contact points against that on the yarn", error, 1e-6)
