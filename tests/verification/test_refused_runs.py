"""Runs that cannot go on: a named error, and everything up to the last converged increment kept and readable."""

from dataclasses import replace

import numpy as np
import pytest

from knitstudy.errors import ConvergenceError, MeshError
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.loading.run import Run
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.simulate import solve
from knitstudy.run.configuration import load_scene


def pair(changes):
    """Two crossing yarns that are as short as they may be, on a coarse mesh: scene, mesh and specimen."""
    scene = load_scene("pair-slid-90")
    coarse = {"pair.length": 3.7e-3, "mesh.size": 2 / 3, "solver.linear": "lu", "gates.elements_across": 2.5}
    scene = scene.vary(coarse | changes)
    specimen = fabric_of(lay_out(scene))
    return scene, mesh_fabric(specimen, scene.mesh.size, scene.mesh.growth), specimen


SLID = {
    "mesh.size": 0.78,
    "mesh.element": "quadratic",  # the mesh is too coarse for hourglass control
    "contact.friction": 0.1,
    "solver.increments": 5,
}

REFUSED = {
    "slip longer than the surface": (
        SLID | {"load.path": [[2.2e-3, 0, -45e-6]]},
        r"increment \d+, load factor .*: contact slides over the end of a surface \(surface 0, place .* of .*\)"
        ".* use a smaller load, or longer yarns or bodies",
    ),
    "penetration": (
        {"load.path": [[0, 0, -90e-6]], "contact.augmentations": 0, "solver.increments": 6},
        r"surfaces penetrate each other by .*; allowed is 6e-06 .*after 0 updates.*contact.augmentations",
    ),
    "unreachable end": (
        {
            "interaction": "tie",
            "load.path": [[0, 0, -20e-6], [0, 0, -1.0]],  # the second leg is longer than any knit is thick
            "solver.increments": 2,
        },
        r"increment 2 does not converge beyond load factor 0\.5: .*halved 8 times.*More increments",
    ),
}
"""Changes that make a run end early, and what it says then."""


@pytest.mark.parametrize("case", REFUSED)
def test_what_had_converged_is_kept(case, tmp_path):
    changes, message = REFUSED[case]
    scene, mesh, specimen = pair(changes)
    seen = []
    restart = tmp_path / "run.npz"
    with pytest.raises(ConvergenceError, match=message) as refused:
        solve(scene, specimen, Run(restart, progress=lambda load, place: seen.append(load)), mesh=mesh)
    kept = refused.value.history
    assert kept.attrs["incomplete"].endswith(f", load factor {seen[-1]:.4g}: {refused.value}")
    np.testing.assert_array_equal(kept["load"], seen)
    assert 0 < seen[-1] < 1
    assert np.isfinite(kept["force"]).all()

    again = []
    with pytest.raises(ConvergenceError, match=message) as refused:
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
            "solver.increments": 4,
        }
    )
    specimen = fabric_of(lay_out(scene))
    mesh = mesh_fabric(specimen, 1.0, 1.0)
    message = r"penetrate each other by .* the law of indentation is not verified beyond.* smaller mesh.crossing_degree"
    with pytest.raises(ConvergenceError, match=message) as refused:
        solve(scene, specimen, mesh=mesh)
    kept = refused.value.history
    assert -kept["smallest_gap"].min() <= kept.attrs["penetration_limit"]


def test_a_state_that_hourglass_control_carries_is_in_no_restart_file(tmp_path):
    """At any strain; a second run meets it again, instead of going on beyond it or ending there as if all were well."""
    scene, mesh, specimen = pair(
        {"interaction": "tie", "load.path": [[0, 0, -1e-9]], "solver.hourglass": 0.5, "solver.increments": 1}
    )
    for _ in range(2):
        with pytest.raises(ConvergenceError, match=r"hourglass energy is .* of the internal energy"):
            solve(scene, specimen, Run(tmp_path / "run.npz"), mesh=mesh)


def test_yarns_that_overlap_at_the_start(tmp_path):
    scene, mesh, specimen = pair({})
    upper = np.repeat(mesh.yarn_of_slice == 1, mesh.section.size)
    # Through the gap and three hundredths of an element into the lower yarn.
    nearer = scene.pair.clearance * mesh.radius + 0.03 * scene.metres("mesh.size")
    overlapping = replace(mesh, nodes=mesh.nodes - nearer * np.outer(upper, [0, 0, 1]))
    message = r"surfaces overlap by 1\.\d+e-05 before anything moves; allowed is 6e-06.*finer mesh"
    with pytest.raises(MeshError, match=message):
        solve(scene, specimen, Run(tmp_path / "run.npz"), mesh=overlapping)
    assert not list(tmp_path.iterdir())
