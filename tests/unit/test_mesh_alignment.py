"""Meshes of knits against their crossings: contacts lie in the middle of a layer and of a facet."""

import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.mesh.mesher import mesh_fabric

GROWTH = 1.2
SIZES = [2 / 3, 0.5]

EXACT = 1e-6  # share of the element size: crossings are refined to about 1e-8 of it


@pytest.fixture(scope="module")
def knit(plain_scene, knit_of):
    return knit_of(plain_scene.replace("pattern.loops", 2).replace("pattern.rows", 2))


@pytest.fixture(scope="module", params=SIZES, ids=lambda size: f"{size:.2g}R")
def size(request):
    return request.param


@pytest.fixture(scope="module")
def mesh(knit, size):
    return mesh_fabric(knit, size, GROWTH)


def layers(mesh, knit):
    """Slices below all crossings, on both sides (K, 2)."""
    below = np.empty(knit.crossings.yarn.shape, dtype=int)
    for yarn in range(mesh.yarns):
        first, last = mesh.first_slice[yarn : yarn + 2]
        here = knit.crossings.yarn == yarn
        s = knit.crossings.arc_length[here]
        below[here] = first + np.searchsorted(mesh.arc_length[first:last], s) - 1
    return below


def test_crossings_lie_in_the_middle_of_a_layer_as_long_as_the_size(mesh, knit, size):
    below = layers(mesh, knit)
    s = mesh.arc_length[below], mesh.arc_length[below + 1]
    np.testing.assert_allclose(
        0.5 * (s[0] + s[1]), knit.crossings.arc_length, atol=EXACT * size * knit.radius, rtol=0
    )
    np.testing.assert_allclose(s[1] - s[0], size * knit.radius, rtol=1e-9)  # rounding of arc lengths of 80 mm


def test_contacts_lie_over_the_middle_of_a_facet(mesh, knit, size):
    contact = knit.crossings.point.mean(axis=1)
    for side in range(2):
        below = layers(mesh, knit)[:, side]
        nodes = mesh.nodes[mesh.slice_nodes(np.stack([below, below + 1], axis=1))[..., mesh.section.ring]]
        corners = np.stack([nodes, np.roll(nodes, -1, axis=2)], axis=3)  # (K, slice, facet, corner, 3)
        centre = 0.5 * (mesh.centres[below] + mesh.centres[below + 1])[:, None]
        facet = corners.mean(axis=(1, 3)) - centre
        seen = contact[:, None] - centre
        nearest = np.linalg.norm(facet - seen, axis=-1).argmin(axis=1)
        facet = facet[np.arange(len(nearest)), nearest]
        # Seen along the yarn the two lie on one line from its middle.
        along = np.cross(*np.moveaxis(mesh.frames[below][:, :2] + mesh.frames[below + 1][:, :2], 1, 0))
        off = np.einsum("ki,ki->k", np.cross(facet, seen[:, 0]), along)
        off /= np.linalg.norm(along, axis=1) * np.linalg.norm(facet, axis=1)
        assert np.abs(off).max() < EXACT * size * knit.radius


def test_all_loops_of_all_yarns_are_alike(mesh, knit, size):
    per_yarn = np.diff(mesh.first_slice)
    assert (per_yarn == per_yarn[0]).all()
    nodes = mesh.nodes.reshape(mesh.yarns, per_yarn[0], mesh.section.size, 3)
    rise = np.arange(mesh.yarns)[:, None, None, None] * [0, knit.cell[1], 0]
    np.testing.assert_allclose(
        nodes - rise, np.broadcast_to(nodes[0], nodes.shape), atol=EXACT * size * knit.radius
    )
    loop = (per_yarn[0] - 1) // knit.cells[0]
    moved = nodes[:, :-loop] + [knit.cell[0], 0, 0]
    np.testing.assert_allclose(moved, nodes[:, loop:], atol=EXACT * size * knit.radius)


def test_sizes_that_leave_no_room_between_crossings_are_refused(knit):
    with refusal(r"mesh size: .* use a smaller mesh\.size"):
        mesh_fabric(knit, 2.9)
