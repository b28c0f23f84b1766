"""Pieces of yarn as polynomial solid yarns, with their ties and their contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module

import numpy as np

from knitstudy.crossings.facets import CrossingFacets
from knitstudy.crossings.tied_crossings import tied_pieces
from knitstudy.geometry.pieces import Pieces
from knitstudy.mechanics.polynomial_yarn.space import Space, YarnSpace, yarn_space
from knitstudy.mechanics.solid import SolidModel
from knitstudy.mesh.grips import Grips
from knitstudy.mesh.quality import check_bending, check_overlap
from knitstudy.mesh.sampled import ACROSS
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing, place_slices
from knitstudy.mesh.sweep import SweptMesh, sweep
from knitstudy.solids.discretisation import Discretisation
from knitstudy.solids.patch_tie import tie_patches
from knitstudy.solids.polynomial_yarns import described, shape
from knitstudy.solids.solid_yarns import SolidYarns
from knitstudy.solids.yarn_spans import RAMP
from knitstudy.study.scene import Scene


def divided(scene: Scene, pieces: Pieces, ends: Callable[[Space], Grips]) -> Discretisation:
    """Return pieces, divided as whole solid yarns are.

    Parameters
    ----------
    scene : Scene
    pieces : Pieces
    ends : callable
        What is held and driven: nodes of the space of all pieces.

    Raises
    ------
    MeshError
        If the yarn bends tighter than its radius, or yarns overlap.
    """
    _require_sound(pieces)
    lines, radius = pieces.centrelines, pieces.radius
    space = Space(tuple(_space(scene, pieces, piece) for piece in range(len(lines))))
    nodes = np.concatenate([shape(own, line, radius) for own, line in zip(space.yarns, lines, strict=True)])
    return described(scene, space, nodes, _sections(pieces), pieces, ends(space))


def assemble(scene: Scene, parts: Discretisation, pieces: Pieces, tied: np.ndarray) -> SolidYarns:
    """Return the solid yarns that pieces are: tied at crossings (V,), where the scene says so in contact at all others.

    Raises
    ------
    MeshError
        If crossings cannot be tied, or yarns overlap.
    """
    crossings, interaction, yarn = pieces.crossings, scene.kind.interaction, scene.yarn
    tie = tie_patches(parts, pieces, tied, scene.tie.radius, yarn.youngs_modulus)
    facets = CrossingFacets.of(crossings, parts.mesh)
    groups = parts.groups(tie.nodes)
    solids = (tie.nodes, groups, parts.size, None, None, tie.links)
    every = np.arange(len(parts.nodes))
    if not interaction.touches:
        return SolidYarns(parts, SolidModel(*solids), tie, facets, every)
    own = tied_pieces(parts.rings.arc_length, crossings, tied)
    contact = import_module(interaction.solids)
    touching = contact.touching(scene, parts, tie, own, facets, parts.volume(groups), solids)
    return SolidYarns(parts, touching.model, tie, facets, every, touching)


def _space(scene: Scene, pieces: Pieces, piece: int) -> YarnSpace:
    """Return the space of a piece: spans and degrees by the keys of whole yarns."""
    radius, keys, length = pieces.radius, scene.mesh, pieces.centrelines[piece].length
    stations = pieces.stations(piece)
    reach = keys.crossing_reach * radius
    spacing = Spacing(
        keys.crossing_span * radius,
        keys.span / keys.crossing_span,
        tuple(stations),
        reach=reach,
        ramp=RAMP * radius,
    )
    breaks = place_slices(length, spacing)
    apart = np.maximum(np.maximum(breaks[:-1, None] - stations, stations - breaks[1:, None]), 0.0)
    degrees = np.where(apart.min(axis=1) < reach, keys.crossing_degree, keys.degree)
    return yarn_space(breaks, degrees, keys.spline_degree)


def _sections(pieces: Pieces) -> SweptMesh:
    """Return the sections at which pieces are seen."""
    size = 2 * pieces.radius / ACROSS
    return sweep(pieces.centrelines, Section.for_size(2 * pieces.radius, size), pieces.radius, Spacing(size))


def _require_sound(pieces: Pieces) -> None:
    """Refuse yarns that bend tighter than their radius, or overlap: what three loops of three yarns do, all do."""
    knit = pieces.knit
    part = replace(knit, loops=min(knit.loops, 3), rows=min(knit.rows, 2))
    check_bending(part.centrelines[:1], knit.radius)
    check_overlap(part.centrelines, knit.radius)
