"""The factor of a direct solver, counted: by hand, beside factors that are computed, and by its known growth."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from knitstudy.knit.geometry.specimens import cut_cells
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.mesh.section import GROWTH
from knitstudy.knit.yarns.joints import contacts_of_crossings, joint_points
from knitstudy.knit.yarns.network import spatial_network
from knitstudy.measures.factor import UnknownGraph, dissect, factor_size
from knitstudy.paper.solver_memory import Sections, graph_of_network, graphs_of_solids

COARSE = 0.5  # size of elements in yarn radii


def grid(*cells, unknowns=1):
    """Return a grid of vertices that are paired with their neighbours along the axes."""
    number = np.arange(np.prod(cells)).reshape(cells)
    pairs = [
        np.stack(
            [np.delete(number, -1, axis).ravel(), np.delete(number, 0, axis).ravel()],
            axis=1,
        )
        for axis in range(len(cells))
    ]
    places = np.argwhere(number >= 0).astype(float)
    return UnknownGraph(places, np.full(number.size, unknowns), np.concatenate(pairs))


def computed_entries(graph):
    """Return the entries of the factor that SuperLU computes in the order of nested dissection, without pivoting."""
    size = len(graph.places)
    order = np.concatenate([separators for separators, _, _ in dissect(graph)])[::-1]
    matrix = sp.coo_array((np.full(len(graph.pairs), -1.0), tuple(graph.pairs.T)), shape=(size, size)).tocsr()
    matrix = matrix + matrix.T + sp.diags_array(np.full(size, 100.0))
    every = sp.kron(matrix.tocsr()[order][:, order], np.ones(2 * (graph.unknowns[0],)))
    every = sp.csc_array(every + 100 * sp.eye_array(every.shape[0]))
    return splu(every, permc_spec="NATURAL", diag_pivot_thresh=0.0).L.nnz


@pytest.mark.parametrize(
    "graph",
    [grid(9), grid(12, 12), grid(20, 9), grid(5, 6, 7), grid(8, 9, unknowns=3)],
    ids=["chain", "square", "strip", "block", "three unknowns"],
)
def test_counted_entries_bound_those_of_a_computed_factor(graph):
    """Fronts count as dense; a computed factor leaves out entries of separators that are not coupled yet."""
    computed = computed_entries(graph)
    assert computed <= factor_size(graph).entries <= 1.15 * computed


def test_the_last_front_of_a_square_is_its_middle_line():
    """The largest front: a half line of n / 2 and three lines around its quarter or, here, half of the square."""
    sizes = [factor_size(grid(n, n)).front for n in (16, 32, 64)]
    assert sizes == [24, 48, 96]


def test_unknowns_that_are_all_coupled_fill_a_triangle():
    pairs = np.column_stack(np.triu_indices(6, 1))
    size = factor_size(UnknownGraph(np.arange(6.0)[:, None], np.full(6, 2), pairs))
    assert (size.entries, size.front) == (12 * 13 // 2, 12)
    assert size.factor_bytes == size.front_bytes == 8 * 78


def test_factors_of_squares_grow_with_the_known_coefficient():
    """31 / 4 n^2 log2 n and terms of n^2 (George 1973): a doubling of n adds 31 / 4 entries an unknown in the end."""
    share = [factor_size(grid(n, n)).entries / n**2 for n in (32, 64, 128, 256)]
    added = np.diff(share)
    assert (np.diff(added) > 0).all()
    assert 0.9 * 31 / 4 < added[-1] < 31 / 4


def test_factors_of_cubes_grow_with_the_known_exponent():
    """n^4 in the end, that is n for every unknown, which is approached from above."""
    share = [factor_size(grid(n, n, n)).entries / n**3 for n in (8, 16, 32)]
    first, last = np.diff(np.log2(share))
    assert 1 < last < first - 0.1


def test_numbers_of_vertices_do_not_matter():
    graph = grid(7, 11, 3)
    graph = replace(graph, places=graph.places + 1e-3 * np.sin(np.arange(graph.places.size)).reshape(-1, 3))
    new = np.random.default_rng(0).permutation(len(graph.places))
    old = np.argsort(new)
    assert factor_size(UnknownGraph(graph.places[old], graph.unknowns, new[graph.pairs])) == factor_size(
        graph
    )


# ---- Graphs of knits


@pytest.fixture(scope="module")
def square(plain_scene, knit_of):
    return cut_cells(knit_of(plain_scene).loop, 3, 3)


def test_sections_are_those_of_the_mesh(square):
    mesh = mesh_fabric(square, COARSE, GROWTH)
    sections = Sections.of(square, COARSE)
    on_surface = mesh.nodes.reshape(mesh.slices, -1, 3)[:, mesh.section.ring]
    assert np.allclose(sections.centres, mesh.centres, atol=1e-9 * square.radius)
    assert np.allclose(sections.surface, on_surface, atol=1e-9 * square.radius)
    assert np.array_equal(sections.yarn, mesh.yarn_of_slice)


def test_graphs_have_the_unknowns_of_their_models(square):
    sections = Sections.of(square, COARSE)
    (tied,) = graphs_of_solids(square, sections, COARSE, contact=False)
    penalties, multiplied = graphs_of_solids(square, sections, COARSE, contact=True)
    nodes = len(sections.centres) * sections.nodes
    assert tied.unknowns.sum() == penalties.unknowns.sum() == 3 * nodes
    on_lower_yarn = np.count_nonzero(sections.yarn == square.crossings.yarn[square.crossings.row == 1, 0][0])
    assert multiplied.unknowns.sum() == 3 * (nodes + on_lower_yarn * sections.surface.shape[1])
    smaller, small, large = (factor_size(graph).entries for graph in (tied, penalties, multiplied))
    assert smaller < small < large
    for graph in (tied, penalties):
        assert len(np.unique(np.sort(graph.pairs, axis=1), axis=0)) == len(graph.pairs)
        linked = sp.coo_array(
            (np.ones(len(graph.pairs)), tuple(graph.pairs.T)), shape=2 * (len(graph.places),)
        )
        assert sp.csgraph.connected_components(linked)[0] == 1, "crossings join all yarns"


def test_the_graph_of_a_network_is_its_stiffness(square):
    network = spatial_network(square, joint_points(square, contacts_of_crossings(square)), 5 / 9)
    graph = graph_of_network(network)
    assert graph.unknowns.sum() == 6 * (network.beam_nodes - len(square.crossings))
    assert len(graph.pairs) == len(network.ends)
