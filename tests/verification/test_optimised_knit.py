"""The calibrated and optimised knit against what it was asked for, and its curves."""

import numpy as np
import pytest

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.geometry.spline import CatmullRom
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.mesh.section import GROWTH
from knitstudy.knit.simulate import build
from knitstudy.knit.yarns.joints import contacts_of_crossings
from knitstudy.run.configuration import load_scene


@pytest.fixture(scope="module")
def scene():
    return load_scene("dns-tie-course")


@pytest.fixture(scope="module")
def knit(scene):
    return fabric_of(lay_out(scene))


def test_yarns_just_do_not_touch(knit, verify):
    radius = knit.radius
    target = radius * (2 + knit.loop.clearance)
    error = np.abs(knit.crossings.distance - target).max() / radius
    verify.at_most("optimised knit: |D - 2R - c0| over R at the crossings", error, 1e-3)


def test_sizes_of_table_5(scene, knit, verify):
    mesh = mesh_fabric(knit, scene.mesh.size, GROWTH)
    verify.within("3 x 3 knit of solids, 0.3 mm: DOF", mesh.nodes.size, 189_513, 0.05)
    network = build(
        load_scene("rom3d-tie-course"), knit, contacts=contacts_of_crossings(knit)
    ).observer.network
    verify.within("3 x 3 knit, 3D model, 0.5 mm: DOF", 6 * network.beam_nodes, 5_994, 0.05)


def test_circle_is_approached_with_fourth_order(verify):
    def error(count):
        t = 2 * np.pi * np.arange(count) / count
        circle = CatmullRom(np.column_stack([np.cos(t), np.sin(t), 0 * t]), [0, 0, 0])
        return np.abs(np.linalg.norm(circle.value(np.linspace(0, 1, 50)), axis=1) - 1).max()

    order = np.log2(error(32) / error(64))
    verify.at_least("Catmull-Rom curve through a circle, order of the radius", order, 3.9, reference="4")
