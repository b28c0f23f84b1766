"""Beams that lead the way of spline yarns: the motion of sections as displacements of nodes, and the same path."""

import numpy as np
import pytest

from knitstudy.geometry.fabric_file import fabric_of
from knitstudy.geometry.lay_out import lay_out
from knitstudy.mechanics.rotation import exp
from knitstudy.models import beam_guide
from knitstudy.models.simulate import solve
from knitstudy.models.spline_yarns import discretise
from knitstudy.study.configuration import load_scene

TURN, SHIFT = np.array([0.3, -0.2, 0.5]), np.array([2e-3, -1e-3, 3e-3])


@pytest.fixture(scope="module")
def knit():
    scene = load_scene("dns-isotropic-wale-coarse")
    fabric = fabric_of(lay_out(scene))
    return scene, fabric, discretise(scene, fabric)


def test_yarns_follow_a_rigid_motion_of_the_beams(knit, verify):
    """Every coefficient turns with the knit, and those of the constant move with it."""
    scene, fabric, parts = knit
    guide = beam_guide.BeamGuide(scene, fabric, parts.space, np.arange(len(parts.nodes)))
    stations = beam_guide.beams_in_contact.build(guide.scene, fabric).stations
    rotation = exp(TURN)
    moved = stations.position @ rotation.T + SHIFT - stations.position
    guide.follow(
        stations, [0.0, 1.0], [np.zeros((len(moved), 6)), np.hstack([moved, np.tile(TURN, (len(moved), 1))])]
    )
    change = guide(0.0, 1.0).reshape(-1, 3)
    wanted = parts.nodes @ rotation.T - parts.nodes + parts.unity[:, None] * SHIFT
    off = np.abs(change - wanted).max() / np.abs(wanted).max()
    verify.at_most("spline yarns led by beams: a rigid motion, off by", off, 1e-3)
    assert guide(0.0, 1.1) is None, "the beams did not get there"


@pytest.mark.full
def test_forces_do_not_depend_on_a_guide(knit, verify, monkeypatch):
    scene, fabric, _ = knit
    alone = solve(scene, fabric)
    monkeypatch.setattr(beam_guide, "LARGE", 1)
    led = solve(scene, fabric)
    assert led["newton_iterations"].sum() != alone["newton_iterations"].sum(), "it was led"
    verify.within(
        "spline yarns led by beams: force over that without", led["force"][-1] / alone["force"][-1], 1, 1e-6
    )
