import numpy as np
import pytest
import scipy.sparse as sp

from knitstudy.mechanics.assembly import Assembly

# Two quadrilaterals side by side: 0 1 2 over 3 4 5.
QUADS = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])


def dense_sum(connectivity, nodes, blocks, block):
    """The same sum with loops, into a dense matrix."""
    a = connectivity.shape[1]
    total = np.zeros((nodes, block, nodes, block))
    for element, corners in enumerate(connectivity):
        for p in range(a):
            for q in range(a):
                total[corners[p], :, corners[q], :] += blocks[element, p * a + q].reshape(block, block)
    return total.reshape(nodes * block, nodes * block)


def assembled(assembly, blocks):
    total = assembly.begin_stiffness()
    for number, batch in reversed(list(enumerate(assembly.batches))):
        total.put(number, blocks[batch.part])
    return assembly.matrix(total).toarray()


@pytest.fixture
def blocks():
    return np.random.default_rng(0).normal(size=(2, 16, 9))


@pytest.mark.parametrize("chunk", [1, 2, 512])
def test_stiffness_is_the_sum_over_elements(blocks, chunk):
    assembly = Assembly([QUADS], 6, pairs=16 * chunk)
    np.testing.assert_allclose(assembled(assembly, blocks), dense_sum(QUADS, 6, blocks, 3), atol=1e-14)


def tie():
    """Node 5 hangs on nodes 0 and 3."""
    rows, columns, values = [0, 1, 2, 3, 4, 5, 5], [0, 1, 2, 3, 4, 0, 3], [1, 1, 1, 1, 1, 0.25, 0.75]
    return sp.csr_matrix((values, (rows, columns)), shape=(6, 5))


# Spans of two yarns that share two nodes with each neighbour; two spans are wider.
SPANS = [np.array([[0], [1], [2], [7], [8]]) + np.arange(3), np.array([[3], [9]]) + np.arange(4)]


@pytest.mark.parametrize("chunk", [1, 2, 512])
@pytest.mark.parametrize("linked", [False, True])
def test_elements_with_consecutive_nodes_add_up(chunk, linked):
    rng = np.random.default_rng(3)
    blocks = [rng.normal(size=(len(spans), spans.shape[1] ** 2, 9)) for spans in SPANS]
    row = np.zeros((1, 13))
    row[0, [1, 4, 9, 12]] = 1, 2, -1, -2
    links = sp.csr_matrix(row.T @ row) if linked else None
    assembly = Assembly(SPANS, 13, links=links, pairs=9 * chunk)
    total = assembly.begin_stiffness()
    for number, batch in reversed(list(enumerate(assembly.batches))):
        total.put(number, blocks[batch.group][batch.part])
    expected = sum(dense_sum(spans, 13, each, 3) for spans, each in zip(SPANS, blocks, strict=True))
    if linked:
        expected = expected + np.kron(links.toarray(), np.eye(3))
    np.testing.assert_allclose(assembly.matrix(total).toarray(), expected, atol=1e-13)


@pytest.mark.parametrize("chunk", [1, 512])
def test_ties_give_the_triple_product(blocks, chunk):
    assembly = Assembly([QUADS], 6, tie(), pairs=16 * chunk)
    expanded = np.kron(tie().toarray(), np.eye(3))
    expected = expanded.T @ dense_sum(QUADS, 6, blocks, 3) @ expanded
    np.testing.assert_allclose(assembled(assembly, blocks), expected, atol=1e-14)


def test_ties_collect_forces():
    force = np.random.default_rng(1).normal(size=(2, 4, 3))
    nodal = np.zeros((6, 3))
    np.add.at(nodal, QUADS, force)
    np.testing.assert_allclose(Assembly([QUADS], 6, tie()).node_forces([force]), nodal)
    collected = Assembly([QUADS], 6, tie()).sum_forces([force])
    np.testing.assert_allclose(collected.reshape(-1, 3), tie().T @ nodal)


def test_connection_tells_which_nodes_share_an_element():
    connection = Assembly([QUADS], 6).connection().toarray()
    assert connection[1].tolist() == [1] * 6
    assert connection[0].tolist() == [1, 1, 0, 1, 1, 0]


def test_groups_of_different_elements_add_up(blocks):
    triangle = np.array([[2, 5, 0]])
    more = np.random.default_rng(2).normal(size=(1, 9, 9))
    assembly = Assembly([QUADS, triangle], 6)
    total = assembly.begin_stiffness()
    for number, batch in enumerate(assembly.batches):
        total.put(number, (blocks, more)[batch.group][batch.part])
    expected = dense_sum(QUADS, 6, blocks, 3) + dense_sum(triangle, 6, more, 3)
    np.testing.assert_allclose(assembly.matrix(total).toarray(), expected, atol=1e-14)


def test_links_act_on_all_components_and_through_ties(blocks):
    row = np.zeros((1, 6))
    row[0, [0, 2, 5]] = 1, -0.25, -0.75
    links = sp.csr_matrix(7.0 * row.T @ row)
    assembly = Assembly([QUADS], 6, tie(), links=links)
    expanded = np.kron(tie().toarray(), np.eye(3))
    expected = expanded.T @ (dense_sum(QUADS, 6, blocks, 3) + np.kron(links.toarray(), np.eye(3))) @ expanded
    np.testing.assert_allclose(assembled(assembly, blocks), expected, atol=1e-14)
