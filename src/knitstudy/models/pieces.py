"""Solid yarns that are pieces of a knit's yarns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib import import_module

import numpy as np
import xarray as xr

from knitstudy.contacts.contacts import extract
from knitstudy.contacts.facets import CrossingFacets, tied_crossings, tied_pieces
from knitstudy.geometry.cut import Arcs, Pieces, cut_rows
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.history import Meter, Stations
from knitstudy.loading.restart import IN_MEMORY, Run
from knitstudy.loading.solve import Problem, solve_load_path
from knitstudy.mechanics.contact.friction import ContactHistory
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.solid import SolidModel
from knitstudy.mechanics.spline_yarn.space import Space, YarnSpace, yarn_space
from knitstudy.mesh.grips import Grips
from knitstudy.mesh.knit import ACROSS
from knitstudy.mesh.quality import check_bending, check_overlap
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing, place_slices
from knitstudy.mesh.sweep import SweptMesh, sweep
from knitstudy.models.discretisation import Discretisation
from knitstudy.models.solid_yarns import SolidYarns, problem_of
from knitstudy.models.spline_yarns import RAMP, described, shape
from knitstudy.models.ties import Ties, tie_patches
from knitstudy.models.yarn_contact import MARGIN, BesideTies, contact_law
from knitstudy.study.scene import Scene

# ---- Pieces of yarn as polynomial solid yarns, with their ties and their contact


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
    groups = parts.groups(parts.nodes)
    solids = (parts.nodes, groups, parts.size, None, None, tie.links)
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


# ---- Solid yarns of cells that are cut out of a knit (`geometry.cut_rows`), under load
# In course tension they are gripped where yarns end at the sides: the arches of the first yarn do not, ties and contact
# alone hold them. In wale tension the cut legs of the first and of the last yarn are gripped.


def simulate_cut_knit(scene: Scene, geometry: xr.Dataset, run: Run = IN_MEMORY) -> xr.Dataset:
    """Return the history of a scene whose specimen is cut out of a knit.

    Stations are places on the yarns of the whole knit; what the history has by yarn is by piece of yarn.

    Parameters
    ----------
    scene : Scene
    geometry : Dataset
        Of the whole knit, in the format of docs/architecture.md.
    run : Run

    Raises
    ------
    MeshError
        If the yarn bends tighter than its radius, crossings cannot be tied, or yarns overlap.
    ConvergenceError, DataFileError
        As `knitstudy.loading.solve.solve_load_path`.
    """
    return solve_load_path(problem_of_cut_knit(scene, Knit.from_dataset(geometry)), run)


def contacts_of_cut_knit(scene: Scene, geometry: xr.Dataset, history: xr.Dataset) -> xr.Dataset:
    """Return the contacts of such a scene (`crossings.contacts.extract`); yarns are its pieces."""
    knit = Knit.from_dataset(geometry)
    return extract(Pieces(knit, cut_rows(knit)), history)


def problem_of_cut_knit(scene: Scene, knit: Knit) -> Problem:
    """Return a scene whose specimen is cut out of a knit as a problem; errors as of `simulate`."""
    meter = Meter()
    arcs = cut_rows(knit)
    yarns = cut_yarns(scene, Pieces(knit, arcs))
    mesh = yarns.parts.mesh
    piece = mesh.yarn_of_slice
    places = Stations(arcs.yarn[piece], arcs.arc[piece, 0] + mesh.arc_length, mesh.centres)
    return replace(problem_of(yarns, scene, knit, meter), stations=places)


def cut_yarns(scene: Scene, pieces: Pieces) -> SolidYarns:
    """Return the solid yarns of a cut knit's pieces, gripped as the scene says."""
    crossings = pieces.crossings
    tied = tied_crossings(scene, crossings)
    parts = divided(scene, pieces, partial(_grips, pieces.knit, pieces.arcs, scene.load.direction))
    yarns = assemble(scene, parts, pieces, tied)
    if yarns.touching is None or yarns.touching.beside is None:
        return yarns
    own = tied_pieces(parts.rings.arc_length, crossings, tied)
    beside = BesideTiesOfPieces(scene, parts, yarns.tie, own)
    return replace(yarns, touching=replace(yarns.touching, beside=beside))


class BesideTiesOfPieces(BesideTies):
    """The same of pieces of yarns: several can be tied to one, so that rows do not say which may meet."""

    def __init__(self, scene: Scene, yarns: Discretisation, tie: Ties, pieces: np.ndarray) -> None:
        margin = MARGIN * yarns.mesh.radius
        self._contact = Contact(
            yarns.nodes, yarns.surfaces, contact_law(scene, yarns), points=1, margin=margin, overlap=np.inf
        )
        self._pieces, self._rings, self._tie = pieces, yarns.rings, tie
        self._history = ContactHistory.empty()


def _grips(knit: Knit, arcs: Arcs, direction: str, space: Space) -> Grips:
    """Return the nodes at the gripped ends of pieces: of those all that do not vanish there."""
    length = knit.centrelines[0].length
    first, last = arcs.arc[:, 0] == 0, arcs.arc[:, 1] == length
    if direction == "course":
        return Grips(_ends(space, 0, first), _ends(space, -1, last))
    lowest, highest = arcs.yarn == 0, arcs.yarn == knit.rows
    held, driven = (
        np.concatenate([_ends(space, 0, yarn & ~first), _ends(space, -1, yarn & ~last)])
        for yarn in (lowest, highest)
    )
    return Grips(held, driven)


def _ends(space: Space, last: int, chosen: np.ndarray) -> np.ndarray:
    """Return the nodes of the first (0) or last (-1) spline of chosen pieces, which alone do not vanish there."""
    found = []
    for piece in np.flatnonzero(chosen):
        nodes = space.yarns[piece].first_node
        found.append(space.first_node[piece] + np.arange(nodes[:-1][last], nodes[1:][last]))
    return np.concatenate([np.empty(0, dtype=np.int64), *found])
