"""Inputs that a run of a reduced model refuses, and the columns that it records."""

import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.simulate import solve


def with_area(contacts, scene, radius):
    """Return tied contacts on discs of a radius over the yarn's."""
    area = np.pi * (radius * scene.yarn.radius) ** 2
    return contacts.assign(area=contacts["area"] * 0 + area, tied=contacts["area"] * 0 + 1)


@pytest.mark.parametrize("joint", ["rigid", "patch"])
def test_ties_need_no_simulation(plain_scene, knit, contacts, joint):
    """Tied crossings of a simulation are those of the geometry and the radius of ties."""
    keys = {"rom.joint": joint, "mesh.beam_size": 1.2, "solver.increments": 1, "load.strain": 0.002}
    scene = plain_scene.vary(keys | {"tie.radius": 0.3, "rom.contacts_from": None})
    measured = with_area(contacts, scene, 0.3)
    assert float(solve(scene, knit)["force"][-1]) == float(solve(scene, knit, contacts=measured)["force"][-1])


def test_joints_that_yield_are_softer_than_pins(plain_scene, knit, contacts):
    scene = plain_scene.vary({"mesh.beam_size": 1.2, "solver.increments": 1, "load.strain": 0.002})
    tied = with_area(contacts, scene, 0.4)
    pinned, patch = (
        float(solve(scene.replace("rom.joint", joint), knit, contacts=tied)["force"][-1])
        for joint in ("pinned", "patch")
    )
    assert 0.8 * pinned < patch < 0.99 * pinned


@pytest.mark.parametrize("size", [0.0, 0.05, 0.7])
def test_joints_that_yield_need_ties_of_a_size(plain_scene, knit, contacts, size):
    tied = with_area(contacts, plain_scene, size)
    with refusal(r"ties have a radius .* but rom\.joint 'patch' needs"):
        solve(plain_scene.replace("rom.joint", "patch"), knit, contacts=tied)


def test_contacts_of_another_knit_are_refused(plain_scene, knit, contacts):
    with refusal("35 crossings that are not the 36"):
        solve(plain_scene, knit, contacts=contacts.isel(crossing=slice(35)))


def test_contact_without_centroid_is_refused(plain_scene, knit, contacts):
    centroid = contacts["centroid"].copy()
    centroid[5] = np.nan
    with refusal("row 0, column 1, zone 1 has no centroid"):
        solve(plain_scene, knit, contacts=contacts.assign(centroid=centroid))
