"""Runs that cannot go on, and answers that were wrong in silence: a named error, and what converged is kept."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import REFUSED, refusal

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.loading import gates
from knitstudy.knit.loading.run import Run
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.mesh.section import GROWTH
from knitstudy.knit.simulate import solve
from knitstudy.knit.yarns.network import RING
from knitstudy.measures.summary import summarise
from knitstudy.mechanics.beams.beam import BeamSection
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.run.configuration import load_scene
from knitstudy.run.simulations import simulate


def pair(changes):
    """Two crossing yarns that are as short as they may be, on a coarse mesh: scene, mesh and specimen."""
    scene = load_scene("pair-slid-90")
    coarse = {"pair.length": 3.7e-3, "mesh.size": 2 / 3, "gates.elements_across": 2.5}
    scene = scene.vary(coarse | changes)
    specimen = fabric_of(lay_out(scene))
    return scene, mesh_fabric(specimen, scene.mesh.size, GROWTH), specimen


@pytest.mark.parametrize(("case", "changes", "message"), REFUSED["runs"])
def test_what_had_converged_is_kept(case, changes, message, tmp_path):
    """A slip longer than the surface, yarns that penetrate, and a second leg that is longer than any knit is thick."""
    scene, mesh, specimen = pair(changes)
    seen = []
    restart = tmp_path / "run.npz"
    with refusal(message) as refused:
        solve(scene, specimen, Run(restart, progress=lambda load, place: seen.append(load)), mesh=mesh)
    kept = refused.value.history
    assert kept.attrs["incomplete"].endswith(f", load factor {seen[-1]:.4g}: {refused.value}")
    np.testing.assert_array_equal(kept["load"], seen)
    assert 0 < seen[-1] < 1
    assert np.isfinite(kept["force"]).all()

    again = []
    with refusal(message) as refused:
        solve(scene, specimen, Run(restart, progress=lambda load, place: again.append(load)), mesh=mesh)
    # What had converged is not computed again, and still there.
    assert all(load >= seen[-1] for load in again)
    assert refused.value.history["load"][len(seen) - 1] == seen[-1]


def test_local_indentation_is_not_taken_beyond_its_law(monkeypatch):
    # Beyond the tables, since two yarns held at their ends yield by bending before they reach 2.5 times that depth.
    monkeypatch.setattr("knitstudy.knit.models.spline_yarns.build.FURTHER", 1.0)
    scene = load_scene("pair-slid-90")
    scene = scene.vary(
        {
            "fidelity": "spline_yarns",
            "pair.support": "ends",
            "load.path": [[0, 0, -2e-3]],
            "solver.increments": 8,
        }
    )
    specimen = fabric_of(lay_out(scene))
    mesh = mesh_fabric(specimen, 1.0, 1.0)
    message = r"penetrate each other by .* the law of indentation is not verified beyond.* smaller mesh.crossing_degree"
    with refusal(message) as refused:
        solve(scene, specimen, mesh=mesh)
    kept = refused.value.history
    assert -kept["smallest_gap"].min() <= kept.attrs["penetration_limit"]


def test_a_state_that_hourglass_control_carries_is_in_no_restart_file(tmp_path):
    """At any strain; a second run meets it again, instead of going on beyond it or ending there as if all were well."""
    scene, mesh, specimen = pair(
        {"interaction": "tie", "load.path": [[0, 0, -1e-9]], "solver.hourglass": 0.5, "solver.increments": 1}
    )
    for _ in range(2):
        with refusal(r"hourglass energy is .* of the internal energy"):
            solve(scene, specimen, Run(tmp_path / "run.npz"), mesh=mesh)


def test_yarns_that_overlap_at_the_start(tmp_path):
    scene, mesh, specimen = pair({})
    upper = np.repeat(mesh.yarn_of_slice == 1, mesh.section.size)
    # Through the gap and three hundredths of an element into the lower yarn.
    nearer = scene.pair.clearance * mesh.radius + 0.03 * scene.metres("mesh.size")
    overlapping = replace(mesh, nodes=mesh.nodes - nearer * np.outer(upper, [0, 0, 1]))
    message = r"surfaces overlap by 1\.\d+e-05 before anything moves; allowed is 6e-06.*finer mesh"
    with refusal(message):
        solve(scene, specimen, Run(tmp_path / "run.npz"), mesh=overlapping)
    assert not list(tmp_path.iterdir())


PRESSED = {
    "mesh.size": 0.5,
    "gates.elements_across": 2.5,
    "pair.length": 3.7e-3,
    "load.path": [[0, 0, -4e-5]],
    "solver.increments": 2,
    "gates.ledger": 1,
}


@pytest.mark.parametrize(("name", "changes", "message"), REFUSED["silent"])
def test_silent_answers_are_refused(name, changes, message):
    base = PRESSED if name.startswith("pair") else {}
    with refusal(message):
        simulate(load_scene(name).vary(base | changes))


def force_of(stiffness):
    soft = PRESSED | {"gates.hourglass": 1.0, "contact.augmentations": 0}
    keys = {"contact.normal_stiffness": stiffness, "contact.penetration": 0.2}
    return simulate(load_scene("pair-slid-90").vary(soft | keys)).history


def test_energy_of_a_penalty_is_what_it_takes_from_the_force(verify, monkeypatch):
    """At least, and at most twice as much; the history records the gates that a scene sets higher for it."""
    monkeypatch.setattr(gates, "MOST_IN_PENALTIES", 1.0)
    soft, hard = force_of(1.0), force_of(300.0)
    share = float(soft["energy"].sel(form="penalty")[-1] / soft["energy"].sel(form="external")[-1])
    lost = 1 - float(soft["force"][-1] / hard["force"][-1])
    verify.within(
        "pressed pair, stiffness E / h: energy of the penalty over the force lost", share / lost, 1.0, 0.3
    )
    text = {each.name: each.value for each in summarise(soft)}["relaxed limits"]
    assert "gates.hourglass 1 instead of 0.05" in text
    assert "gates.elements_across 2.5 instead of 7" in text


def pulled(count, radius=1e-3):
    """Return the stiffness of a quarter of a ring of radius 1 m, pulled across."""
    angle = np.linspace(0, np.pi / 2, count + 1)
    nodes = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    ends = np.column_stack([np.arange(count), np.arange(count) + 1])
    model = BeamModel(nodes, ends, BeamSection.circular(2 * radius, 1e9, 0.3, np.ones(count)), radius)
    stiffness = model.respond(model.start(), stiffness=True).stiffness.toarray()
    # Both ends stay in their planes of symmetry; the last one is moved by 1.
    given = np.r_[1:6, 6 * count + np.arange(6)]
    moved = np.zeros(model.size)
    moved[6 * count + 1] = 1.0
    free = np.setdiff1d(np.arange(model.size), given)
    moved[free] = np.linalg.solve(stiffness[np.ix_(free, free)], -stiffness[free] @ moved)
    return (stiffness @ moved)[6 * count + 1]


def test_a_ring_of_straight_beams_is_too_stiff(verify):
    exact = 1e9 * np.pi * 1e-12 / 4 / (np.pi / 4 - 2 / np.pi)  # Timoshenko: EI / R^3 (pi / 4 - 2 / pi)
    verify.within(
        "ring of 32 beams: error over phi^2", (pulled(8) / exact - 1) / (np.pi / 16) ** 2, RING, 0.03
    )
