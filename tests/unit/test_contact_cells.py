"""Where cells of contact lie on solid yarns of polynomials, and which crossings are too near for the law."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.models.spline_yarns.build import space_on, yarn_spans
from knitstudy.knit.yarns.discretisation import COARSE, contact_surfaces


@pytest.fixture(scope="module")
def scene(plain_scene):
    keys = {"fidelity": "spline_yarns", "interaction": "isotropic", "contact.tied_edges": "none"}
    return plain_scene.vary(keys | {"pattern.loops": 1, "pattern.rows": 1})


@pytest.fixture(scope="module")
def knit(scene, knit_of):
    return knit_of(scene)


def test_cells_are_small_near_crossings_only(scene, knit):
    _, rings = contact_surfaces(scene, space_on(scene, yarn_spans(scene, knit)), knit)
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
    space = space_on(wide, yarn_spans(wide, thick))
    with refusal(r"two crossings of a yarn are .* contact\.window, 4\.00"):
        contact_surfaces(wide, space, thick)
