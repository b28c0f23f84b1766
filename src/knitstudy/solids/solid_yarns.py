"""Solid yarns of a scene, put together: mesh, ties, contact, and the grips that hold and drive them."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from knitstudy.crossings.facets import CrossingFacets
from knitstudy.crossings.tied_crossings import tied_crossings, tied_pieces
from knitstudy.gates.resolution import ELEMENTS_ACROSS, require_elements_across
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.elements import ELEMENTS
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.solid import SolidModel
from knitstudy.mechanics.stabilisation import Stabilisation
from knitstudy.mesh.grips import Grips, grips
from knitstudy.mesh.memory import require_memory_to_simulate
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.tie import Tie, tie_crossings
from knitstudy.study.scene import Scene

if TYPE_CHECKING:
    from knitstudy.solids.touching import Touching


@dataclass(frozen=True, eq=False)
class SolidYarns:
    """A specimen of solid yarns.

    Attributes
    ----------
    mesh : SweptMesh
    model : SolidModel
    tie : Tie
    facets : CrossingFacets
    ends : Grips
    touching : Touching or None
        What contact adds.
    """

    mesh: SweptMesh
    model: SolidModel
    tie: Tie
    facets: CrossingFacets
    ends: Grips
    touching: Touching | None = None


def assemble(scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair) -> SolidYarns:
    """Return the solid yarns of a scene.

    Raises
    ------
    MeshError
        If elements are too large for the yarn, the simulation does not fit into memory, an element is folded after
        the tied nodes were moved, a crossing cannot be tied, or yarns overlap.
    """
    _require_resolution(scene, mesh)
    tied = tied_crossings(scene, specimen.crossings)
    tie = tie_crossings(mesh, specimen, scene.tie.tolerance, tied)
    pieces = tied_pieces(mesh, specimen.crossings, tied)
    ends = grips(mesh, scene, specimen)
    facets = CrossingFacets.of(specimen.crossings, mesh)
    solids, options, volume = _solids(scene, mesh, tie)
    interaction = scene.kind.interaction
    if not interaction.touches:
        return SolidYarns(mesh, SolidModel(*solids, **options), tie, facets, ends)
    contact = import_module(interaction.solids)
    touching = contact.touching(scene, mesh, tie, pieces, ends, facets, volume, *solids, **options)
    return SolidYarns(mesh, touching.model, tie, facets, ends, touching)


def _require_resolution(scene: Scene, mesh: SweptMesh) -> None:
    """Refuse meshes that are too coarse for the yarn, or too fine for the memory."""
    fewest = scene.gates.elements_across or ELEMENTS_ACROSS[scene.specimen]
    require_elements_across(scene.yarn.diameter, scene.mesh.size, fewest)
    require_memory_to_simulate(mesh.nodes.size, mesh.section.size + mesh.section.bandwidth, scene.mesh.size)


def _solids(scene: Scene, mesh: SweptMesh, tie: Tie) -> tuple[tuple, dict[str, Any], np.ndarray]:
    """Return the arguments of `SolidModel`, and the volume (N,) of every node [m3]."""
    yarn, size = scene.yarn, scene.mesh.size
    material = Material(yarn.material, yarn.youngs_modulus, yarn.poisson_ratio)
    corners = tie.nodes[mesh.hexahedra]
    elements = ELEMENTS.find(scene.mesh.element).build(corners, material, scene.solver.hourglass)
    transformation = tie.transformation() if len(tie.slave) else None
    each = elements.volume.reshape(-1, len(corners)).sum(axis=0)  # of its integration points
    volume = np.bincount(mesh.hexahedra.ravel(), np.repeat(each / 8, 8), len(tie.nodes))
    stabilisation = None
    if scene.solver.stabilisation > 0:
        kept = volume if transformation is None else transformation.T @ volume
        stabilisation = Stabilisation.of(scene.solver.stabilisation, yarn.youngs_modulus, size, kept)
    solids = (tie.nodes, mesh.hexahedra, elements, size)
    return solids, {"transformation": transformation, "stabilisation": stabilisation}, volume
