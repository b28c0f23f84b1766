"""The quadratic element and CalculiX's C3D20R on one mesh; cells of spline yarns and their decks of C3D20R."""

import dataclasses

import calculix
import numpy as np
import pytest
from hexahedral_block import connect, unknowns, with_middles
from test_solids import EXACT

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.simulate import simulate, solve
from knitstudy.mechanics.contact.solid import SolidModel
from knitstudy.mechanics.core.increment import PrescribedDisplacement
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.materials.isotropic import StVenantKirchhoff
from knitstudy.mechanics.solids.elements import ElementGroup
from knitstudy.mechanics.solids.elements.hexahedron import QuadraticHexahedron
from knitstudy.run.configuration import load_scene
from knitstudy.use.decks.cell import cell_deck
from knitstudy.use.decks.deck import Deck, DeckStep, specimen_deck
from knitstudy.use.decks.inp import write_inp

pytestmark = [
    pytest.mark.ccx,
    pytest.mark.needs("apt-get install calculix-ccx (Debian, Ubuntu)", program=calculix.PROGRAM),
]

STRETCH = {"linear": 1e-5, "5 %": 0.05}


@pytest.mark.parametrize("case", STRETCH)
def test_c3d20r_is_the_quadratic_element_here(case, tmp_path):
    """A bent bar, its edges curved, one end held and the other one pulled and lifted."""
    strain = STRETCH[case]
    counts = np.array([6, 2, 2])
    grid = np.stack(np.meshgrid(*(np.arange(n + 1.0) for n in counts), indexing="ij"), axis=-1)
    straight, elements, _ = with_middles(grid.reshape(-1, 3), connect(counts))
    angle, radius = straight[:, 0] / 5, 5 + straight[:, 1]
    nodes = np.stack([radius * np.sin(angle), radius * np.cos(angle), straight[:, 2]], axis=1)
    held, driven = np.flatnonzero(straight[:, 0] == 0), np.flatnonzero(straight[:, 0] == counts[0])
    move = strain * counts[0] * np.array([1.0, 0.0, 0.5])
    steps = 1 if case == "linear" else 2
    material = StVenantKirchhoff(1300.0, 0.42)
    deck = Deck(
        title="bent bar",
        nodes=nodes,
        elements={"SOLID0": elements},
        node_sets={"HELD": held, "DRIVEN": driven},
        element="quadratic",
        material=material,
        hourglass=0.0,
        steps=(DeckStep({i + 1: move[i] for i in range(3)}, steps),),
        tolerance=1e-7,
    )
    write_inp(deck, tmp_path / "bar.inp", "calculix")
    theirs = calculix.run(tmp_path / "bar.inp").force[-1]
    group = ElementGroup(elements, QuadraticHexahedron(nodes[elements], material))
    model = SolidModel(nodes, [group], 1.0)
    value = np.concatenate([np.zeros(3 * len(held)), np.tile(move, len(driven))])
    drive = PrescribedDisplacement(np.concatenate([unknowns(held), unknowns(driven)]), value)
    settings = dataclasses.replace(EXACT, increments=steps, residual_tolerance=1e-9)
    *_, end = trace(model, drive, settings, LU())
    ours = end.response.force[unknowns(driven)].reshape(-1, 3).sum(axis=0)
    # Seven digits are printed.
    assert np.linalg.norm(ours - theirs) < 1e-6 * np.linalg.norm(theirs)


@pytest.fixture(scope="module")
def cell():
    """A tied 1 x 1 knit on a coarse mesh."""
    scene = load_scene("dns-tie-course").vary(
        {
            "pattern.loops": 1,
            "pattern.rows": 1,
            "mesh.size": 2 / 3,
            "mesh.element": "quadratic",
            "yarn.material": "st_venant_kirchhoff",
            "solver.increments": 2,
        }
    )
    knit = fabric_of(lay_out(scene))
    return scene, knit, mesh_fabric(knit, scene.mesh.size, growth=2.5)


def test_a_tied_knit_of_c3d20r(cell, tmp_path):
    """Discs whose springs are rigid in the deck."""
    scene, knit, mesh = cell
    scene = scene.replace("load.strain", 1e-5)
    deck = dataclasses.replace(specimen_deck(scene, knit, mesh), tolerance=1e-7)
    write_inp(deck, tmp_path / "knit.inp", "calculix")
    theirs = calculix.run(tmp_path / "knit.inp").force[-1, 0]
    ours = float(solve(scene, knit, mesh=mesh)["force"][-1])
    assert ours == pytest.approx(theirs, rel=1e-3)


JERSEY = {
    "pattern.control_points": None,
    "geometry.free": [],
    "pattern.course_spacing": 0.9e-3,
    "pattern.wale_spacing": 1.1e-3,
    "yarn.diameter": 0.25e-3,
    "yarn.youngs_modulus": 200e6,
    "yarn.material": "st_venant_kirchhoff",
    "contact.friction": 0.3,
    "mesh.span": 2.0,
    "load.lateral": "fixed",
}


@pytest.mark.parametrize(
    ("changes", "allowed"),
    [
        # Yarns apart: splines of degree 2 and C3D20R of the same yarn; -0.07 % with the loops of the base
        (
            {"load.deformation": "biaxial", "load.ratio": -2.0, "load.strain": 0.01, "solver.increments": 1},
            0.005,
        ),
        # Default spans: what the deck's penalty leaves of the law of local indentation
        ({"mesh.span": 0.9, "load.strain": 0.02, "solver.increments": 2}, 0.06),
    ],
    ids=["apart", "touching"],
)
def test_a_cell_of_c3d20r(changes, allowed, tmp_path):
    """A jersey whose periods are joined by equations: force per width along the courses."""
    scene = load_scene("cell-course-isotropic").vary(JERSEY | changes)
    geometry = lay_out(scene)
    ours = float(simulate(scene, geometry)["force_per_width"][-1, 0])
    fabric = fabric_of(geometry)
    write_inp(cell_deck(scene, fabric), tmp_path / "cell.inp", "calculix")
    theirs = calculix.run(tmp_path / "cell.inp").force[-1, 0] / fabric.periods[1, 1]
    assert theirs == pytest.approx(ours, rel=allowed)
