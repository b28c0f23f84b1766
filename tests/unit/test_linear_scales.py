"""The three scales of the linear solver on yarns whose nodes are coefficients."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from knitstudy.mechanics.linear.three_scale import FabricScale, KnitStructure, YarnScale

STATIONS, FUNCTIONS = 7, 3
NODES = 2 * STATIONS * FUNCTIONS


def structure(fixed=()):
    """Two yarns whose stations have one coefficient of the constant and two of other functions."""
    station = np.repeat(np.arange(2 * STATIONS), FUNCTIONS)
    return KnitStructure(
        position=np.random.default_rng(0).normal(size=(NODES, 3)),
        unity=np.tile([1.0, 0.0, 0.0], 2 * STATIONS),
        yarn=station // STATIONS,
        station=station,
        bandwidth=2 * FUNCTIONS - 1,
        patch=np.empty(0, dtype=np.int64),
        fixed=np.array(fixed, dtype=np.int64),
    )


def rigid(structure, weights):
    """Rigid motions (6, k, 3) of points that are weighted sums (k, n) of the nodes."""
    points = weights @ structure.position
    turns = np.cross(np.eye(3)[:, None], points)
    return np.concatenate([np.broadcast_to(np.eye(3)[:, None], turns.shape), turns])


def assert_rigid(basis, knit):
    """All rigid motions of points, sums of nodes whose weights of the constant sum to 1, are sums of columns."""
    weights = np.random.default_rng(1).normal(size=(40, NODES))
    weights /= (weights @ knit.unity)[:, None]
    expected, moved = rigid(knit, weights).reshape(6, -1).T, np.kron(weights, np.eye(3)) @ basis
    share = np.linalg.lstsq(moved, expected)[0]
    np.testing.assert_allclose(moved @ share, expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("modes", ["whole", "groups"])
def test_rigid_motions_of_points_are_sums_of_modes(modes):
    knit = structure()
    whole = knit.rigid_motions(np.zeros(NODES, dtype=int), None).reshape(-1, 6)
    assert_rigid(whole if modes == "whole" else FabricScale(knit).prolongation().toarray(), knit)


def test_grid_turns_yarns_about_where_they_have_moved_to():
    knit = structure()
    moved = np.random.default_rng(2).normal(size=(NODES, 3))
    basis = FabricScale(knit).prolongation(moved).toarray()
    assert_rigid(basis, replace(knit, position=knit.position + moved))


def banded_matrix(knit, further=()):
    """Positive definite, of the bandwidth of the yarns, with further rows that join nodes."""
    count = len(knit.yarn)
    apart = np.abs(np.arange(count)[:, None] - np.arange(count))
    pattern = (apart <= knit.bandwidth) & (knit.yarn[:, None] == knit.yarn)
    rows = np.random.default_rng(2).normal(size=(count, count)) * pattern
    scalar = rows @ rows.T * pattern
    scalar += np.diag(np.abs(scalar).sum(axis=1))
    for i, j in further:
        scalar[np.ix_([i, j], [i, j])] += [[5.0, -5.0], [-5.0, 5.0]]
    dense = np.kron(scalar, np.eye(3) + 0.1)
    return sp.bsr_matrix(dense, blocksize=(3, 3))


def corrected(knit, matrix):
    """Residual of a random right-hand side, and after the correction of the yarns."""
    scale = YarnScale(knit)
    scale.update(matrix)
    given = np.random.default_rng(3).normal(size=matrix.shape[0])
    residual, correction = given.copy(), np.zeros_like(given)
    scale.correct(residual, correction)
    return given, residual, correction


@pytest.mark.parametrize("further", [(), [(3, 3 + 7)]])
def test_the_band_of_a_yarn_holds_entries_a_little_outside(further):
    knit = structure()
    matrix = banded_matrix(knit, further)
    given, _, correction = corrected(knit, matrix)
    left = np.abs(given - matrix @ correction).max()
    assert left < 1e-4 * np.abs(given).max()  # single precision
