"""Which yarns of a specimen nothing but contact can hold: those without a grip and without a tie."""

from __future__ import annotations

import numpy as np

from knitstudy.mesh.grips import Grips
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.tie import Tie


def free_yarns(mesh: SweptMesh, tie: Tie, ends: Grips) -> list[np.ndarray]:
    """Return the nodes of every free yarn, as a knit in wale tension has them between its gripped ones."""
    fixed = np.concatenate([ends.held, ends.driven, tie.slave, tie.master.ravel()])
    caught = np.unique(mesh.yarn_of_slice[fixed // mesh.section.size])
    numbers = np.arange(len(mesh.nodes))
    return [numbers[mesh.yarn_nodes(yarn)] for yarn in np.setdiff1d(np.arange(mesh.yarns), caught)]
