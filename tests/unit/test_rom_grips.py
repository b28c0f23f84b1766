"""Where reduced models are held and driven in wale tension, and which motions that leaves."""

import numpy as np
import pytest

from knitstudy.knit.geometry.specimens import head_arcs, sinker_arcs
from knitstudy.knit.loading.history import Motion
from knitstudy.knit.simulate import build
from knitstudy.knit.yarns.network import grips, tension


@pytest.fixture(scope="session")
def scene(plain_scene):
    return plain_scene.replace("load.direction", "wale").replace("mesh.beam_size", 1.2)


@pytest.mark.parametrize("fidelity", ["rom2d", "rom3d"])
def test_arcs_of_the_outer_yarns_are_gripped_from_end_to_end(scene, knit, contacts, fidelity):
    network = build(scene.replace("fidelity", fidelity), knit, contacts=contacts).observer.network
    arc_length, yarn = network.stations.arc_length, network.stations.yarn
    ends = grips(network, knit, "wale")
    for nodes, number, arcs in (
        (ends.held, 0, sinker_arcs(knit)),
        (ends.driven, knit.cells[1], head_arcs(knit)),
    ):
        part = np.isin(network.station_node, nodes)
        inside = np.abs(arc_length[:, None] - arcs.mean(axis=1)) <= 0.5 * np.ptp(arcs, axis=1) + 1e-12
        np.testing.assert_array_equal(part, (yarn == number) & inside.any(axis=1))
        # Stations stand at both ends of every arc, so that no element reaches out of a grip by a part of itself.
        apart = np.abs(arc_length[part][:, None, None] - arcs).min(axis=0)
        assert apart.max() < 1e-9 * arc_length.max()


@pytest.mark.parametrize(("lateral", "given"), [("fixed", [0, 1, 2, 3, 4, 5]), ("free", [1, 3, 5])])
def test_driven_arcs_move_along_y(scene, knit, contacts, lateral, given):
    network = build(scene, knit, contacts=contacts).observer.network
    ends = grips(network, knit, "wale")
    drive = tension(ends, Motion(np.array([[0, 2e-3, 0]]), (1.0,), (), axis=1, length=1.0), lateral)
    value = np.full(6 * len(network.nodes), np.nan)
    value[drive.fixed] = drive.at(1.0)
    value = value.reshape(-1, 6)
    np.testing.assert_array_equal(value[ends.held], 0)
    np.testing.assert_array_equal(value[ends.driven][:, 1], 2e-3)
    others = [i for i in given if i != 1]
    np.testing.assert_array_equal(value[ends.driven][:, others], 0)
    free = [i for i in range(6) if i not in given]
    assert np.isnan(value[ends.driven][:, free]).all()
    assert len(drive.fixed) == 6 * len(ends.held) + len(given) * len(ends.driven)
