"""Element ends that a rigid arm ties to a node: x_end = x_node + R_node o, with the node's spin.

The arm is eliminated: the element's forces F, M at its end act on the node as F and M + r x F with r =
R_node o.
"""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.rotation import hat


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
    at_nodes = stiffness.copy()
    ends = ((0, slice(0, 3), slice(3, 6)), (1, slice(6, 9), slice(9, 12)))
    for end, shift, spin in ends:  # a spin w of the node moves the end by w x r = -r^ w
        at_nodes[:, :, spin] -= at_nodes[:, :, shift] @ lever[:, end]
    # The arm turns under the force: d(r x F) = (w x r) x F = F^ r^ w.
    turning = hat(force[:, 0::2]) @ lever
    for end, shift, spin in ends:
        at_nodes[:, spin] += lever[:, end] @ at_nodes[:, shift]
        at_nodes[:, spin, spin] += turning[:, end]
    return at_nodes
