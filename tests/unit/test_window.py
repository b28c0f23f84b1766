"""Where a window lies in a knit, what it is made of, and which windows are refused."""

from types import SimpleNamespace

import numpy as np
import pytest
import synthetic

from knitstudy.contacts.contacts import extract
from knitstudy.errors import ConfigurationError, ConvergenceError
from knitstudy.loading.gates import require_no_jump
from knitstudy.loading.solve import solve_load_path
from knitstudy.models.joints import spring_axes
from knitstudy.models.simulate import build
from knitstudy.models.window import outer_contact, surroundings, window_of


@pytest.fixture(scope="module")
def scene(plain_scene):
    return plain_scene.vary({"fidelity": "window", "mesh.beam_size": 1.2})


@pytest.fixture(scope="module")
def touching(touching_cell):
    """One cell that is solid as a whole but for the ends of its yarns."""
    resolution = {"mesh.beam_size": 1.2, "contact.points": 3, "contact.cell": 0.5, "solver.increments": 2}
    return touching_cell.vary({"fidelity": "window", "load.strain": 0.01} | resolution)


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


def test_arcs_end_halfway_to_the_next_crossing(scene, knit):
    window, crossings = window_of(scene, knit), knit.crossings
    for yarn, ends in zip(window.yarn, window.arc, strict=True):
        s = np.sort(crossings.arc_length[crossings.yarn == yarn])
        for end, side in zip(ends, (-1, 1), strict=True):
            after = np.searchsorted(s, end)
            assert end == pytest.approx(0.5 * (s[after - 1] + s[after])), side


def test_beams_end_where_yarns_become_solid(scene, knit):
    window = window_of(scene, knit)
    network = surroundings(scene, knit, window, None)
    nodes = network.station_node[network.stations.nearest(window.yarn[:, None], window.arc)]
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


def test_beams_touch_where_yarns_are_neither_tied_nor_solid(scene, knit):
    scene = scene.vary({"interaction": "isotropic", "mesh.beam_size": 5 / 3})
    window = window_of(scene, knit)
    network = surroundings(scene, knit, window, None)
    touching = outer_contact(scene, knit, window, network)
    free = np.delete((knit.crossings.row == 1) & (knit.crossings.column != 1), window.crossing)
    joined = np.unique(touching.line.joined)
    assert len(joined[joined >= 0]) == np.sum(~free) == 24
    assert len(network.springs.ends) == 24
    # At rest closest points are those of the crossings: relabelled yarns have kept their places.
    model = network.model(scene.yarn, "curved", touching)
    gap = model.commit(model.start()).contact.gap[:-1]
    assert np.abs(gap[free]).max() < 0.05 * knit.radius


def test_springs_lie_along_the_normals_of_their_measurement(scene, knit, contacts):
    measured = synthetic.contacts_with_springs(contacts, np.ones(3))
    normal = measured["normal"].to_numpy() + np.array([0.0, 0.2, 0.0])  # a resultant some degrees off
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    axes = spring_axes(normal, "local")
    stiffness = np.einsum("kai,a,kaj->kij", axes, [20e3, 40e3, 700e3], axes)
    moved = measured["relative_displacement"].to_numpy()
    measured["contact_normal"] = ("crossing", "xyz"), normal
    measured["force"] = measured["force"].dims, np.einsum("kij,tkj->tki", stiffness, moved - moved[1])
    scene = scene.replace("interaction", "isotropic")
    window = window_of(scene, knit)
    free = (knit.crossings.row == 1) & (knit.crossings.column != 1)
    springs = surroundings(scene, knit, window, measured).springs.stiffness
    outside = np.delete(np.arange(36), window.crossing)
    np.testing.assert_allclose(springs[free[outside]], stiffness[free], rtol=1e-9, atol=1e-3)


def test_ties_need_a_size_that_pins_are_known_for(scene, knit):
    scene = scene.replace("tie.radius", 0.07)
    with pytest.raises(ConfigurationError, match=r"tie\.radius is 0\.07 but must be from 0\.1 to 0\.6"):
        surroundings(scene, knit, window_of(scene, knit), None)


def test_a_jump_of_force_is_refused(scene):
    columns = {"seam_jump": [1e-3], "seam_force": [np.array([[3.0, 0.0, 4.0]])]}
    there = SimpleNamespace(index=2), SimpleNamespace(columns=columns)
    with pytest.raises(ConvergenceError, match=r"increment 2: force jumps by 0\.001 N .* gates\.jump allows"):
        require_no_jump(scene, *there)
    require_no_jump(scene.replace("gates.jump", 1e-3), *there)


def test_contacts_of_a_window_are_those_of_its_cells(slid):
    knit, history = slid
    found = extract(knit, history)
    assert found["zone"].to_numpy().tolist() == [0, 1, 2, 3]
    sums = (found["normal_resultant"] + found["tangential_resultant"]).to_numpy()
    assert np.linalg.norm(sums[-1], axis=1).max() > 0
    assert found["force"].to_numpy() == pytest.approx(sums, abs=1e-9)
