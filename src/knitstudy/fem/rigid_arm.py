"""Element ends that a rigid arm ties to a node: x_end = x_node + R_node o, with the node's spin.

The arm is eliminated: the element's forces F, M at its end act on the node as F and M + r x F with r =
R_node o.
"""

from __future__ import annotations

import numpy as np

from knitstudy.fem.rotation import hat


def force_at_nodes(force: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return the forces and moments (E, 4, 3) on the nodes.

    Parameters
    ----------
    force : ndarray, shape (E, 4, 3)
        Force and moment at the first end, then at the second [N, N m].
    arm : ndarray, shape (E, 2, 3)
        Current arms r from node to end [m].
    """
    at_nodes = force.copy()
    at_nodes[:, 1::2] += np.cross(arm, force[:, 0::2])
    return at_nodes


def stiffness_at_nodes(stiffness: np.ndarray, force: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return the derivative (E, 12, 12) of `force_at_nodes` with respect to (u1, w1, u2, w2) of the nodes.

    Parameters
    ----------
    stiffness : ndarray, shape (E, 12, 12)
        Derivative of the end forces with respect to the motion of the ends.
    force : ndarray, shape (E, 4, 3)
        The end forces.
    arm : ndarray, shape (E, 2, 3)
        Current arms [m].
    """
    lever = hat(arm)  # (E, 2, 3, 3)
    motion = np.broadcast_to(np.eye(12), stiffness.shape).copy()  # of the ends, from that of the nodes
    motion[:, 0:3, 3:6] = -lever[:, 0]
    motion[:, 6:9, 9:12] = -lever[:, 1]
    at_nodes = np.swapaxes(motion, 1, 2) @ stiffness @ motion
    # The arm turns under the force: d(r x F) = (w x r) x F = F^ r^ w.
    turning = hat(force[:, 0::2]) @ lever
    at_nodes[:, 3:6, 3:6] += turning[:, 0]
    at_nodes[:, 9:12, 9:12] += turning[:, 1]
    return at_nodes
