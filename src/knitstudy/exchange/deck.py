"""Input decks of other finite-element programs: mesh, ties, contact, grips and load of a scene, without keywords.

Ties are linear constraints, which eliminate one node for each of a tie's moments. Contact is a pair of surfaces for
every two yarns that cross without a tie.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.contacts.facets import tied_crossings, tied_pieces
from knitstudy.errors import ConfigurationError
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.history import load_path
from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.materials import Material, material_of
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models.hexahedra import divide
from knitstudy.models.ties import STIFFNESS, tie_crossings
from knitstudy.models.yarn_contact import penalties

if TYPE_CHECKING:
    from knitstudy.study.scene import Scene

EXACTLY_JOINED = (
    f"ties: springs of {STIFFNESS:g} E R join the moments of two yarns in the scene, equations without any compliance "
    "in a deck"
)

CONTACT_REACH = 1.0
"""Distance of facets that may come to touch, over the yarn's radius, besides the distance that the load moves them."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Faces of hexahedra: elements (f,) from 0 and their faces (f,) from 1, as C3D8 counts them."""

    elements: np.ndarray
    faces: np.ndarray


@dataclass(frozen=True, eq=False)
class Equations:
    """Constraints x_slave = sum of weights times x_master: slave (K,), master (K, c), weight (K, c); 0 is no term."""

    slave: np.ndarray
    master: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True, eq=False)
class ContactPair:
    """Two surfaces that may touch: the points of ``slave`` meet the faces of ``master``."""

    name: str
    slave: Surface
    master: Surface


@dataclass(frozen=True)
class Interaction:
    """Contact law of all pairs of surfaces, and the penetration (m) that the scene allows.

    ``kind`` is isotropic, rough or frictionless.
    """

    kind: str
    law: Coulomb
    penetration: float

    @property
    def elastic_slip(self) -> float:
        """Slip (m) at which the largest penetration's pressure makes a sticking point slide.

        A program whose stick stiffness is mu p over this length has the stiffness of the law at this pressure.
        """
        return self.law.friction * self.law.normal / self.law.tangential * self.penetration


@dataclass(frozen=True)
class Prescribed:
    """Displacement ``value`` (m) of the components ``first`` to ``last`` (1 to 3) of all nodes of a set."""

    node_set: str
    first: int
    last: int
    value: float


@dataclass(frozen=True)
class Step:
    """One leg of the load: displacements at its end, reached in so many equal increments."""

    prescribed: tuple[Prescribed, ...]
    increments: int


@dataclass(frozen=True, eq=False)
class Deck:
    """Nonlinear static steps on a mesh of hexahedra, numbered from 0."""

    title: str
    nodes: np.ndarray  # (N, 3) [m]
    elements: dict[str, np.ndarray]  # nodes (e, 8) or (e, 20) of every set, one set after another
    node_sets: dict[str, np.ndarray]
    element: str  # value of mesh.element
    material: Material
    hourglass: float  # stiffness over shear modulus, of elements that have one
    steps: tuple[Step, ...]
    driven: str  # node set whose total reaction is written
    equations: Equations | None = None
    contacts: tuple[ContactPair, ...] = ()
    interaction: Interaction | None = None  # of all pairs in contact
    rests: bool = True  # whether CalculiX rests for a step before contact
    tolerance: float | None = None  # of residual and correction; by default 0.005 and 0.01 in both programs
    fields: bool = True  # whether displacements are written; the total reaction always is
    departures: tuple[str, ...] = ()  # sentences on what decks cannot say of the scene


def require_deck(scene: Scene) -> None:
    """Refuse scenes whose yarns are not divided into hexahedra.

    Raises
    ------
    ConfigurationError
    """
    if "deck" not in scene.kind.fidelity.outputs:
        raise ConfigurationError(
            f"scene {scene.name!r}: fidelity is {scene.fidelity} but must be hexahedra for a deck: other programs"
            " have no polynomials over the section times splines along the yarn"
        )


def specimen_deck(scene: Scene, specimen: Fabric, mesh: SweptMesh) -> Deck:
    """Return the deck of a scene of hexahedra."""
    parts = divide(scene, mesh, specimen)
    tied = tied_crossings(scene, specimen.crossings)
    tie = tie_crossings(parts, specimen, tied, scene.tie.radius, scene.yarn.youngs_modulus)
    mesh, crossings = parts.mesh, specimen.crossings
    free = tied_pieces(mesh.stations, crossings, tied) < 0
    touching = np.unique(crossings.yarn[~tied], axis=0)
    reach = CONTACT_REACH * mesh.radius + _travel(scene)
    gripped = np.union1d(parts.ends.held, parts.ends.driven)
    return Deck(
        title=_title(scene, specimen),
        nodes=parts.nodes,
        elements={
            f"YARN{yarn}": parts.connectivity[_yarn_elements(mesh, yarn)] for yarn in range(mesh.yarns)
        },
        node_sets={"HELD": np.sort(parts.ends.held), "DRIVEN": np.sort(parts.ends.driven)},
        element=scene.mesh.element,
        material=material_of(scene.yarn),
        hourglass=scene.solver.hourglass,
        steps=_steps(scene, specimen),
        driven="DRIVEN",
        equations=Equations(*tie.equations(gripped)) if tied.any() else None,
        contacts=tuple(_contact_pair(mesh, *pair, reach, free) for pair in touching.tolist()),
        interaction=_interaction(scene) if len(touching) else None,
        departures=tuple(_departures(scene, tied)),
    )


def _departures(scene: Scene, tied: np.ndarray) -> Iterator[str]:
    """Yield sentences on those keys of a scene that decks have no place for."""
    if tied.any():
        yield EXACTLY_JOINED
    if tied.all():
        return
    if scene.value("load.stops"):
        yield "load.stops: the increments of a deck are equal"
    if scene.contact.augmentations:
        yield f"contact.augmentations is {scene.contact.augmentations}: contact is by penalties alone in a deck"
    if scene.solver.stabilisation:
        yield f"solver.stabilisation is {scene.solver.stabilisation:g}: a deck has none"


def _interaction(scene: Scene) -> Interaction:
    """Return the law of contact of a scene, and the penetration that it allows."""
    size = scene.mesh.smallest
    law = penalties(scene, size)
    return Interaction(
        scene.interaction if law.friction else "frictionless", law, scene.contact.penetration * size
    )


def _contact_pair(mesh: SweptMesh, lower: int, upper: int, reach: float, free: np.ndarray) -> ContactPair:
    """Return the facets of two yarns within a distance (m) of the other one, those of the upper yarn as slave.

    Only facets between slices that are ``free`` (S,) of ties count.
    """
    quads = [mesh.surface_quads(yarn) for yarn in (upper, lower)]
    above, below = (mesh.nodes[facets].mean(axis=1) for facets in quads)
    may_touch = [free[facets // mesh.section.size].all(axis=1) for facets in quads]
    slave = (cKDTree(below).query(above)[0] < reach) & may_touch[0]
    master = (cKDTree(above).query(below)[0] < reach) & may_touch[1]
    name = f"YARNS{lower}_{upper}"
    return ContactPair(name, facet_faces(mesh, upper, slave), facet_faces(mesh, lower, master))


def facet_faces(mesh: SweptMesh, yarn: int, chosen: np.ndarray) -> Surface:
    """Return the faces of hexahedra that chosen facets of a yarn's lateral surface are.

    Parameters
    ----------
    chosen : ndarray of bool, as many as ``mesh.surface_quads(yarn)`` has rows
    """
    ring, quads = mesh.section.ring, mesh.section.quads
    # Both run counter-clockwise: a surface edge is one of a quad's edges, in the same direction.
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1)  # (e, 4, 2)
    wanted = np.stack([ring, np.roll(ring, -1)], axis=-1)
    quad, edge = np.nonzero((edges[None] == wanted[:, None, None]).all(axis=-1).any(axis=0))
    owner = np.argmax((edges[quad, edge][None] == wanted[:, None]).all(axis=-1), axis=1)
    layer, j = np.divmod(np.flatnonzero(chosen), ring.size)
    elements = _yarn_elements(mesh, yarn).start + layer * quads.shape[0] + quad[owner][j]
    return Surface(elements, 3 + edge[owner][j])  # S3 to S6 stand on the four edges of the bottom quad


def _yarn_elements(mesh: SweptMesh, yarn: int) -> slice:
    """Return the range of the elements of one yarn."""
    first, last = mesh.first_slice[yarn : yarn + 2] - np.arange(yarn, yarn + 2)
    return slice(int(first) * mesh.section.quads.shape[0], int(last) * mesh.section.quads.shape[0])


def _title(scene: Scene, specimen: Fabric) -> str:
    if scene.value("load.path"):
        return f"{scene.name}: two yarns at {scene.pair.angle:g} degrees, {scene.interaction}"
    loops, rows = specimen.cells
    return f"{scene.name}: {loops} x {rows} knit, {scene.interaction}, {scene.load.direction} tension"


def _steps(scene: Scene, specimen: Fabric) -> tuple[Step, ...]:
    """Return a step for every corner of the load path, with equal shares of the increments."""
    motion = load_path(scene, specimen)
    components = (motion.axis,) if scene.value("load.lateral") == "free" else range(3)
    increments = math.ceil(scene.solver.increments / len(motion.displacement))
    held = Prescribed("HELD", 1, 3, 0.0)
    return tuple(
        Step((held, *(Prescribed("DRIVEN", i + 1, i + 1, float(corner[i])) for i in components)), increments)
        for corner in motion.displacement
    )


def _travel(scene: Scene) -> float:
    """Return the largest distance (m) that the load moves one yarn of a pair over the other; 0 of a knit."""
    return max((float(np.linalg.norm(leg)) for leg in scene.value("load.path") or ()), default=0.0)
