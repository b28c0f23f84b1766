"""Solid yarns of a scene, put together: what they are divided into, ties, contact, and what holds and drives them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from knitstudy.crossings.facets import CrossingFacets
from knitstudy.crossings.tied_crossings import tied_crossings, tied_pieces
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.constraints import transformation
from knitstudy.mechanics.solid import SolidModel
from knitstudy.mechanics.stabilisation import Stabilisation
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.discretisation import Discretisation, discretised
from knitstudy.solids.tie import Tie, tie_of
from knitstudy.study.scene import Scene

if TYPE_CHECKING:
    from knitstudy.solids.touching import Touching


@dataclass(frozen=True, eq=False)
class SolidYarns:
    """A specimen of solid yarns.

    Attributes
    ----------
    parts : Discretisation
        What they are divided into.
    model : SolidModel
    tie : Tie
    facets : CrossingFacets
    retained : ndarray of int, shape (n,)
        Nodes that depend on no others, ascending.
    touching : Touching or None
        What contact adds.
    """

    parts: Discretisation
    model: SolidModel
    tie: Tie
    facets: CrossingFacets
    retained: np.ndarray
    touching: Touching | None = None

    @cached_property
    def unknown(self) -> np.ndarray:
        """Position of every node (N,) among those retained, -1 where it depends on others."""
        position = np.full(len(self.parts.nodes), -1)
        position[self.retained] = np.arange(len(self.retained))
        return position


def assemble(scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair) -> SolidYarns:
    """Return the solid yarns of a scene.

    Raises
    ------
    MeshError
        If elements are too large for the yarn, the simulation does not fit into memory, an element is folded after
        the tied nodes were moved, a crossing cannot be tied, or yarns overlap.
    """
    parts = discretised(scene, mesh, specimen)
    tied = tied_crossings(scene, specimen.crossings)
    tie = tie_of(scene, parts, specimen)
    facets = CrossingFacets.of(specimen.crossings, parts.mesh)
    groups = parts.groups(tie.nodes)
    volume = parts.volume(groups)
    spread, retained = _transformation(parts, tie)
    stabilisation = None
    if scene.solver.stabilisation > 0:
        kept = volume if spread is None else spread.T @ volume
        modulus = scene.yarn.youngs_modulus
        stabilisation = Stabilisation.of(scene.solver.stabilisation, modulus, parts.size, kept)
    solids = (tie.nodes, groups, parts.size, spread, stabilisation, tie.links)
    interaction = scene.kind.interaction
    if not interaction.touches:
        return SolidYarns(parts, SolidModel(*solids), tie, facets, retained)
    pieces = tied_pieces(parts.rings.arc_length, specimen.crossings, tied)
    contact = import_module(interaction.solids)
    touching = contact.touching(scene, parts, tie, pieces, facets, volume, solids)
    return SolidYarns(parts, touching.model, tie, facets, retained, touching)


def _transformation(parts: Discretisation, tie: Tie) -> tuple[sp.csr_matrix | None, np.ndarray]:
    """Return T (N, n), None for the identity, and the nodes (n,) that it starts from."""
    every = [matrix for matrix in (parts.dependence, tie.dependence) if matrix is not None]
    if not every:
        return None, np.arange(len(parts.nodes))
    return transformation(every[0] @ every[1] if len(every) > 1 else every[0])
