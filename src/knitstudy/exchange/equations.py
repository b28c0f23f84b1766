"""Ties as linear equations between nodes, for programs that eliminate one node of each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from knitstudy.solids.patch_tie import PatchTie
from knitstudy.solids.tie import Tie


@dataclass(frozen=True, eq=False)
class Equations:
    """Constraints x_slave = sum of weights times x_master: slave (K,), master (K, c), weight (K, c)."""

    slave: np.ndarray
    master: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, tie: Tie) -> Equations:
        """Return the equations of ties: those of facets as they are, moments of discs made to vanish."""
        if not isinstance(tie, PatchTie):
            return cls(tie.slave, tie.master, tie.weight)
        rows = [_solved(tie, disc) for disc in range(len(tie.discs.crossing))]
        width = max((len(nodes) for _, nodes, _ in rows), default=0)
        slave = np.concatenate([pivots for pivots, _, _ in rows] or [np.empty(0, dtype=np.int64)])
        master, weight = np.zeros((len(slave), width), dtype=np.int64), np.zeros((len(slave), width))
        for disc, (_, nodes, values) in enumerate(rows):
            here = slice(3 * disc, 3 * disc + 3)
            master[here, : len(nodes)], weight[here, : len(nodes)] = nodes, values
        return cls(slave, master, weight)


def _solved(tie: PatchTie, disc: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return three nodes that the three moments of a disc give, and the nodes (n,) and weights (3, n) they follow."""
    moments = tie.moments[3 * disc : 3 * disc + 3]
    nodes = np.unique(moments.indices)
    dense = moments[:, nodes].toarray()
    # The best conditioned choice of three.
    order = qr(dense, mode="r", pivoting=True)[1]
    pivots, others = order[:3], np.sort(order[3:])
    return nodes[pivots], nodes[others], -np.linalg.solve(dense[:, pivots], dense[:, others])
