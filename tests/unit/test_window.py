"""Where a window lies in a knit, what it is made of, and which windows are refused."""

from dataclasses import replace

import numpy as np
import pytest

from knitstudy.contacts.contacts import extract
from knitstudy.errors import ConfigurationError, ConvergenceError
from knitstudy.loading.gates import require_no_jump
from knitstudy.loading.restart import Checkpoint, Run
from knitstudy.loading.solve import solve_load_path
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.model import Response
from knitstudy.models.simulate import build
from knitstudy.models.window import mixed_knit
from knitstudy.models.window_network import chains, cut_nodes, surroundings, touching_beams, window_of
from knitstudy.stages.plan import Plan
from knitstudy.stages.table import STAGES
from knitstudy.study.configuration import load_scene


@pytest.fixture(scope="module")
def scene(plain_scene):
    return plain_scene.vary({"fidelity": "window", "mesh.beam_size": 3e-3})


@pytest.fixture(scope="module")
def touching(scene):
    """One cell with friction, solid as a whole but for the ends of its yarns, and flattened until the yarns touch."""
    flat = np.array(scene.pattern.control_points) * [1, 1, 0.985]
    return scene.vary(
        {
            "interaction": "isotropic",
            "contact.tied_edges": "none",
            "contact.points": 3,
            "contact.cell": 0.5,
            "pattern.control_points": flat.tolist(),
            "pattern.loops": 1,
            "pattern.rows": 1,
            "load.strain": 0.01,
            "solver.increments": 2,
        }
    )


@pytest.fixture(scope="module")
def slid(touching, knit_of):
    """The knit of that scene and its history."""
    knit = knit_of(touching)
    return knit, solve_load_path(build(touching, knit))


def test_the_middle_cell_is_the_window_of_no_keys(scene, knit):
    window, crossings = window_of(scene, knit), knit.crossings
    assert np.array_equal(window.crossing, np.flatnonzero((crossings.row == 1) & (crossings.column == 1)))
    # Heads of the lower yarn are one arc, both feet of the upper one each their own.
    assert window.yarn.tolist() == [1, 2, 2]


def test_arcs_hold_the_crossings_of_the_window_and_no_others(scene, knit):
    window, crossings = window_of(scene.replace("window.column", 0), knit), knit.crossings
    inside = window.piece(crossings.yarn.ravel(), crossings.arc_length.ravel()).reshape(-1, 2) >= 0
    assert np.array_equal(np.flatnonzero(inside.all(axis=1)), window.crossing)
    assert np.array_equal(inside.all(axis=1), inside.any(axis=1))


def test_arcs_end_halfway_to_the_next_crossing(scene, knit):
    window, crossings = window_of(scene, knit), knit.crossings
    for yarn, ends in zip(window.yarn, window.arc, strict=True):
        s = np.sort(crossings.arc_length[crossings.yarn == yarn])
        for end, side in zip(ends, (-1, 1), strict=True):
            after = np.searchsorted(s, end)
            assert end == pytest.approx(0.5 * (s[after - 1] + s[after])), side


def test_arcs_at_the_edge_leave_the_ends_of_yarns_to_beams(scene, knit):
    window = window_of(scene.vary({"window.cells": 3}), knit)
    assert len(window.crossing) == len(knit.crossings.row)
    assert np.all(window.arc[:, 0] > 0)
    assert np.all(window.arc[:, 1] < knit.centrelines[0].length)


def test_a_margin_is_solid_and_not_asked_for(scene, knit):
    window = window_of(scene.replace("window.margin", 1), knit)
    assert len(window.shown) == 4
    assert len(window.crossing) == 36


def test_beams_end_where_yarns_become_solid(scene, knit):
    window = window_of(scene, knit)
    network = surroundings(scene, knit, window, None)
    nodes = cut_nodes(network, window)
    for piece, (yarn, ends) in enumerate(zip(window.yarn, window.arc, strict=True)):
        assert network.nodes[nodes[piece]] == pytest.approx(knit.centrelines[yarn].position(ends))
    assert np.bincount(network.ends.ravel(), minlength=len(network.nodes))[nodes].tolist() == [[1, 1]] * 3
    assert len(network.springs.ends) == 36 - 4
    stations = network.stations
    assert np.all(window.piece(stations.yarn, stations.arc_length) < 0) or np.all(
        np.abs(stations.arc_length[:, None] - window.arc.ravel()).min(axis=1)[
            window.piece(stations.yarn, stations.arc_length) >= 0
        ]
        < 1e-9
    )


def test_stations_go_along_whole_yarns(scene, knit):
    stations = mixed_knit(scene, knit).stations
    for yarn, line in enumerate(knit.centrelines):
        s = stations.arc_length[stations.yarn == yarn]
        assert np.all(np.diff(s) >= 0)
        assert s[[0, -1]] == pytest.approx([0, line.length])
        assert stations.position[stations.yarn == yarn] == pytest.approx(line.position(s))


REFUSED = {
    "outside": ({"window.row": 3}, r"window\.row is 3, which does not exist .*: use one from 0 to 2"),
    "across the edge": (
        {"window.column": 0, "window.cells": 3},
        r"window\.column is 0, which is too near to the edge of the knit .*: use one from 1 to 1",
    ),
    "margin across the edge": (
        {"window.row": 2, "window.margin": 1},
        r"window\.row is 2, which is too near to the edge .* window\.margin 1: use one from 1 to 1",
    ),
    "larger than the knit": (
        {"window.cells": 5},
        r"window\.cells is 5 and window\.margin 0, but the knit has 3 rows: use smaller ones",
    ),
    "tied rows": (
        {"interaction": "isotropic", "window.row": 0},
        r"row 0, column 1, which contact\.tied_edges 'outer' ties: move window\.row",
    ),
    "gripped": (
        {"load.direction": "wale", "window.row": 0},
        r"a part of yarn 0 that is gripped in wale tension: move window\.row inwards",
    ),
}


def test_beams_touch_where_yarns_are_neither_tied_nor_solid(scene, knit):
    scene = scene.vary({"interaction": "isotropic", "mesh.beam_size": 1.5e-3})
    window = window_of(scene, knit)
    network = surroundings(scene, knit, window, None)
    touching = touching_beams(scene, knit, window, network, network.model(scene.yarn, "curved"))
    assert len(touching.contact.crossing.start) == 12 - 4  # of the row that is not tied
    assert len(network.springs.ends) == 24
    # At rest closest points are those of the crossings: relabelled yarns have kept their places.
    points = touching.points(touching.start())
    assert np.abs(points.gap).max() < 0.05 * knit.radius


def test_cut_yarns_are_chains_of_their_own(scene, knit):
    window = window_of(scene, knit)
    network = surroundings(scene, knit, window, None)
    chain, yarn = chains(network), network.stations.yarn
    # Yarn 1 is cut once, yarn 2 twice.
    assert [len(np.unique(chain[yarn == each])) for each in range(4)] == [1, 2, 3, 1]
    assert np.array_equal(np.unique(chain), np.arange(7))


def test_ties_need_a_size_that_pins_are_known_for(scene, knit):
    scene = scene.replace("tie.radius", 0.07)
    with pytest.raises(ConfigurationError, match=r"tie\.radius is 0\.07 but must be from 0\.1 to 0\.6"):
        surroundings(scene, knit, window_of(scene, knit), None)


def test_a_jump_of_force_is_refused(scene):
    class Recorder:
        columns = {"seam_jump": [1e-3], "seam_force": [np.array([[3.0, 0.0, 4.0]])]}  # noqa: RUF012

    class Increment:
        index = 2

    with pytest.raises(ConvergenceError, match=r"increment 2: force jumps by 0\.001 N .* gates\.jump allows"):
        require_no_jump(scene, Increment, Recorder)
    require_no_jump(scene.replace("gates.jump", 1e-3), Increment, Recorder)


def test_contacts_of_a_window_are_those_of_its_cells(slid):
    knit, history = slid
    found = extract(knit, history)
    assert found["zone"].to_numpy().tolist() == [0, 1, 2, 3]
    sums = (found["normal_resultant"] + found["tangential_resultant"]).to_numpy()
    assert np.linalg.norm(sums[-1], axis=1).max() > 0
    assert found["force"].to_numpy() == pytest.approx(sums, abs=1e-9)


def test_no_force_jumps_at_a_seam(slid):
    history = slid[1]
    largest = np.linalg.norm(history["seam_force"], axis=2).max(axis=1)
    assert np.all(history["seam_jump"].to_numpy()[1:] < 1e-6 * largest[1:])
    # Each solid arc is in balance between both of its seams and the contact along it.
    crossing = history["crossing_force"].to_numpy()[-1].sum(axis=0)
    lower = history["seam_yarn"].to_numpy() == 0
    assert history["seam_force"].to_numpy()[-1][lower].sum(axis=0) == pytest.approx(
        -crossing, abs=1e-6 * largest[-1]
    )


def test_a_window_that_was_interrupted_goes_on(touching, slid, tmp_path):
    knit, whole = slid
    restart = tmp_path / "restart.npz"

    def interrupt(done, note):
        if done > 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve_load_path(build(touching, knit), Run(restart=restart, progress=interrupt))
    assert restart.exists()
    continued = solve_load_path(build(touching, knit), Run(restart=restart))
    assert continued["force"].to_numpy() == pytest.approx(whole["force"].to_numpy(), rel=1e-8)
    assert continued.attrs["fidelity"] == "window"


def test_restart_files_keep_what_beams_in_contact_remember(scene, knit, tmp_path):
    started = build(scene.vary({"interaction": "isotropic", "mesh.beam_size": 2e-3}), knit)
    state = started.model.start()
    history = state.beams.history
    history = replace(history, slip=history.slip + 1e-5, dissipated=2.0)
    state = replace(state, beams=replace(state.beams, history=history), width=state.width + 1e-6)
    response = Response(np.zeros(started.model.size), 1.0)
    checkpoint = Checkpoint(tmp_path / "restart.npz", "key", type(started.model.start()))
    recorder = started.recorder()
    recorder.columns["load"] = [0.0]
    checkpoint.save(Increment(0, 0.0, state, response, 0.5), recorder)
    kept = checkpoint.load(started.recorder()).state
    assert type(kept) is type(state)
    assert kept.beams.history.dissipated == 2.0
    np.testing.assert_array_equal(kept.beams.history.slip, history.slip)
    np.testing.assert_array_equal(kept.width, state.width)
    np.testing.assert_array_equal(kept.solids.displacement, state.solids.displacement)


def test_springs_are_those_of_a_knit_of_another_size():
    scene, plan = load_scene("window-springs-isotropic-course-10x10"), Plan.of()
    stage, source = plan.needs(STAGES["simulation"], scene)["springs"]
    assert (stage.name, source.name, source.pattern.loops) == ("contacts", "yarns-isotropic-course", 3)
    thinner = scene.replace("yarn.diameter", 1.7e-3)
    _, source = plan.needs(STAGES["simulation"], thinner)["springs"]
    assert (source.pattern.loops, source.yarn.diameter) == (3, 1.7e-3)
