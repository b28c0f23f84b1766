"""Which yarns of a specimen nothing but contact can hold: those without a grip and without a tie."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.free_bodies import FreeBodies
from knitstudy.solids.discretisation import Discretisation
from knitstudy.solids.tie import Tie


def free_yarns(
    yarns: Discretisation, tie: Tie, volume: np.ndarray, youngs_modulus: float
) -> FreeBodies | None:
    """Return the free yarns of a specimen, as knits in wale tension have between their grips; None if there are none.

    Parameters
    ----------
    yarns : Discretisation
    tie : Tie
    volume : ndarray, shape (N,)
        Of every node [m3].
    youngs_modulus : float
        Of the yarns [Pa].
    """
    fixed = np.concatenate([yarns.ends.held, yarns.ends.driven, tie.joined])
    free = np.setdiff1d(np.arange(yarns.mesh.yarns), yarns.yarn[fixed])
    if not len(free):
        return None
    return FreeBodies.of(
        [yarns.nodes_of(yarn) for yarn in free], volume, youngs_modulus, yarns.size, yarns.unity
    )
