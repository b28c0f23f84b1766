"""Where the unknowns of a solid knit lie, and how it moves as a rigid body."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class KnitStructure:
    """Where the unknowns of a solid knit lie; nodes are numbered yarn by yarn, station by station.

    A node is a node of a mesh or a coefficient: every point of a yarn is a weighted sum of them, undeformed and
    displaced alike.

    Attributes
    ----------
    position : ndarray, shape (n, 3)
        Nodes [m].
    unity : ndarray, shape (n,)
        The nodes' values in the sum that is 1 everywhere: 1 for nodes of a mesh.
    yarn : ndarray of int, shape (n,)
        Yarn of every node, ascending.
    station : ndarray of int, shape (n,)
        Place along the yarn, ascending: nodes of one cross-section, or of one spline, have it in common.
    bandwidth : int
        Largest difference of node numbers within an element of one yarn.
    patch : ndarray of int, shape (p,), or None
        Nodes where yarns are tied to each other; None if crossings are no scale of their own, touching ones neither.
    fixed : ndarray of int, shape (k,)
        Prescribed unknowns.
    """

    position: np.ndarray
    unity: np.ndarray
    yarn: np.ndarray
    station: np.ndarray
    bandwidth: int
    patch: np.ndarray | None
    fixed: np.ndarray

    def moved(self, displacement: np.ndarray | None) -> KnitStructure:
        """Return where the unknowns lie after a displacement (n, 3) of the nodes [m]."""
        return self if displacement is None else replace(self, position=self.position + displacement)


def rigid_modes(structure: KnitStructure) -> np.ndarray:
    """Return the six rigid motions (size, 6) of the whole knit, zero at prescribed unknowns."""
    everything = np.zeros(len(structure.position), dtype=np.int64)
    return rigid_motions(structure, everything)[0].reshape(-1, 6)


def rigid_motions(structure: KnitStructure, group: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the rigid motions of groups of nodes.

    Three translations and three rotations about the group's centre, these over the groups' radius of gyration.
    A node that is a coefficient of anything but the constant stays where it is in translations.

    Parameters
    ----------
    structure : KnitStructure
    group : ndarray of int, shape (n,)
        Group of every node, 0 to g - 1.

    Returns
    -------
    blocks : ndarray, shape (n, 3, 6)
        Zero at prescribed unknowns.
    centre : ndarray, shape (g, 3)
        Of the groups [m].
    radius : float
        Of gyration, the mean of all groups [m].
    """
    unity = structure.unity
    count = np.bincount(group, unity**2)
    weighted = unity[:, None] * structure.position
    centre = np.stack([np.bincount(group, weighted[:, i]) / count for i in range(3)], axis=1)
    arm = structure.position - unity[:, None] * centre[group]
    radius = float(np.sqrt(np.sum(arm**2) / count.sum()))
    blocks = np.zeros((len(group), 3, 6))
    blocks[:, [0, 1, 2], [0, 1, 2]] = unity[:, None]
    blocks[:, :, 3:] = spins(arm / radius)
    blocks.reshape(-1, 6)[structure.fixed] = 0
    return blocks, centre, radius


def spins(arm: np.ndarray) -> np.ndarray:
    """Return the matrices (n, 3, 3) whose columns are e_k x arm."""
    x, y, z = arm.T
    zero = np.zeros_like(x)
    return np.stack(
        [np.stack([zero, z, -y], -1), np.stack([-z, zero, x], -1), np.stack([y, -x, zero], -1)], axis=1
    )
