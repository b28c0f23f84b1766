"""Solid yarns of cells that are cut out of a knit (`geometry.cut_rows`), under load.

In course tension they are gripped where yarns end at the sides: the arches of the first yarn do not, ties and contact
alone hold them. In wale tension the cut legs of the first and of the last yarn are gripped.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from knitstudy.crossings.contacts import extract
from knitstudy.crossings.tied_crossings import tied_crossings, tied_pieces
from knitstudy.geometry.cut_rows import cut_rows
from knitstudy.geometry.pattern import Knit
from knitstudy.geometry.pieces import Arcs, Pieces
from knitstudy.loading.cost import Meter
from knitstudy.loading.follow import follow
from knitstudy.loading.history import Stations
from knitstudy.loading.problem import Problem
from knitstudy.loading.run import IN_MEMORY, Run
from knitstudy.mechanics.contact.history import ContactHistory
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.polynomial_yarn.space import Space
from knitstudy.mesh.grips import Grips
from knitstudy.solids.beside_ties import BesideTies
from knitstudy.solids.discretisation import Discretisation
from knitstudy.solids.dns import problem_of
from knitstudy.solids.solid_yarns import SolidYarns
from knitstudy.solids.tie import Tie
from knitstudy.solids.yarn_contact import MARGIN, contact_law
from knitstudy.solids.yarn_pieces import assemble, divided
from knitstudy.study.scene import Scene


def simulate(scene: Scene, geometry: xr.Dataset, run: Run = IN_MEMORY) -> xr.Dataset:
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
        As `knitstudy.loading.follow.follow`.
    """
    return follow(problem(scene, Knit.from_dataset(geometry)), run)


def contacts(scene: Scene, geometry: xr.Dataset, history: xr.Dataset) -> xr.Dataset:
    """Return the contacts of such a scene (`crossings.contacts.extract`); yarns are its pieces."""
    knit = Knit.from_dataset(geometry)
    return extract(Pieces(knit, cut_rows(knit)), history)


def problem(scene: Scene, knit: Knit) -> Problem:
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

    def __init__(self, scene: Scene, yarns: Discretisation, tie: Tie, pieces: np.ndarray) -> None:
        margin = MARGIN * yarns.mesh.radius
        self._contact = Contact(
            tie.nodes, yarns.surfaces, contact_law(scene, yarns), points=1, margin=margin, overlap=np.inf
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
