"""Where knits are held and driven in wale tension, by all models, and which motions that leaves."""

import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.geometry.specimens import head_arcs, sinker_arcs
from knitstudy.knit.loading.history import Motion
from knitstudy.knit.mesh.mesher import grips as grips_of_mesh
from knitstudy.knit.mesh.mesher import mesh_fabric, sampled_sections
from knitstudy.knit.models.spline_yarns.build import discretise
from knitstudy.knit.simulate import build
from knitstudy.knit.yarns.network import grips, tension


@pytest.fixture(scope="module")
def scene(plain_scene):
    return plain_scene.replace("load.direction", "wale").replace("mesh.beam_size", 1.2)


@pytest.mark.parametrize("fidelity", ["rom2d", "rom3d", "hexahedra"])
def test_arcs_of_the_outer_yarns_are_gripped_from_end_to_end(scene, knit, contacts, fidelity):
    """Sinkers of the bottom yarn and heads of the top yarn: whole sections, and no element reaches out of a grip."""
    if fidelity == "hexahedra":
        mesh = mesh_fabric(knit, 1.0, 2.0, 2.0, "wale")
        ends, arc_length, yarn = grips_of_mesh(mesh, knit, "wale"), mesh.arc_length, mesh.yarn_of_slice
        node = np.arange(mesh.slices * mesh.section.size).reshape(mesh.slices, -1)
    else:
        network = build(scene.replace("fidelity", fidelity), knit, contacts=contacts).observer.network
        ends, arc_length, yarn = (
            grips(network, knit, "wale"),
            network.stations.arc_length,
            network.stations.yarn,
        )
        node = network.station_node[:, None]
    outer = (ends.held, 0, sinker_arcs(knit)), (ends.driven, knit.cells[1], head_arcs(knit))
    for nodes, number, arcs in outer:
        gripped = np.isin(node, nodes)
        inside = np.abs(arc_length[:, None] - arcs.mean(axis=1)) <= 0.5 * np.ptp(arcs, axis=1) + 1e-12
        expected = (yarn == number) & inside.any(axis=1)
        np.testing.assert_array_equal(gripped, np.broadcast_to(expected[:, None], gripped.shape))
        apart = np.abs(arc_length[expected][:, None, None] - arcs).min(axis=0)
        assert apart.max() < 1e-9 * arc_length.max()


def test_a_mesh_without_slices_where_grips_end_is_refused(knit):
    with refusal(r"mesh of yarn 0: no slice at s = .* where a grip ends"):
        grips_of_mesh(mesh_fabric(knit, 1.0, 2.0, 2.0), knit, "wale")


@pytest.mark.parametrize(("lateral", "given"), [("fixed", [0, 1, 2, 3, 4, 5]), ("free", [1, 3, 5])])
def test_driven_arcs_move_along_y(scene, knit, contacts, lateral, given):
    network = build(scene, knit, contacts=contacts).observer.network
    ends = grips(network, knit, "wale")
    drive = tension(ends, Motion(np.array([[0, 2e-3, 0]]), (1.0,), (), axis=1, length=1.0), lateral)
    value = np.full((len(network.nodes), 6), np.nan)
    value.flat[drive.fixed] = drive.at(1.0)
    expected = np.full_like(value, np.nan)
    expected[ends.held] = 0
    expected[np.ix_(ends.driven, given)] = np.where(np.array(given) == 1, 2e-3, 0)
    np.testing.assert_array_equal(value, expected)


@pytest.fixture(scope="module")
def splines(scene):
    return scene.vary(
        {"fidelity": "spline_yarns", "mesh.degree": 3, "mesh.crossing_degree": 4, "mesh.crossing_span": 0.6}
    )


def test_sections_of_spline_yarns_move_with_their_grips_and_no_others(splines, knit):
    mesh = sampled_sections(knit)
    yarns = discretise(splines, knit, mesh)
    u = np.random.default_rng(0).normal(size=yarns.nodes.shape)
    u[yarns.ends.held] = 0
    u[yarns.ends.driven] = yarns.unity[yarns.ends.driven, None] * [0.0, 1.0, 0.0]
    moved = yarns.sampled(u).reshape(mesh.slices, -1, 3)
    for yarn, grip, way in zip((0, 3), knit.grips["wale"], (0.0, 1.0), strict=True):
        own = mesh.yarn_of_slice == yarn
        gripped = grip.holds(mesh.yarn_of_slice, mesh.arc_length)
        apart = np.abs(moved - [0, way, 0]).max(axis=(1, 2))
        assert apart[gripped].max() < 1e-13
        assert apart[own & ~gripped].min() > 1e-3


def test_a_pair_of_spline_yarns_is_held_at_its_ends(splines, pair):
    held = splines.vary({"specimen": "pair", "pair.support": "ends", "load.path": [[0.0, 0.0, -1e-5]]})
    yarns = discretise(held, pair, sampled_sections(pair))
    assert set(yarns.yarn[yarns.ends.held]) == {0}
    assert set(yarns.yarn[yarns.ends.driven]) == {1}
    with refusal("must be ends where fidelity is spline_yarns"):
        discretise(held.replace("pair.support", "back"), pair, sampled_sections(pair))
