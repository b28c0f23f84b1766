"""Shapes at rest are stable: modes and waves against closed forms and larger cells, and ribs that fall over."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from refusals import refusal

from knitstudy import load_scene
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.models.beam.cell import HELD, build
from knitstudy.knit.models.beam.contact import contact_of
from knitstudy.knit.models.beam.rest import RelaxingCell, around_first_node, relax, tangent
from knitstudy.knit.models.beam.rows import cell_rows
from knitstudy.mechanics.cells.tiling import Tiling
from knitstudy.mechanics.cells.waves import Waves
from knitstudy.mechanics.core.stability import lowest_mode

COARSE = {"load.largest_force": None, "load.strain": 0.01, "mesh.beam_size": 0.8}


@cache
def shape_at_rest(fabric: str, loops: int, rows: int, start: str):
    """Scene, geometry and rest; tests that share a shape find it once."""
    scene = load_scene(f"fabric-acrylic-{fabric}-course-free")
    scene = scene.vary(COARSE | {"load.start": start, "pattern.loops": loops, "pattern.rows": rows})
    geometry = lay_out(scene)
    return scene, geometry, relax(scene, geometry)


def sizes(scene, rest):
    thickness = np.ptp(rest["centreline"].values[:, 2]) + scene.yarn.diameter
    return np.array(
        [
            rest.attrs["cell_width"] / scene.pattern.loops,
            rest.attrs["cell_height"] / scene.pattern.rows,
            thickness,
        ]
    )


def lowest_energy(scene, geometry, rest):
    """Energy per stitch [J] of a shape without friction."""
    model = build(scene.vary({"contact.friction": 0.0}), fabric_of(geometry), rest).observer.model
    stitches = scene.pattern.loops * scene.pattern.rows
    return sum(model._stored[form] for form in ("internal", "penalty")) / stitches


@pytest.mark.parametrize("n", [20, 200])
def test_the_lowest_mode_of_a_chain_under_compression_is_that_of_its_closed_form(n):
    """Links of length h under a force P, hinges of stiffness c: c w^2 / h^2 - P w / h with w = 4 sin^2(pi j / 2 n')."""
    h, c = 0.1, 1.0
    second = sp.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n))
    wave = 4 * np.sin(0.5 * np.pi * np.arange(1, n + 1) / (n + 1)) ** 2
    for P, sign in (
        (0.0, 1),
        (0.99 * c * wave[0] / h, 1),
        (1.01 * c * wave[0] / h, -1),
        (c * wave[3] / h, -1),
    ):
        expected = c * wave**2 / h**2 - P * wave / h
        mode = lowest_mode(c * second @ second / h**2 + P * second / h, np.ones(n), np.full(n, True))
        # of several negative eigenvalues the lowest one counts: the last force has three
        assert mode.stiffness == pytest.approx(expected.min(), rel=1e-6)
        assert np.sign(mode.stiffness) == sign
        assert mode.unstable == (sign < 0)


def test_waves_of_a_chain_of_masses_have_its_dispersion():
    """Springs k between neighbours along courses: K(q) = 2 k (1 - cos q), of Brillouin's monatomic chain."""
    cells, k = 5, 3.0
    neighbours = np.roll(np.eye(cells), 1, axis=1)
    ring = k * (2 * np.eye(cells) - neighbours - neighbours.T)
    K = sp.kron(ring, sp.diags([1.0, 0, 0, 0, 0, 0]), format="csr")
    tiling = Tiling.of(np.zeros(1, dtype=int), np.array([cells, 1]))
    waves = Waves(K, np.ones(6), tiling, neutral=np.empty((6, 0)))
    for phase in (0.3, 1.0, np.pi):
        expected = 2 * k * (1 - np.cos(phase))
        assert waves.tangent(np.array([phase, 0.0])).toarray()[0, 0] == pytest.approx(expected)


@pytest.mark.parametrize("fabric", ["rib", "garter"])
def test_a_shape_at_rest_is_a_minimum_and_the_same_in_a_cell_of_more_repeats(fabric):
    """Without friction the upright loops of both are a saddle (rib -0.5, garter -0.3 N/m): they fall over."""
    loops, rows = {"rib": (2, 1), "garter": (1, 2)}[fabric]
    scene, geometry, rest = shape_at_rest(fabric, loops, rows, "rest")
    assert rest.attrs["saddles"] > 0
    assert rest.attrs["saddle_stiffness"] < 0 < rest.attrs["lowest_stiffness"]
    assert rest.attrs["lowest_wave_stiffness"] > 0
    *larger, doubled = shape_at_rest(fabric, 2 * loops, rows, "rest")
    # both are found by the same steps but for rounding
    assert sizes(larger[0], doubled) == pytest.approx(sizes(scene, rest), rel=1e-4)
    # pushed to either side of its lowest mode, the fabric gains energy
    model = build(scene.vary({"contact.friction": 0.0}), fabric_of(geometry), rest).observer.model
    free = np.ones(model.size, dtype=bool)
    free[HELD] = False
    # yarns that slide along themselves cost nothing but what the division into beams makes of it
    sliding = around_first_node(model.sliding(model.start()))
    mode = lowest_mode(tangent(model, model.start()), model.scale, free, sliding)
    # strains of the lattice are displacements of the edges, and edges at rest are not those of the drawn loops
    assert mode.stiffness == pytest.approx(rest.attrs["lowest_stiffness"], rel=0.05)
    for side in (-1, 1):
        pushed = model.advance(model.start(), side * 0.01 * scene.yarn.diameter * mode.motion)
        assert sum(model.respond(pushed, stiffness=False).energy.values()) > 0


def test_waves_over_two_cells_are_modes_of_a_cell_of_two():
    """Bloch's theorem against the tangent of a cell of two, which has the waves of phase 0 and pi."""
    scene, geometry, rest = shape_at_rest("stockinette", 1, 1, "rest")
    frictionless = scene.vary({"contact.friction": 0.0})
    problem = build(frictionless, fabric_of(geometry), rest).observer
    model, state = problem.model, problem.model.start()
    cell = RelaxingCell(
        cell_rows(frictionless, fabric_of(geometry)), contact_of(frictionless), "straight", model
    )
    larger, tiled = cell.tiled(state, np.array([2, 1]))
    unit = sp.diags(1 / larger.model.scale[:-3])
    K = unit @ tangent(larger.model, tiled).tocsr()[:-3, :-3] @ unit
    expected = np.sort(np.linalg.eigvalsh(0.5 * (K + K.T).toarray()))
    counts = np.array([5, 5])
    much, state_of_much = cell.tiled(state, counts)
    scale = model.scale[: 6 * model.nodes]
    tiling = Tiling.of(cell.rows.stations.yarn, counts)
    waves = Waves(tangent(much.model, state_of_much), scale, tiling, neutral=np.empty((len(scale), 0)))
    found = []
    for phase in (0.0, np.pi):
        tangent_of_wave = waves.tangent(np.array([phase, 0.0])).toarray()
        found.append(np.linalg.eigvalsh(0.5 * (tangent_of_wave + tangent_of_wave.conj().T)))
    found = np.sort(np.concatenate(found))
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-8 * expected[-1])


def test_copies_of_a_shape_that_friction_holds_are_held_as_well():
    scene, geometry, rest = shape_at_rest("rib", 2, 1, "rest_with_friction")
    *larger, doubled = shape_at_rest("rib", 4, 2, "rest_with_friction")
    assert sizes(larger[0], doubled) == pytest.approx(sizes(scene, rest), rel=1e-9)
    one, four = (
        build(each[0], fabric_of(each[1]), each[2]).observer.model
        for each in ((scene, geometry, rest), (*larger, doubled))
    )
    force = [model.respond(model.start(), stiffness=False) for model in (one, four)]
    unheld = replace(
        four.start(), contact=replace(four.start().contact, traction=0 * four.start().contact.traction)
    )
    residual = [
        np.abs(response.force / model.scale).max() for response, model in zip(force, (one, four), strict=True)
    ]
    # edges of two copies carry the sum of their forces
    assert residual[1] < 2.01 * residual[0] + 1e-12
    assert np.abs(four.respond(unheld, stiffness=False).force / four.scale).max() > 100 * residual[1]


def half_cardigan(yarn, **keys):
    letters = {
        "pattern.stitches": ["KP", "KT"],
        "pattern.loops": 2,
        "pattern.rows": 2,
        "pattern.loop_length": None,
    }
    drawn = {"pattern.wale_spacing": 3.3e-3, "pattern.course_spacing": 2.2e-3}
    return load_scene(f"fabric-{yarn}-rib-course-free").vary(COARSE | letters | drawn | keys)


@pytest.mark.parametrize("yarn", ["acrylic", pytest.param("cotton", marks=pytest.mark.full)])
def test_a_half_cardigan_that_friction_holds_is_stable(yarn):
    """Pairs of points at Coulomb's limit have a tangent that is not symmetric: yarns are asked as they stick."""
    scene = half_cardigan(yarn)
    rest = relax(scene, lay_out(scene))
    assert rest.attrs["saddles"] == 0
    assert rest.attrs["lowest_stiffness"] > 0.1
    assert rest.attrs["lowest_wave_stiffness"] > 0.01


def test_yarns_that_stick_have_a_symmetric_tangent():
    scene, geometry, rest = shape_at_rest("rib", 2, 1, "rest_with_friction")
    model = build(scene, fabric_of(geometry), rest).observer.model
    state = model.start()
    contact = model._contact(state)
    limit = contact.active_pairs(model.at_points(state), model.vectors(state), state.contact).friction
    at_limit = np.linalg.norm(limit.traction, axis=1) > 0.999 * model.contact.mu * limit.force
    assert np.count_nonzero(at_limit) > 10  # yarns do slide here
    K = tangent(model, state)
    assert abs(K - K.T).max() < 1e-6 * abs(K).max()


def test_loops_that_pass_through_each_other_come_to_no_rest():
    """Loops of a half cardigan that are drawn too far apart lie 1.9 radii in each other, and would stay there."""
    scene = half_cardigan("acrylic", **{"pattern.wale_spacing": 4.2e-3, "pattern.course_spacing": 4.2e-3})
    with refusal("yarns overlap by 1.9.* radii; the limit gates.overlap .*smaller values of pattern"):
        relax(scene, lay_out(scene))
