"""Input decks of other finite-element programs: mesh, ties, contact, grips and load of a scene, without keywords.

Ties are linear constraints, which eliminate one node for each of a tie's moments. Contact is a pair of surfaces for
every two yarns that cross, beside their ties, in knits that are not tied throughout.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.knit.geometry.crossings import tied_crossings
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.loading.history import load_path
from knitstudy.knit.mesh.section import SectionMesh
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.knit.models.hexahedra import Hexahedra, HexahedralScene, PairOfHexahedra
from knitstudy.knit.models.hexahedra.build import divide
from knitstudy.knit.scene.kinds import word_of
from knitstudy.knit.yarns.interactions import STIFFNESS, Equations, penalties, tie_crossings
from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.core.arrays import Bools, Floats
from knitstudy.mechanics.materials import Material, material_of

EXACTLY_JOINED = (
    f"ties: springs of {STIFFNESS:g} E R join the moments of two yarns in the scene, equations without any compliance "
    "in a deck"
)

# Distance of facets that may come to touch, over the yarn's radius, besides the distance that the load moves them
CONTACT_REACH = 1.0


@dataclass(frozen=True, eq=False)
class DeckSurface:
    """Faces of hexahedra: elements (f,) from 0 and their faces (f,) from 1, as C3D8 counts them."""

    elements: np.ndarray
    faces: np.ndarray


@dataclass(frozen=True, eq=False)
class ContactPair:
    """Two surfaces that may touch: the points of ``slave`` meet the faces of ``master``."""

    name: str
    slave: DeckSurface
    master: DeckSurface


@dataclass(frozen=True)
class DeckInteraction:
    """Contact law of all pairs of surfaces."""

    kind: str  # isotropic, rough or frictionless
    law: Coulomb
    penetration: float  # that the scene allows [m]

    @property
    def elastic_slip(self) -> float:
        """Slip (m) at which the largest penetration's pressure makes a sticking point slide.

        A program whose stick stiffness is mu p over this length has the stiffness of the law at this pressure.
        """
        law = self.law
        return float(law.friction * law.normal / law.tangential * self.penetration)


@dataclass(frozen=True)
class DeckStep:
    """One leg of the load, in equal increments; the node set "HELD" stays where it is."""

    moves: dict[int, float]  # of the set "DRIVEN" to the end of the leg [m], by component (1 to 3)
    increments: int


class Jump(NamedTuple):
    """Equations u_slave - u_master = rate u_driver, for nodes (k,) of both sides."""

    slave: np.ndarray
    master: np.ndarray
    driver: int
    rate: np.ndarray  # (3, 3)


@dataclass(frozen=True, eq=False)
class Deck:
    """Nonlinear static steps on a mesh of hexahedra, numbered from 0."""

    title: str
    nodes: np.ndarray  # (N, 3) [m]
    elements: dict[str, np.ndarray]  # nodes (e, 8) or (e, 20) of every set, one set after another
    node_sets: dict[str, np.ndarray]  # "HELD" and "DRIVEN", whose total reaction is written
    element: str  # value of mesh.element
    material: Material
    hourglass: float  # stiffness over shear modulus, of elements that have one
    steps: tuple[DeckStep, ...]
    equations: Equations | None = None
    jumps: tuple[Jump, ...] = ()
    # Nodes (k, 1) and the ground, or (k, 2), with the stiffness of a spring along each of x, y and z [N/m]
    springs: tuple[tuple[np.ndarray, float], ...] = ()
    contacts: tuple[ContactPair, ...] = ()
    interaction: DeckInteraction | None = None  # of all pairs in contact
    tolerance: float | None = None  # of residual and correction; by default 0.005 and 0.01 in both programs
    halved: bool = False  # whether increments that do not converge are made smaller
    fields: bool = True  # whether displacements are written; the total reaction always is
    departures: tuple[str, ...] = ()  # limits of the deck, in sentences


Touching = Hexahedra | PairOfHexahedra


def specimen_deck(scene: HexahedralScene, specimen: Fabric, mesh: SweptMesh) -> Deck:
    """Return the deck of a scene of hexahedra."""
    parts = divide(scene, mesh, specimen)
    edges, direction = scene.value("contact.tied_edges"), scene.value("load.direction")
    tied = tied_crossings(specimen.crossings, scene.kind.interaction.touches, edges, direction)
    tie = tie_crossings(parts, specimen, tied, scene.tie.radius, scene.yarn.youngs_modulus)
    mesh, crossings = parts.mesh, specimen.crossings
    free = tie.free(mesh.nodes)
    touching: list[tuple[int, int]] = [] if tied.all() else np.unique(crossings.yarn, axis=0).tolist()
    travel = max((float(np.linalg.norm(leg)) for leg in scene.value("load.path") or ()), default=0.0)
    reach = CONTACT_REACH * mesh.radius + travel
    interaction = None
    motion = load_path(scene, specimen)
    components = (motion.axis,) if scene.value("load.lateral") == "free" else range(3)
    increments = math.ceil(scene.solver.increments / len(motion.displacement))
    assert parts.connectivity is not None, "hexahedra have nodes"
    if touching:
        assert isinstance(scene, Touching), "yarns that are not tied may touch"
        size = scene.mesh.smallest * scene.yarn.radius
        law = penalties(scene.contact, scene.yarn.youngs_modulus, scene.friction, size)
        kind = scene.interaction if law.friction else "frictionless"
        interaction = DeckInteraction(kind, law, scene.contact.penetration * size)
    return Deck(
        title=f"{scene.name}: {scene.specimen}, {word_of(scene.interaction)}",
        nodes=parts.nodes,
        elements={f"YARN{yarn}": parts.connectivity[_elements(mesh, yarn)] for yarn in range(mesh.yarns)},
        node_sets={"HELD": np.sort(parts.ends.held), "DRIVEN": np.sort(parts.ends.driven)},
        element=scene.mesh.element,
        material=material_of(scene.yarn),
        hourglass=scene.solver.hourglass,
        steps=tuple(
            DeckStep({i + 1: float(corner[i]) for i in components}, increments)
            for corner in motion.displacement
        ),
        equations=tie.equations(np.union1d(parts.ends.held, parts.ends.driven)) if tied.any() else None,
        contacts=tuple(_contact_pair(mesh, *pair, reach, free) for pair in touching),
        interaction=interaction,
        departures=tuple(_departures(scene, tied)),
    )


def _departures(scene: HexahedralScene, tied: np.ndarray) -> Iterator[str]:
    """Yield sentences on those keys of a scene that decks have no place for."""
    if tied.any():
        yield EXACTLY_JOINED
    if tied.all() or not isinstance(scene, Touching):
        return
    if scene.is_knit:
        yield "contact: between yarns that cross; a yarn does not touch itself in a deck, so that legs may meet"
    if scene.value("load.stops"):
        yield "load.stops: the increments of a deck are equal"
    if scene.contact.augmentations:
        yield f"contact.augmentations is {scene.contact.augmentations}: contact is by penalties alone in a deck"
    if scene.solver.stabilisation:
        yield f"solver.stabilisation is {scene.solver.stabilisation:g}: a deck has none"


def _contact_pair(mesh: SweptMesh, lower: int, upper: int, reach: float, free: np.ndarray) -> ContactPair:
    """Return the facets of two yarns within a distance (m) of the other yarn; facets of the upper yarn are slaves.

    Only facets count whose nodes are all ``free`` (N,) of ties.
    """
    quads = [mesh.surface_quads(yarn) for yarn in (upper, lower)]
    above, below = (mesh.nodes[facets].mean(axis=1) for facets in quads)
    near = near_facets(above, below, reach)
    may_touch = [free[facets].all(axis=1) for facets in quads]
    surfaces = (
        facet_faces(mesh.section, _elements(mesh, yarn).start, one & other)
        for yarn, one, other in zip((upper, lower), near, may_touch, strict=True)
    )
    return ContactPair(f"YARNS{lower}_{upper}", *surfaces)


def near_facets(above: Floats, below: Floats, reach: float) -> tuple[Bools, Bools]:
    """Return which facets of two yarns, by their middles (f, 3), lie within a distance of the other yarn's [m]."""
    return cKDTree(below).query(above)[0] < reach, cKDTree(above).query(below)[0] < reach


def facet_faces(section: SectionMesh, first: int, chosen: Bools) -> DeckSurface:
    """Return the faces behind chosen facets, layer by layer, of a yarn whose hexahedra begin with the ``first``."""
    ring, quads = section.ring, section.quads
    # Both run counter-clockwise: a surface edge is one of a quad's edges, in the same direction.
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1)  # (e, 4, 2)
    wanted = np.stack([ring, np.roll(ring, -1)], axis=-1)
    place, quad, edge = np.nonzero((edges == wanted[:, None, None]).all(axis=-1))  # by place on the ring
    layer, j = np.divmod(np.flatnonzero(chosen), len(place))
    elements = first + layer * len(quads) + quad[j]
    return DeckSurface(elements, 3 + edge[j])  # S3 to S6 stand on the four edges of the bottom quad


def _elements(mesh: SweptMesh, yarn: int) -> slice:
    """Return the range of the elements of one yarn."""
    first, last = mesh.first_slice[yarn : yarn + 2] - np.arange(yarn, yarn + 2)
    return slice(int(first) * mesh.section.quads.shape[0], int(last) * mesh.section.quads.shape[0])
