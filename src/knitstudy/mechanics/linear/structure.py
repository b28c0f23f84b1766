"""Where the unknowns of a solid knit lie, and how it moves as a rigid body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class KnitStructure:
    """Where the unknowns of a solid knit lie; nodes are numbered yarn by yarn, slice by slice.

    Attributes
    ----------
    position : ndarray, shape (n, 3)
        Nodes [m].
    yarn : ndarray of int, shape (n,)
        Yarn of every node, ascending.
    slice : ndarray of int, shape (n,)
        Slice of every node, ascending.
    bandwidth : int
        Largest difference of node numbers within an element of one yarn.
    patch : ndarray of int, shape (p,)
        Nodes where yarns act on each other.
    fixed : ndarray of int, shape (k,)
        Prescribed unknowns.
    """

    position: np.ndarray
    yarn: np.ndarray
    slice: np.ndarray
    bandwidth: int
    patch: np.ndarray
    fixed: np.ndarray


def rigid_modes(structure: KnitStructure) -> np.ndarray:
    """Return the six rigid motions (size, 6) of the nodes, zero at prescribed unknowns."""
    arm = structure.position - structure.position.mean(axis=0)
    modes = np.zeros((len(arm), 3, 6))
    modes[:, [0, 1, 2], [0, 1, 2]] = 1
    modes[:, :, 3:] = spins(arm / np.abs(arm).max())
    modes = modes.reshape(-1, 6)
    modes[structure.fixed] = 0
    return modes


def spins(arm: np.ndarray) -> np.ndarray:
    """Return the matrices (n, 3, 3) whose columns are e_k x arm."""
    x, y, z = arm.T
    zero = np.zeros_like(x)
    return np.stack(
        [np.stack([zero, z, -y], -1), np.stack([-z, zero, x], -1), np.stack([y, -x, zero], -1)], axis=1
    )
