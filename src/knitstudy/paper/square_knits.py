"""Square knits of rising size: growth of their cost (Table 3, Fig. 12a), and degrees of freedom that are counted.

Degrees of freedom and the factor of a direct solver (Tables 3 and 5) are counted without a solution.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from math import nan

import numpy as np
import pandas as pd
from numpy.polynomial import Polynomial

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.specimens import KNITS
from knitstudy.knit.mesh.mesher import slices_of
from knitstudy.knit.mesh.section import GROWTH, SectionMesh
from knitstudy.knit.models.rom2d.build import planar_network
from knitstudy.knit.yarns.joints import contacts_of_crossings, joint_points
from knitstudy.knit.yarns.network import Network, spatial_network
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.factor import UnknownGraph
from knitstudy.measures.reference import made_of
from knitstudy.paper.cases import number
from knitstudy.paper.columns import Simulation
from knitstudy.paper.scene_names import INTERACTIONS, model_name
from knitstudy.paper.solver_memory import Sections, graph_of_network, graphs_of_solids

# Stems of the names of square knits, "{stem}-{n}x{n}", with the scene of 3 x 3 cells if it is one of another name.
SERIES = {
    "domain-yarns-tie-course": "yarns-tie-course",
    "domain-yarns-tie-wale": "yarns-tie-wale",
    "domain-rom3d-tie-course": "rom3d-tie-course",
    "domain-rom2d-tie-course": "rom2d-tie-course",
    "domain-beams-isotropic-course": "beam-hertz-patch-isotropic-course",
    "domain-hexahedra-tie-course": None,
    "domain-hexahedra-isotropic-course": None,
    "domain-yarns-isotropic-course": None,
}

FEWEST = 3  # Sizes that make a series
SMALLEST = 3  # Cells in a row from which on growth is fitted: a knit of one cell is all edges


@dataclass(frozen=True)
class Series:
    """Simulations of square knits, from the smallest to the largest, that differ in their number of cells alone."""

    stem: str
    rows: tuple[Simulation, ...]

    @property
    def cells(self) -> np.ndarray:
        """Cells (k,) in a row."""
        return np.array([row.scene.value("pattern.loops") for row in self.rows])

    @property
    def large(self) -> np.ndarray:
        """Whether the growth is fitted to a size (k,)."""
        return self.cells >= SMALLEST

    @property
    def freedom(self) -> int:
        """Degrees of freedom that a power law leaves to the sizes, at least 1."""
        return max(int(self.large.sum()) - 2, 1)

    @property
    def model(self) -> str:
        """Model in words."""
        scene = self.rows[0].scene
        return made_of(scene) if scene.kind.direct else model_name(scene.kind.fidelity)

    @property
    def interaction(self) -> str:
        """Interaction in words."""
        return INTERACTIONS[self.rows[0].scene.interaction]

    def growth(self, values: Sequence[float]) -> Estimate:
        """Return the exponent of a power law of values (k,) in cells in a row, with its standard error."""
        logs = np.log([self.cells[self.large], np.asarray(values)[self.large]])
        x, y = logs - logs.mean(axis=1, keepdims=True)
        slope = x @ y / (x @ x)
        square = np.sum((y - slope * x) ** 2) / self.freedom
        return Estimate(float(slope), float(np.sqrt(square / (x @ x))))

    def memory(self, dof: np.ndarray, memory: np.ndarray) -> Polynomial:
        """Return the law of memory (k,): a d + b in degrees of freedom d (k,), with the least relative squares."""
        terms = np.vander(dof[self.large], 2, increasing=True) / memory[self.large, None]
        return Polynomial(np.linalg.lstsq(terms, np.ones(len(terms)))[0])


def series_of(rows: Iterable[Simulation]) -> list[Series]:
    """Return the series (`SERIES`) among simulations, each of `FEWEST` sizes or more."""
    simulations = list(rows)
    series = []
    for stem, three in SERIES.items():
        names = [(row, str(row.scene.name)) for row in simulations]
        group = [row for row, name in names if name == three or name.startswith(f"{stem}-")]
        if len(group) >= FEWEST:
            group.sort(key=lambda row: row.scene.value("pattern.loops"))
            series.append(Series(stem, tuple(group)))
    return series


# ---- Degrees of freedom of square knits

SIZES = (3, 6, 8, 20, 30)  # cells in a row of Table 3
NONE = Polynomial([nan])
COUNTED = "counted_unknowns"  # the table of these counts, and columns of it
CELLS, MULTIPLIED = "cells in a row [1]", "with multipliers [1]"
FRONT = "minimum memory (largest front) [MB]"
FACTOR = "memory to minimise I/O (factor) [MB]"
FACTOR_MULTIPLIED = "the same with multipliers [MB]"
TIED, TOUCHING = "hexahedra, ties", "hexahedra, contact"  # names of models
SPATIAL, PLANAR = "3D network, ties", "2D network, ties"


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
    # Of n: of the unknowns that its solver has and, if any, of these with multipliers
    graphs: Callable[[int], Sequence[UnknownGraph]]


def knit_of(knit: Fabric, n: int) -> Fabric:
    """Return a knit of n cells in a row like a given one."""
    assert knit.loop is not None, "a knit has a loop"
    more = knit.cells[1] - knit.cells[0]
    return KNITS[knit.specimen](knit.loop, n, n + more)


def law_of(count: Callable[[Fabric], int], knit: Fabric) -> Polynomial:
    """Return the law a n^2 + b n of counts in knits of n x n cells like a given one, from n = 1 and n = 2."""
    single, four = (count(knit_of(knit, n)) for n in (1, 2))
    return Polynomial([0.0, 2 * single - four / 2, four / 2 - single])


def network_2d(fabric: Fabric) -> Network:
    """Return the 2D network."""
    return planar_network(fabric, contacts_of_crossings(fabric))


def network_3d(fabric: Fabric, size: float) -> Network:
    """Return the 3D network with elements of a size in yarn radii."""
    return spatial_network(fabric, joint_points(fabric, contacts_of_crossings(fabric)), size)


def counted_solids(knit: Fabric, paper: pd.DataFrame) -> tuple[Counted, Counted]:
    """Return hexahedra of the paper's size, tied and in contact, of knits like one of them.

    Counts are a n^2 + b n: n x n cells have n^2 times the yarn of a cell, in 3 n pieces. The paper's solver adds
    c n (n - 2) unknowns for the rows in contact; penalties add none.
    """
    size = number(paper, "5", "dns-tie 3x3", "mesh size") / knit.radius
    section = SectionMesh.for_size(2, size)
    slices = law_of(lambda fabric: slices_of(fabric, size, GROWTH), knit)
    touching = Polynomial([0, -2, 1])
    solid = 3 * section.size * slices
    multiplied = solid + 3 * len(section.ring) * slices.coef[2] * touching
    tied = number(paper, "5", "dns-tie 3x3", "degrees of freedom") / 9 * Polynomial([0, 0, 1])
    contact = (number(paper, "3", "c3w3", "degrees of freedom") - tied(3)) / 3 * touching
    sections = cache(lambda n: Sections.of(knit_of(knit, n), size))

    def graphs(n: int, contact: bool) -> list[UnknownGraph]:
        return graphs_of_solids(knit_of(knit, n), sections(n), size, contact)

    law = tied + contact
    return (
        Counted(TIED, "hexahedra-tie", solid, "dns-tie {n}x{n}", NONE, tied, partial(graphs, contact=False)),
        Counted(
            TOUCHING, "hexahedra-isotropic", solid, "c{n}w{n}", multiplied, law, partial(graphs, contact=True)
        ),
    )


def counted_models(knit: Fabric, paper: pd.DataFrame) -> tuple[Counted, ...]:
    """Return `counted_solids` and the networks with the paper's elements."""
    beam = number(paper, "5", "rom3d 3x3", "mesh size") / knit.radius

    def network(name: str, stem: str, case: str, of: Callable[[Fabric], Network]) -> Counted:
        unknowns = 6 * law_of(lambda fabric: of(fabric).beam_nodes, knit)
        return Counted(
            name, stem, unknowns, case, NONE, NONE, lambda n: [graph_of_network(of(knit_of(knit, n)))]
        )

    return (
        *counted_solids(knit, paper),
        network(SPATIAL, "rom3d-tie", "rom3d {n}x{n}", partial(network_3d, size=beam)),
        network(PLANAR, "rom2d-tie", "rom2d {n}x{n}", network_2d),
    )
