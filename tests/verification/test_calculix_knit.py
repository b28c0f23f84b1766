"""A tied 1 x 1 knit pulled by CalculiX and by this code on the same mesh."""

from dataclasses import replace

import numpy as np
import pytest

from knitstudy.exchange import calculix
from knitstudy.exchange.deck import specimen_deck
from knitstudy.exchange.inp import write_inp
from knitstudy.geometry.loop import Loop
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.elements import ElementGroup
from knitstudy.mechanics.elements.calculix_one_point import CalculixHexahedron
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear.direct import LU
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.solid import SolidModel
from knitstudy.mesh.knit import mesh_knit
from knitstudy.models.discretisation import discretised
from knitstudy.models.ties import tie_patches
from knitstudy.study.configuration import load_scene

pytestmark = [
    pytest.mark.ccx,
    pytest.mark.skipif(not calculix.available(), reason="CalculiX (ccx) is not installed"),
]

SIZE, INCREMENTS, STRAIN = 0.6e-3, 2, 0.05
SCENE = load_scene("dns-tie-course").vary(
    {
        "yarn.material": "st_venant_kirchhoff",
        "load.strain": STRAIN,
        "solver.increments": INCREMENTS,
    }
)


@pytest.fixture(scope="module")
def knit():
    """One cell of a loop in closed form, of a yarn that just fits between its crossings."""
    t = 2 * np.pi * np.arange(16) / 16
    wale, course, height, bulge, depth = 11e-3, 8.5e-3, 13.8e-3, 2.3e-3, 1.45e-3
    points = np.stack(
        [wale * t / (2 * np.pi) + bulge * np.sin(2 * t), -0.5 * height * np.cos(t), -depth * np.cos(2 * t)],
        axis=1,
    )
    distance = Knit(Loop(points, wale, course, 0.8e-3), 1, 1).crossings.distance
    clearance = 0.01
    return Knit(Loop(points, wale, course, distance.min() / (2 + clearance), clearance), 1, 1)


@pytest.fixture(scope="module")
def mesh(knit):
    return mesh_knit(knit, SIZE, growth=1.3)


@pytest.fixture(scope="module")
def patches(mesh, knit):
    scene = SCENE.vary({"mesh.size": SIZE, "gates.elements_across": 2})
    parts = discretised(scene, mesh, knit)
    return tie_patches(parts, knit, np.ones(4, dtype=bool), 0.183, scene.yarn.youngs_modulus)


def pulled_here(knit, mesh, tie, element, *options):
    """Reaction in N of every increment, with this code."""
    material = Material("st_venant_kirchhoff", SCENE.yarn.youngs_modulus, SCENE.yarn.poisson_ratio)
    elements = element(mesh.nodes[mesh.hexahedra], material, *options)
    groups = [ElementGroup(mesh.hexahedra, elements)]
    model = SolidModel(mesh.nodes, groups, SIZE, links=tie.links)
    held, driven = (3 * mesh.end_nodes(side)[:, None] + np.arange(3) for side in ("left", "right"))
    value = np.zeros((len(driven), 3))
    value[:, 0] = STRAIN * knit.loops * knit.loop.wale_spacing
    drive = PrescribedDisplacement(
        np.concatenate([held.ravel(), driven.ravel()]), np.append(np.zeros(held.size), value.ravel())
    )
    path = trace(model, drive, Settings(increments=INCREMENTS), LU())
    return np.array([increment.response.force[driven[:, 0]].sum() for increment in path][1:])


def pulled_by_calculix(folder, deck):
    write_inp(deck, folder / "deck.inp", "calculix")
    run = calculix.run(folder / "deck.inp")
    assert not run.warnings
    return run


def test_patches_as_equations_give_the_force_of_stiff_springs(knit, mesh, patches, tmp_path, verify):
    """Equations are springs without compliance: ties of 100 E R are softer by what that is worth, and no more."""
    deck = specimen_deck(SCENE, knit, mesh)
    assert deck.equations is not None
    force = pulled_by_calculix(tmp_path, replace(deck, tolerance=1e-7)).force[:, 0]
    own, stiff = (
        pulled_here(knit, mesh, each, CalculixHexahedron)
        for each in (patches, replace(patches, stiffness=1000 * patches.stiffness))
    )
    np.testing.assert_allclose(stiff, force, rtol=1e-5)
    assert (own < stiff).all()
    verify.at_most(
        "tied patches: springs against CalculiX's equations, force", np.abs(own / force - 1).max(), 1e-3
    )
