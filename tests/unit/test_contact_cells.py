"""Where cells of contact lie on solid yarns of polynomials, and which crossings are too near for the law."""

from dataclasses import replace

import numpy as np
import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.knit.models.spline_yarns.build import undeformed_yarns
from knitstudy.knit.yarns.discretisation import COARSE, contact_surfaces


@pytest.fixture(scope="module")
def scene(plain_scene):
    keys = {"fidelity": "spline_yarns", "interaction": "isotropic", "contact.tied_edges": "none"}
    return plain_scene.vary(keys | {"pattern.loops": 1, "pattern.rows": 1})


@pytest.fixture(scope="module")
def knit(scene, knit_of):
    return knit_of(scene)


def test_cells_are_small_near_crossings_only(scene, knit):
    _, rings = contact_surfaces(
        undeformed_yarns(scene, knit)[0], knit, scene.contact.cell, scene.contact.window
    )
    cell, window = scene.contact.cell * knit.radius, scene.contact.window * knit.radius
    for yarn, edges in enumerate(rings.arc_length):
        stations = knit.crossings.arc_length[knit.crossings.yarn == yarn]
        size, middle = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
        near = np.abs(middle[:, None] - stations).min(axis=1) < window
        assert edges[0] == 0
        assert edges[-1] == pytest.approx(knit.centrelines[yarn].length)
        assert size.min() > 0
        assert size[near].max() <= cell * (1 + 1e-9)
        assert 2 * cell < size[~near].max() <= COARSE * cell * (1 + 1e-9)


def test_crossings_nearer_than_their_windows_are_refused(scene, knit):
    wide = scene.vary({"contact.window": 4.0})
    thick = replace(knit, radius=2 * knit.radius)
    space = undeformed_yarns(wide, thick)[0]
    with pytest.raises(ConfigurationError, match=r"two crossings of a yarn are .* contact\.window, 4\.00"):
        contact_surfaces(space, thick, wide.contact.cell, wide.contact.window)
