"""Cells of beams in contact that are bent: the flat cell, closed forms of rods, energies, and strips of many cells."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
import yaml

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.models.beam import bending
from knitstudy.knit.models.beam.cell import HELD, build
from knitstudy.knit.models.beam.contact import contact_of
from knitstudy.mechanics.beams.beam import BeamSection, BeamState, LineHistory
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.laws import Power, Repulsion
from knitstudy.mechanics.beams.line_contact import LineContact
from knitstudy.mechanics.cells.beams import EndlessBeams, EndlessState
from knitstudy.mechanics.cells.bent import BentBeams, BentPatch
from knitstudy.mechanics.cells.lattice import Lattice
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU, factorise
from knitstudy.mechanics.core.load_path import trace
from knitstudy.run.configuration import load_scene
from knitstudy.run.stages import STAGES

KEYS = yaml.safe_load(Path(__file__).with_name("endless_beams.yaml").read_text())


@pytest.fixture(scope="module")
def soft():
    """Scene, geometry, and shape at rest of a jersey of soft yarn, without friction there."""
    scene = load_scene("cell-course-isotropic").vary(KEYS["soft yarn"])
    geometry = lay_out(scene)
    return scene, geometry, STAGES["rest"].function(scene, geometry)


def cell_of(soft, along, friction=None):
    """Return the flat cell and the cell to be bent."""
    scene, geometry, rest = soft
    scene = scene if friction is None else scene.vary({"contact.friction": friction})
    cell = build(scene, fabric_of(geometry), rest).observer
    return cell, bending.bent(scene, cell, along)


@pytest.mark.parametrize("along", [0, 1])
@pytest.mark.parametrize("start", ["rest", "rest_with_friction"])
def test_a_cell_that_is_not_bent_is_the_flat_cell(soft, along, start):
    scene, geometry, rest = soft
    if start != "rest":
        scene = scene.vary({"load.start": start})
        rest = STAGES["rest"].function(scene, geometry)
    cell, model = cell_of((scene, geometry, rest), along)
    flat, n = cell.model, 6 * model.nodes
    states = flat.start(), model.start()
    assert len(states[0].contact.key) == len(states[1].contact.key) >= 100 * (start != "rest")
    assert states[1].contact.stored.sum() == pytest.approx(states[0].contact.stored.sum(), rel=1e-12)
    step = 1e-2 * scene.yarn.diameter / flat.scale * np.sin(np.arange(flat.size))
    same = n + 2 * (start == "rest")  # friction has sheared the other one a little: it is turned
    step[same:] = 0.0
    one, other = (
        each.respond(each.advance(state, np.append(step, np.zeros(each.size - flat.size))), stiffness=True)
        for each, state in zip((flat, model), states, strict=True)
    )
    for each in (np.s_[:n], np.s_[n:same]):
        np.testing.assert_allclose(
            other.force[each], one.force[each], rtol=0, atol=1e-10 * np.abs(one.force).max()
        )
    K, bent = one.stiffness.toarray()[:same, :same], other.stiffness.toarray()[:same, :same]
    np.testing.assert_allclose(bent, K, rtol=0, atol=1e-11 * np.abs(K).max())
    for form, energy in one.energy.items():
        assert other.energy[form] == pytest.approx(energy, rel=1e-9, abs=1e-20), form


@pytest.mark.parametrize("along", [0, 1])
def test_the_tangent_of_a_bent_cell_is_the_derivative_of_its_forces(soft, along):
    """With friction, far from balance, at an angle of 0.1 a period; the force on the angle is the moment."""
    _, model = cell_of(soft, along)
    diameter, rng = soft[0].yarn.diameter, np.random.default_rng(2)
    step = 2e-3 * diameter / model.scale * rng.normal(size=model.size)
    step[-1] = 0.1
    state = model.advance(model.start(), step)
    K = model.respond(state, stiffness=True).stiffness
    for chosen in (np.s_[:], np.s_[-4:], np.s_[-1:]):
        way = np.zeros(model.size)
        way[chosen] = (1e-6 * diameter * rng.normal(size=model.size) / model.scale)[chosen]
        ahead, back = (model.respond(model.advance(state, sign * way), False) for sign in (1, -1))
        change = 0.5 * (ahead.force - back.force) / model.scale
        np.testing.assert_allclose(change, K @ way / model.scale, rtol=0, atol=1e-5 * np.abs(change).max())
    frictionless = cell_of(soft, along, friction=0.0)[1]
    state = frictionless.advance(frictionless.start(), step)
    way[:] = 0.0
    way[-1] = 1e-4
    energies = [
        sum(frictionless.respond(frictionless.advance(state, sign * way), False).energy.values())
        for sign in (1, -1)
    ]
    moment = frictionless.respond(state, False).force[-1]
    assert (energies[0] - energies[1]) / 2e-4 == pytest.approx(moment, rel=1e-5)


@pytest.mark.parametrize("slope", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("angle", [0.3, 1.2])
def test_straight_yarns_at_an_angle_are_helices(slope, angle, verify):
    """A yarn at alpha to the way of bending turns by phi a period: m = kappa cos a (EI cos^2 a + GJ sin^2 a) / s."""
    length, width, count, radius = 20.0, 15.0, 10, 0.5
    section = BeamSection(EA=9e6, kGA=3e6, EI=50.0, GJ=35.0)
    s = np.arange(count) * length / count
    way = np.array([np.cos(slope), np.sin(slope), 0.0])
    lattice = Lattice(np.array([length * way, [0.0, width, 0.0]]))
    owner, image = np.append(np.arange(count), 0), np.zeros((count + 1, 2), dtype=int)
    image[-1, 0] = 1
    nodes = np.multiply.outer(np.append(s, length), way)
    inner = BeamModel(nodes, np.column_stack([np.arange(count), np.arange(1, count + 1)]), section, radius)
    yarn, period = np.zeros(count, dtype=int), np.array([length])

    def contact(yarn, s, period=None):
        points = ContactPoints.of(yarn, s, 1, period)
        line = points.yarn, points.arc_length, points.weight, Repulsion(Power(1.0, 1.5), 2 * radius, 0.1)
        return LineContact(*line, period=period), points

    flat = EndlessBeams(inner, owner, image, lattice, *contact(yarn, s, period))
    patch = BentPatch.around(yarn, s, period, nodes[:-1], lattice.vectors, 2.2 * radius)
    model = BentBeams(flat, flat.start(), *contact(patch.yarn, patch.arc_length), patch, along=0)
    model.drag *= 1e-6  # holds loose yarns within increments: none are here
    held = np.append(np.arange(6), model.size - np.array([3, 2, 1]))  # the first node, s, s' and phi
    path = PrescribedDisplacement(held, np.append(np.zeros(8), angle))
    *_, last = trace(model, path, Settings(increments=4), LU())
    size, across = model.per_curvature
    assert size == pytest.approx(length * np.cos(slope))
    stiffness = (section.EI * np.cos(slope) ** 2 + section.GJ * np.sin(slope) ** 2) * np.cos(slope) / width
    moment = last.response.force[-1] / across
    verify.within(
        f"yarns at {slope:g} rad, bent by {angle:g} rad", moment, stiffness * angle / size, rel := 1e-6
    )
    assert model.bending_stiffness(model.start(), held[:-1]) == pytest.approx(stiffness, rel=rel)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_bending_there_and_back_balances_energy_and_a_jersey_curls(soft, friction, monkeypatch):
    """Sides of a jersey curl to its back, upper and lower edges to its front: the textbooks' fact."""
    monkeypatch.setattr(bending, "CURVATURE", 100.0)
    monkeypatch.setattr(bending, "STEPS", 3)
    monkeypatch.setattr(bending, "TURNS", np.array([1.0, 0.0]))
    scene, geometry, rest = soft
    turning = {"load.turns": [0.1], "load.strain": 0.05, "contact.friction": friction}
    made = bending.bend(scene.vary(turning), geometry, rest)
    assert made.attrs["ended"] == ""
    for way, sign in ((0, -1), (1, 1)):
        curvature, moment, lost = (made[name].values[way] for name in bending.NAMES)
        assert curvature[[0, 3, -1]] == pytest.approx([0.0, 100.0, 0.0], abs=1e-9)
        assert sign * moment[0] > 0
        first, stiffness = (moment[1] - moment[0]) / curvature[1], float(made.first_bending_stiffness[way])
        work = np.trapezoid(moment, curvature)
        if friction:
            assert np.all(np.diff(lost) > 0)
            assert first < 1.1 * stiffness
            assert work == pytest.approx(lost[-1], rel=0.5)  # the rest is elastic slip that stays
            assert moment[-2] < moment[2]
        else:
            assert first == pytest.approx(stiffness, rel=0.06)
            assert moment[::-1] == pytest.approx(moment, abs=1e-4 * np.ptp(moment))
            assert abs(work) < 1e-4 * np.ptp(moment) * 100.0


# A strip of cells, whose first and last cells are rigid grips, bent along the wales; its width repeats. The grips hold
# the width, so that the cell's is held.
GRIP = 2


def strip(soft, count, friction):
    """Return a strip of so many flat cells, the cell of every node, and positions of nodes."""
    scene, geometry, _ = soft
    cell, _ = cell_of(soft, 1, friction)
    rows, law = cell.rows, replace(contact_of(scene), friction=friction)
    n, Y, vectors = len(rows.stations.yarn), len(rows.period), cell.model.lattice.vectors
    number = np.arange(count)[:, None]

    def tiled(values, jump):
        return (values + np.multiply.outer(np.arange(count), jump)[:, None]).reshape(-1, *values.shape[1:])

    owner = np.append(np.arange(count * n), (rows.owner[n:] + n * number).ravel())
    image = np.zeros((len(owner), 2), dtype=int)
    image[count * n :, 0] = 1
    ends = np.where(
        rows.ends < n, rows.ends + n * number[..., None], rows.ends + count * n + (Y * number[..., None] - n)
    )
    up = fabric_of(geometry).periods
    nodes = tiled(rows.nodes[:n], up[1])[owner] + image @ up
    inner = cell.model.inner
    natural = np.tile((scene.yarn.set - 1.0) * rows.curvature, (count, 1))
    model = BeamModel(nodes, ends.reshape(-1, 2), _Same(inner, count), inner.radius, natural=natural)
    line = law.along(
        tiled(rows.stations.yarn, Y), np.tile(rows.stations.arc_length, count), np.tile(rows.period, count)
    )
    lattice = Lattice(vectors * [[1.0], [1e3]])
    sheet = EndlessBeams(model, owner, image, lattice, *line)
    start = cell.model.start().beams
    position = tiled(start.position, vectors[1])
    beams = BeamState(position, np.tile(start.rotation, (count, 1, 1)))
    state = EndlessState(beams, np.zeros(3), LineHistory.none(), np.zeros(sheet.size))
    return sheet.starting_at(state), np.repeat(np.arange(count), n), position


class _Same:
    """The law of the elements of a cell, for so many cells."""

    def __init__(self, inner, count):
        self.law = np.tile(inner.elements.law, (count, 1, 1))

    def stiffness(self, chord):
        return self.law


def compliance(soft, count, friction):
    """Return deflection and turn of the upper grip (2, 2) by a force across the strip and a moment, of a period."""
    model, cell, position = strip(soft, count, friction)
    response = model.respond(model.start(), stiffness=True)
    free = np.flatnonzero((cell >= GRIP) & (cell < count - GRIP))
    grip = np.flatnonzero(cell >= count - GRIP)
    turn, across = np.array([-1.0, 0, 0]), np.array([0.0, 0, 1])
    arm = position[grip] - position[grip].mean(axis=0) * [1, 1, 0]
    motion = np.zeros((model.nodes, 6, 3))  # along the strip, across it, and the turn, as a rigid body
    motion[grip, :3, 0], motion[grip, :3, 1] = [0.0, 1, 0], across
    motion[grip, :3, 2], motion[grip, 3:, 2] = np.cross(turn, arm), turn
    own = (6 * free[:, None] + np.arange(6)).ravel()
    T = sp.hstack(
        [sp.identity(model.size, format="csc")[:, own], np.vstack([motion.reshape(-1, 3), np.zeros((3, 3))])]
    )
    K = sp.lil_matrix(T.T @ (response.stiffness - sp.diags(model.drag)) @ T)
    # The grip turns the forces on it.
    force = response.force[:-3].reshape(-1, 6)[grip, :3]
    K[-1, -1] += np.vdot(force, np.cross(turn, np.cross(turn, arm)))
    loads = np.zeros((K.shape[0], 2))
    loads[-2, 0] = loads[-1, 1] = 1.0
    return factorise(K).solve(loads)[-2:]


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_strips_bend_as_their_cells(soft, friction, verify):
    """Differences of lengths are free of the ends: of two for a moment, of four for a tip load, P L^3 / 3 D."""
    _, model = cell_of(soft, 1, friction)
    size, width = model.per_curvature
    of_cell = model.bending_stiffness(model.start(), np.append(HELD, 6 * model.nodes))  # the width is held
    lengths = (6, 8, 10, 12)
    tips = [compliance(soft, count, friction) for count in lengths]
    by_moment = 2 * size / width / (tips[-1][1, 1] - tips[-2][1, 1])
    by_load = 6 * (2 * size) ** 3 / (3 * width) / np.diff([tip[0, 0] for tip in tips], 3)[0]
    verify.within(f"strips with friction {friction:g} under a moment, D [N m]", by_moment, of_cell, 0.005)
    verify.within(f"strips with friction {friction:g} under a tip load, D [N m]", by_load, of_cell, 0.02)
