"""Which yarns of a specimen nothing but contact can hold: those without a grip and without a tie."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.free_bodies import FreeBodies
from knitstudy.mesh.grips import Grips
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.tie import Tie


def free_yarns(
    mesh: SweptMesh, tie: Tie, ends: Grips, volume: np.ndarray, youngs_modulus: float, size: float
) -> FreeBodies | None:
    """Return the free yarns of a mesh, as a knit in wale tension has them between its grips; None if there are none.

    Parameters
    ----------
    mesh : SweptMesh
    tie : Tie
    ends : Grips
    volume : ndarray, shape (N,)
        Of every node [m3].
    youngs_modulus : float
        Of the yarns [Pa].
    size : float
        Of an element [m].
    """
    fixed = np.concatenate([ends.held, ends.driven, tie.slave, tie.master.ravel()])
    gripped = np.unique(mesh.yarn_of_slice[fixed // mesh.section.size])
    free = [
        np.arange(len(mesh.nodes))[mesh.yarn_nodes(yarn)]
        for yarn in np.setdiff1d(np.arange(mesh.yarns), gripped)
    ]
    if not free:
        return None
    return FreeBodies.of(free, volume, youngs_modulus, size)
