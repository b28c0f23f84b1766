"""Solid yarns that are pieces of a knit's yarns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib import import_module

import numpy as np
import xarray as xr

from knitstudy.contacts.facets import CrossingFacets, tied_crossings, tied_pieces
from knitstudy.geometry.fabric import Fabric, fabric_of
from knitstudy.loading.history import Meter, Stations
from knitstudy.loading.restart import IN_MEMORY, Run
from knitstudy.loading.solve import Problem, solve_load_path
from knitstudy.mechanics.contact.friction import ContactHistory
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.solid import SolidModel
from knitstudy.mechanics.spline_yarn.space import Space, YarnSpace, yarn_space
from knitstudy.mesh.mesher import ACROSS, Grips, check_shape
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing, place_slices
from knitstudy.mesh.sweep import SweptMesh, sweep
from knitstudy.models.discretisation import Discretisation
from knitstudy.models.solid_yarns import SolidYarns, problem_of
from knitstudy.models.spline_yarns import CROSSING_REACH, RAMP, described, shape
from knitstudy.models.ties import Ties, tie_patches
from knitstudy.models.yarn_contact import MARGIN, BesideTies, contact_law
from knitstudy.study.scene import Scene

# ---- Pieces of yarn as polynomial solid yarns, with their ties and their contact


def divided(scene: Scene, pieces: Fabric, ends: Callable[[Space], Grips]) -> Discretisation:
    """Return pieces, divided as whole solid yarns are.

    Parameters
    ----------
    scene : Scene
    pieces : Fabric
    ends : callable
        What is held and driven: nodes of the space of all pieces.

    Raises
    ------
    MeshError
        If the yarn bends tighter than its radius, or yarns overlap.
    """
    check_shape(pieces)
    lines, radius = pieces.centrelines, pieces.radius
    space = Space(tuple(_space(scene, pieces, piece) for piece in range(len(lines))))
    nodes = np.concatenate([shape(own, line, radius) for own, line in zip(space.yarns, lines, strict=True)])
    return described(scene, space, nodes, _sections(pieces), pieces, ends(space))


def assemble(scene: Scene, parts: Discretisation, pieces: Fabric, tied: np.ndarray) -> SolidYarns:
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


def _space(scene: Scene, pieces: Fabric, piece: int) -> YarnSpace:
    """Return the space of a piece: spans and degrees by the keys of whole yarns."""
    radius, keys, length = pieces.radius, scene.mesh, pieces.centrelines[piece].length
    stations = pieces.stations(piece)
    reach = CROSSING_REACH * radius
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


def _sections(pieces: Fabric) -> SweptMesh:
    """Return the sections at which pieces are seen."""
    size = 2 * pieces.radius / ACROSS
    return sweep(pieces.centrelines, Section.for_size(2 * pieces.radius, size), pieces.radius, Spacing(size))


# ---- Solid yarns of cells that are cut out of a knit (`geometry.fabric.cut_cells`), under load
# In course tension they are gripped where yarns end at the sides: the arches of the first yarn do not, ties and contact
# alone hold them. In wale tension the cut legs of the first and of the last yarn are gripped.


def simulate_cut_knit(scene: Scene, geometry: xr.Dataset, run: Run = IN_MEMORY) -> xr.Dataset:
    """Return the history of a scene whose specimen is cut out of a knit.

    Stations are places on the yarns of the whole knit; what the history has by yarn is by piece of yarn.

    Parameters
    ----------
    scene : Scene
    geometry : Dataset
        Of the whole knit, in the format of docs/files.md.
    run : Run

    Raises
    ------
    MeshError
        If the yarn bends tighter than its radius, crossings cannot be tied, or yarns overlap.
    ConvergenceError, DataFileError
        As `knitstudy.loading.solve.solve_load_path`.
    """
    return solve_load_path(problem_of_cut_knit(scene, fabric_of(scene, geometry)), run)


def problem_of_cut_knit(scene: Scene, pieces: Fabric) -> Problem:
    """Return a scene whose specimen is cut out of a knit as a problem; errors as of `simulate`."""
    meter, arcs = Meter(), pieces.arcs
    yarns = cut_yarns(scene, pieces)
    mesh = yarns.parts.mesh
    piece = mesh.yarn_of_slice
    places = Stations(arcs.yarn[piece], arcs.arc[piece, 0] + mesh.arc_length, mesh.centres)
    return replace(problem_of(yarns, scene, pieces, meter), stations=places)


def cut_yarns(scene: Scene, pieces: Fabric) -> SolidYarns:
    """Return the solid yarns of a cut knit's pieces, gripped as the scene says."""
    crossings = pieces.crossings
    tied = tied_crossings(scene, crossings)
    parts = divided(scene, pieces, partial(_grips, pieces, scene.load.direction))
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


def _grips(pieces: Fabric, direction: str, space: Space) -> Grips:
    """Return the nodes at the gripped ends of pieces: of those all that do not vanish there."""
    found = []
    for grip in pieces.grips[direction]:
        first = np.isin(np.arange(len(space.yarns)), grip.yarn[grip.arc[:, 0] == 0])
        last = np.isin(np.arange(len(space.yarns)), grip.yarn[grip.arc[:, 0] > 0])
        found.append(np.concatenate([_ends(space, 0, first), _ends(space, -1, last)]))
    return Grips(*found)


def _ends(space: Space, last: int, chosen: np.ndarray) -> np.ndarray:
    """Return the nodes of the first (0) or last (-1) spline of chosen pieces, which alone do not vanish there."""
    found = []
    for piece in np.flatnonzero(chosen):
        nodes = space.yarns[piece].first_node
        found.append(space.first_node[piece] + np.arange(nodes[:-1][last], nodes[1:][last]))
    return np.concatenate([np.empty(0, dtype=np.int64), *found])
