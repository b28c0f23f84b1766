"""Beams that lead the way of spline yarns: the motion of sections as displacements of nodes, and the same path."""

import numpy as np
import pytest

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.models.spline_yarns import build
from knitstudy.knit.models.spline_yarns.build import discretise
from knitstudy.knit.scene.kinds import MODELS
from knitstudy.knit.simulate import solve
from knitstudy.mechanics.rotation import exp
from knitstudy.run.configuration import load_scene

ACROSS = {
    "yarn.transverse_modulus": 1e9,
    "yarn.transverse_poisson_ratio": 0.4,
    "yarn.axial_shear_modulus": 4e8,
}
TURN, SHIFT = np.array([0.3, -0.2, 0.5]), np.array([2e-3, -1e-3, 3e-3])


@pytest.fixture(scope="module")
def knit():
    scene = load_scene("dns-isotropic-wale-coarse")
    fabric = fabric_of(lay_out(scene))
    return scene, fabric, discretise(scene, fabric)


def test_yarns_follow_a_rigid_motion_of_the_beams(knit, verify):
    """Every coefficient turns with the knit, and those of the constant move with it."""
    scene, fabric, parts = knit
    beams = MODELS.find("beam").build(scene.vary(build.BEAMS), fabric)
    guide = build.BeamGuide(lambda: beams, fabric, parts.space, np.arange(len(parts.nodes)))
    stations = beams.stations
    rotation = exp(TURN)
    moved = stations.position @ rotation.T + SHIFT - stations.position
    way = np.hstack([moved, np.tile(TURN, (len(moved), 1))])
    guide.follow(stations, [0.0, 1.0], [np.zeros_like(way), way])
    change = guide(0.0, 1.0).reshape(-1, 3)
    expected = parts.nodes @ rotation.T - parts.nodes + parts.unity[:, None] * SHIFT
    off = np.abs(change - expected).max() / np.abs(expected).max()
    verify.at_most("spline yarns led by beams: a rigid motion, off by", off, 1e-3)
    assert guide(0.0, 1.1) is None, "the beams did not get there"


def test_what_beams_refuse_is_no_error(knit, monkeypatch):
    """A beam that is too long for a bend, and a yarn whose axis beams do not know."""
    scene, fabric, parts = knit
    monkeypatch.setattr(build, "LARGE", 1)
    nodes = np.arange(len(parts.nodes))
    monkeypatch.setitem(build.BEAMS, "mesh.beam_size", 3.0)
    assert build.guide_of(scene, fabric, parts.space, nodes)(0.0, 1.0) is None
    directional = scene.vary({"yarn.material": "transversely_isotropic"} | ACROSS)
    assert build.guide_of(directional, fabric, parts.space, nodes) is None


@pytest.mark.full
def test_forces_do_not_depend_on_a_guide(knit, verify, monkeypatch):
    scene, fabric, _ = knit
    alone = solve(scene, fabric)
    monkeypatch.setattr(build, "LARGE", 1)
    led = solve(scene, fabric)
    assert led["newton_iterations"].sum() != alone["newton_iterations"].sum(), "it was led"
    verify.within(
        "spline yarns led by beams: force over that without", led["force"][-1] / alone["force"][-1], 1, 1e-6
    )
