"""Deck of a cell of an endless knit whose yarns touch: one period of every yarn, as quadratic hexahedra.

A yarn is cut midway between its crossings with the row below and with the row above. A piece that crosses the image of
another row is moved to that image, so that every crossing lies between two pieces of the deck, and no hexahedron is
there twice. The sides of a cut, t apart, are joined by equations, and so are the two ends of a period:

    u_beyond - u_before = E t

The strains E, times the edges of the cell, are the displacement of a node of its own. Stiff springs join it to the node
of the set "DRIVEN", whose reaction is the force on the edges (`cells.lattice`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.loading.history import cell_path
from knitstudy.knit.models.spline_yarns import CellOfSplineYarns
from knitstudy.knit.models.spline_yarns.build import undeformed_yarns
from knitstudy.knit.models.spline_yarns.cell import rows_of
from knitstudy.knit.scene.kinds import word_of
from knitstudy.mechanics.cells.lattice import Lattice
from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.materials import material_of
from knitstudy.mechanics.solids.spline_yarn.space import sections
from knitstudy.use.decks import deck
from knitstudy.use.vtu import CurvedCells

# Stiffness of contact over E / R: that of the local indentation which hexahedra of a deck do not show. For sections of
# degree 8 and spans of 0.45 R, half of the default as these hexahedra have nodes midway, pressure over depth is 5.7 to
# 7.7 E / R from 0.001 to 0.01 R (`mechanics.contact.indentation`). Along the surface it is less by Mindlin's share. The
# penalty of Table 1, 19 E / R, is for meshes that show all of it (docs/notes/calculix.md)
PENALTY = 6.0

# Stiffness of all springs to ground, over EI / L^3 of a loop, which resists by a hundred EI / L^3 and more
DRAG = 0.01

# Stiffness of the springs that drive the strains, over E R: CalculiX prints reactions of nodes with elements alone
STIFF = 1e3

DEPARTURES = (
    f"contact: penalties of {PENALTY:g} E / R, in place of the law of local indentation",
    "contact: between pieces of yarn that are near each other in the deck; legs may go through those of the next loop",
    f"slack yarns: springs to ground of {DRAG:g} EI / L^3 of a loop hold them, in place of drag",
)

END = "load.{}: the increments of a deck are equal, and end at full strain"


class Piece(NamedTuple):
    """A part of the yarn of a row, moved by `image` periods along the wales."""

    row: int
    image: int
    breaks: Floats  # (b,) ends of its spans [m]


def cell_deck(scene: CellOfSplineYarns, fabric: Fabric) -> deck.Deck:
    """Return the deck of a cell in contact: a layer of hexahedra of 20 nodes for every span of its yarns."""
    space, coefficients, spans = undeformed_yarns(scene, fabric)
    rows = np.split(coefficients, space.first_node[1:-1])
    pieces = [piece for row in range(rows_of(fabric)) for piece in _pieces(fabric, row, spans[row].breaks)]
    cells = CurvedCells.of([piece.breaks for piece in pieces])
    places = [
        sections(space.yarns[row], rows[row], s, cells.x)[0] + image * fabric.periods[1]
        for (row, image, _), s in zip(pieces, cells.stations, strict=True)
    ]
    points = np.concatenate(places).reshape(-1, 3)
    used, elements = np.unique(cells.cells[:, :20], return_inverse=True)
    number = np.full(len(points), -1)  # of the points of cells of 27 nodes that hexahedra do not have
    number[used] = np.arange(len(used))
    nodes = [number[cells.sections(k)] for k in range(len(pieces))]
    inside = np.concatenate([own[2:-2:2, 0] for own in nodes])
    first = len(cells.section.quads) * np.cumsum([0, *(piece.breaks.size - 1 for piece in pieces)])
    parts = zip(pieces, np.split(elements.reshape(-1, 20), first[1:-1]), strict=True)
    strains = len(used)
    driven = len(used) + 1
    lattice = Lattice(fabric.periods)
    radius = fabric.radius
    modulus = scene.yarn.youngs_modulus
    motion, prescribed = cell_path(scene.load, lattice.lengths)
    increments = math.ceil(scene.solver.increments / len(motion.displacement))
    reach = deck.CONTACT_REACH * radius + float(np.abs(motion.displacement).max())
    width = 2 * np.pi * radius / len(cells.section.ring)
    normal = PENALTY * modulus / radius
    poisson = scene.yarn.poisson_ratio
    law = Coulomb(normal, 2 * (1 - poisson) / (2 - poisson) * normal, scene.friction)
    kind = scene.interaction if law.friction else "frictionless"
    drag = DRAG * modulus * np.pi / 4 * radius**4 / (fabric.centrelines[0].length / fabric.repeats) ** 3
    return deck.Deck(
        title=f"{scene.name}: {scene.specimen}, {word_of(scene.interaction)}",
        nodes=np.concatenate([points[used], np.zeros((2, 3))]),
        elements={f"YARN{piece.row}_{k}": own for k, (piece, own) in enumerate(parts)},
        node_sets={"HELD": inside[:1], "DRIVEN": np.array([driven])},
        element="quadratic",
        material=material_of(scene.yarn),
        hourglass=0.0,
        steps=tuple(
            deck.DeckStep({i + 1: float(corner[i]) for i in prescribed.fixed.tolist()}, increments)
            for corner in motion.displacement
        ),
        jumps=tuple(_jumps(pieces, nodes, lattice, strains)),
        springs=(
            (np.append(inside, strains)[:, None], drag / len(inside)),
            (np.array([[strains, driven]]), STIFF * modulus * radius),
        ),
        contacts=tuple(_contacts(cells, points, first, reach)),
        interaction=deck.DeckInteraction(kind, law, scene.contact.penetration * width),
        halved=True,
        departures=(
            *DEPARTURES,
            *(END.format(key) for key in ("stops", "largest_force") if scene.value(f"load.{key}")),
        ),
    )


def _pieces(fabric: Fabric, row: int, breaks: Floats) -> Iterator[Piece]:
    """Yield the pieces of a row in their order along it: every span goes with the crossing that is nearest to it."""
    image, own = np.divmod(fabric.crossings.yarn, rows_of(fabric))
    apart = np.abs(0.5 * (breaks[1:] + breaks[:-1])[:, None] - fabric.crossings.arc_length[own == row])
    images = image[own == row][np.minimum(apart, breaks[-1] - apart).argmin(axis=1)]
    for low, high in pairwise([0, *(np.flatnonzero(np.diff(images)) + 1).tolist(), len(images)]):
        yield Piece(row, int(images[low]), breaks[low : high + 1])


def _jumps(
    pieces: Sequence[Piece], nodes: Sequence[Ints], lattice: Lattice, strains: int
) -> Iterator[deck.Jump]:
    """Yield the jump to the beginning of every piece from the end of the one before it, around its row."""
    ways = [lattice.jumps(k, np.zeros((1, 3)), np.ones(1))[0, :, :3] / lattice.lengths for k in range(2)]
    for k, piece in enumerate(pieces):
        own = [j for j, other in enumerate(pieces) if other.row == piece.row]
        before = own[own.index(k) - 1]
        rate = (piece.image - pieces[before].image) * ways[1] - (k == own[0]) * ways[0]
        there = nodes[k][0] >= 0
        yield deck.Jump(nodes[k][0, there], nodes[before][-1, there], strains, rate)


def _contacts(cells: CurvedCells, points: Floats, first: Ints, reach: float) -> Iterator[deck.ContactPair]:
    """Yield a pair of surfaces for every two pieces that are near each other, by their first hexahedra."""
    # The centre of a face is a point of the middle section
    centres = [points[cells.surface(k)[1::2, 1::2].ravel()] for k in range(len(cells.stations))]
    for lower, upper in combinations(range(len(centres)), 2):
        near = deck.near_facets(centres[upper], centres[lower], reach)
        if near[0].any():
            both = zip((upper, lower), near, strict=True)
            faces = (deck.facet_faces(cells.section, int(first[k]), chosen) for k, chosen in both)
            yield deck.ContactPair(f"PIECES{lower}_{upper}", *faces)
