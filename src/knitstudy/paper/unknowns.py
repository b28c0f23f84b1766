"""Degrees of freedom of square knits, counted without a solution, and the paper's law of them (Tables 3 and 5)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan

import pandas as pd
from numpy.polynomial import Polynomial

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.specimens import KNITS
from knitstudy.knit.mesh.mesher import slices_of
from knitstudy.knit.mesh.section import Section
from knitstudy.knit.models.rom2d.build import planar_network
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.yarns.joints import contacts_of_crossings, joint_points
from knitstudy.knit.yarns.network import spatial_network
from knitstudy.paper.paper_values import number

SIZES = (3, 6, 8, 20, 30)  # cells in a row of Table 3
NONE = Polynomial([nan])


@dataclass(frozen=True)
class Counted:
    """A model of square knits of n cells in a row, with its degrees of freedom as polynomials of n."""

    name: str
    stem: str  # middle of the names of its scenes
    unknowns: Polynomial
    case: str  # of printed numbers, with a place for n
    # With three multipliers at every surface node of one yarn of each pair in contact
    multiplied: Polynomial
    law: Polynomial  # the paper's


def law_of(count: Callable[[Fabric], int], knit: Fabric) -> Polynomial:
    """Return the law a n^2 + b n of counts in knits of n x n cells like a given one, from n = 1 and n = 2."""
    more = knit.cells[1] - knit.cells[0]
    single, four = (count(KNITS[knit.specimen](knit.loop, n, n + more)) for n in (1, 2))
    return Polynomial([0.0, 2 * single - four / 2, four / 2 - single])


def nodes_2d(fabric: Fabric) -> int:
    """Return the number of nodes of the 2D network."""
    return planar_network(fabric, contacts_of_crossings(fabric)).beam_nodes


def nodes_3d(fabric: Fabric, size: float) -> int:
    """Return the number of nodes of the 3D network with elements of a size in yarn radii."""
    return spatial_network(fabric, joint_points(fabric, contacts_of_crossings(fabric)), size).beam_nodes


def counted_solids(knit: Fabric, scene: Scene, paper: pd.DataFrame) -> tuple[Counted, Counted]:
    """Return hexahedra with the mesh of a scene, tied and in contact, of knits like one of them.

    Counts are a n^2 + b n: n x n cells have n^2 times the yarn of a cell, in 3 n pieces. The paper's solver adds
    c n (n - 2) unknowns for the rows in contact; penalties add none.
    """
    section = Section.for_size(2, scene.mesh.size)
    slices = law_of(lambda fabric: slices_of(fabric, scene.mesh.size, scene.mesh.growth), knit)
    touching, solid = Polynomial([0, -2, 1]), 3 * section.size * slices
    multiplied = solid + 3 * len(section.ring) * slices.coef[2] * touching
    tied = number(paper, "5", "dns-tie 3x3", "degrees of freedom") / 9 * Polynomial([0, 0, 1])
    contact = (number(paper, "3", "c3w3", "degrees of freedom") - tied(3)) / 3 * touching
    return (
        Counted("hexahedra, ties", "hexahedra-tie", solid, "dns-tie {n}x{n}", NONE, tied),
        Counted("hexahedra, contact", "hexahedra-isotropic", solid, "c{n}w{n}", multiplied, tied + contact),
    )


def counted_models(knit: Fabric, scene: Scene, paper: pd.DataFrame) -> tuple[Counted, ...]:
    """Return `counted_solids` and the networks with the paper's elements."""
    beam = number(paper, "5", "rom3d 3x3", "mesh size") / scene.yarn.radius
    spatial, planar = (6 * law_of(count, knit) for count in (lambda fabric: nodes_3d(fabric, beam), nodes_2d))
    return (
        *counted_solids(knit, scene, paper),
        Counted("3D network, ties", "rom3d-tie", spatial, "rom3d {n}x{n}", NONE, NONE),
        Counted("2D network, ties", "rom2d-tie", planar, "rom2d {n}x{n}", NONE, NONE),
    )
