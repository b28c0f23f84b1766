"""Input decks of other finite-element programs: what they hold, whatever the dialect.

The same ties can be handed over in two ways. As *surfaces*, the other program finds tied facets itself; as
*equations* it gets linear constraints: of facets exactly those that are eliminated here, on the adjusted mesh, of
patches those that stiff springs stand for here. Contact is always handed over as surfaces, one pair for every row
of crossings that are not tied.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.contacts.facets import tied_pieces
from knitstudy.errors import ConfigurationError
from knitstudy.loading.load_path import load_path
from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.materials import Material
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models.facet_tie import tie_crossings
from knitstudy.models.hexahedra import divide
from knitstudy.models.ties import STIFFNESS
from knitstudy.models.yarn_contact import penalties

if TYPE_CHECKING:
    from knitstudy.geometry.pair import YarnPair
    from knitstudy.geometry.pattern import Knit
    from knitstudy.models.discretisation import Discretisation
    from knitstudy.models.facet_tie import FacetTie
    from knitstudy.models.ties import Tie
    from knitstudy.study.scene import Scene

CONSTRAINTS = ("surfaces", "equations")

EXACTLY_JOINED = (
    f"tie.rule is patch: springs of {STIFFNESS:g} E R join moments in the scene, equations without "
    f"any compliance in a deck"
)
FACETS_INSTEAD = "tie.rule is patch: a program that ties surfaces ties facets within tie.tolerance instead"

POSITION_MARGIN = 1.05
"""Position tolerance over the gap of the farthest slave node: rounding must not lose it."""

CONTACT_REACH = 1.0
"""Distance of facets that may come to touch, over the yarn's radius, besides what the load moves them."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Faces of hexahedra: elements (f,) from 0 and their faces (f,) from 1, as C3D8 counts them."""

    elements: np.ndarray
    faces: np.ndarray


@dataclass(frozen=True, eq=False)
class TiedPair:
    """Two surfaces, of which the nodes of ``slave`` within ``tolerance`` (m) follow ``master``."""

    name: str
    slave: Surface
    master: Surface
    tolerance: float


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
    """What happens where surfaces touch: the scene's word for it, its law, and the penetration (m) that it allows."""

    kind: str
    law: Coulomb
    penetration: float

    @property
    def elastic_slip(self) -> float:
        """Slip (m) at which the largest penetration's pressure makes a sticking point slide.

        For a program whose stick stiffness is mu p over this length: it is then that of the law at this pressure.
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
    """Nonlinear static steps on a mesh of hexahedra, numbered from 0.

    Attributes
    ----------
    title : str
    nodes : ndarray (N, 3)
        Coordinates, m.
    elements : dict of str to ndarray (e, 8) or (e, 20)
        Nodes of the elements of every set; the sets follow each other in the numbering of elements.
    node_sets : dict of str to ndarray
    element : str
        The scene's word for it, ``mesh.element``.
    material : Material
    hourglass : float
        Hourglass stiffness over shear modulus, of elements that have one.
    steps : tuple of Step
    driven : str
        Node set whose total reaction is written.
    ties : tuple of TiedPair
    equations : Equations or None
    contacts : tuple of ContactPair
    interaction : Interaction or None
        Of all pairs in contact.
    rests : bool
        Whether a step in which nothing is driven comes first where a program needs one before contact.
    tolerance : float or None
        Largest residual force over the mean one, and largest last correction over the increment, at which an
        increment has converged; None leaves it to the program (0.005 and 0.01 in both).
    fields : bool
        Whether displacements are written; the total reaction always is.
    departures : tuple of str
        Sentences on what no deck says of the scene.
    """

    title: str
    nodes: np.ndarray
    elements: dict[str, np.ndarray]
    node_sets: dict[str, np.ndarray]
    element: str
    material: Material
    hourglass: float
    steps: tuple[Step, ...]
    driven: str
    ties: tuple[TiedPair, ...] = ()
    equations: Equations | None = None
    contacts: tuple[ContactPair, ...] = ()
    interaction: Interaction | None = None
    rests: bool = True
    tolerance: float | None = None
    fields: bool = True
    departures: tuple[str, ...] = ()


def require_deck(scene: Scene) -> None:
    """Refuse scenes whose yarns are divided into what no other program has.

    Raises
    ------
    ConfigurationError
    """
    if "deck" not in scene.kind.fidelity.outputs:
        raise ConfigurationError(
            f"scene {scene.name!r}: fidelity is {scene.fidelity} but must be hexahedra for a deck: other programs have no "
            "polynomials over the section times splines along the yarn"
        )


def specimen_deck(
    scene: Scene,
    specimen: Knit | YarnPair,
    mesh: SweptMesh,
    tie: Tie,
    constraints: str | None = None,
) -> Deck:
    """Deck of a knit in tension, or of a pair of yarns on its path: ties, contact, grips and load.

    Parameters
    ----------
    scene : Scene
    specimen : Knit or YarnPair
    mesh : SweptMesh
    tie : Tie
        Constraints of the tied crossings; elsewhere yarns touch by the scene's interaction.
    constraints : {"surfaces", "equations"}, optional
        Whether the other program ties the surfaces itself, or gets the constraints as equations; by default
        surfaces for ties of facets, and equations for patches, which no program has.

    Raises
    ------
    ConfigurationError
        If ``constraints`` is unknown.
    """
    patches = scene.value("tie.rule") == "patch"
    if constraints is None:
        constraints = "equations" if patches else "surfaces"
    if constraints not in CONSTRAINTS:
        raise ConfigurationError(
            f"deck constraints: {constraints!r} is not allowed; one of {', '.join(CONSTRAINTS)}"
        )
    parts = divide(scene, mesh, specimen)
    mesh = parts.mesh
    as_equations = constraints == "equations"
    tied = np.isfinite(tie.area)
    free = tied_pieces(mesh.stations, specimen.crossings, tied) < 0
    touching = np.unique(specimen.crossings.row[~tied])
    reach = CONTACT_REACH * mesh.radius + _travel(scene)
    equations = None
    if as_equations and tied.any():
        equations = Equations(*tie.equations(np.union1d(parts.ends.held, parts.ends.driven)))
    departures = tuple(_unsaid(scene)) if touching.size else ()
    if patches and tied.any():
        departures += (EXACTLY_JOINED if as_equations else FACETS_INSTEAD,)
        if not as_equations:
            tie = tie_crossings(mesh, specimen, scene.tie.tolerance, tied, parts.faces)
    return Deck(
        title=_title(scene, specimen),
        nodes=tie.nodes if as_equations else parts.nodes,
        elements={
            f"YARN{yarn}": parts.connectivity[_yarn_elements(mesh, yarn)] for yarn in range(mesh.yarns)
        },
        node_sets={"HELD": np.sort(parts.ends.held), "DRIVEN": np.sort(parts.ends.driven)},
        element=scene.mesh.element,
        material=Material(scene.yarn.material, scene.yarn.youngs_modulus, scene.yarn.poisson_ratio),
        hourglass=scene.solver.hourglass,
        steps=_steps(scene, specimen),
        driven="DRIVEN",
        ties=() if as_equations else tied_pairs(parts, tie),
        equations=equations,
        contacts=tuple(touching_row(mesh, row, reach, free) for row in touching),
        interaction=interaction(scene) if touching.size else None,
        departures=departures,
    )


def _unsaid(scene: Scene) -> Iterator[str]:
    """Yield sentences on those keys of a scene with contact that decks have no place for."""
    if scene.value("load.stops"):
        yield "load.stops: the increments of a deck are equal"
    if scene.contact.augmentations:
        yield f"contact.augmentations is {scene.contact.augmentations}: contact is by penalties alone in a deck"
    if scene.solver.stabilisation:
        yield f"solver.stabilisation is {scene.solver.stabilisation:g}: a deck has none"


def interaction(scene: Scene) -> Interaction:
    """Law of contact of a scene, and the penetration that it allows."""
    size = scene.mesh.smallest
    return Interaction(scene.interaction, penalties(scene, size), scene.contact.penetration * size)


def touching_row(mesh: SweptMesh, row: int, reach: float, free: np.ndarray) -> ContactPair:
    """YarnPair of surfaces of an interlock row: the facets of both yarns within a distance (m) of the other one.

    Only facets between slices that are ``free`` (S,) of ties count. The upper yarn is the slave.
    """
    quads = [mesh.surface_quads(yarn) for yarn in (row + 1, row)]
    upper, lower = (mesh.nodes[facets].mean(axis=1) for facets in quads)
    may_touch = [free[facets // mesh.section.size].all(axis=1) for facets in quads]
    slave = (cKDTree(lower).query(upper)[0] < reach) & may_touch[0]
    master = (cKDTree(upper).query(lower)[0] < reach) & may_touch[1]
    return ContactPair(f"ROW{row}", facet_faces(mesh, row + 1, slave), facet_faces(mesh, row, master))


def tied_pairs(parts: Discretisation, tie: FacetTie) -> tuple[TiedPair, ...]:
    """One pair of surfaces for every interlock row.

    The slave surface holds exactly the tied facets of the upper yarn; the master surface the facets of the
    lower yarn that lie within a radius of them.
    """
    mesh, yarn_of_slave = parts.mesh, parts.yarn[tie.slave]
    pairs = []
    for yarn in np.unique(yarn_of_slave):
        slaves = tie.slave[yarn_of_slave == yarn]
        tied = np.isin(parts.faces.of_yarn[yarn], slaves).all(axis=1)
        centroids = mesh.nodes[mesh.surface_quads(yarn - 1)].mean(axis=1)
        near = cKDTree(parts.nodes[slaves]).query(centroids)[0] < mesh.radius
        tolerance = POSITION_MARGIN * tie.adjustment[yarn_of_slave == yarn].max()
        slave, master = facet_faces(mesh, yarn, tied), facet_faces(mesh, yarn - 1, near)
        pairs.append(TiedPair(f"ROW{yarn - 1}", slave, master, tolerance))
    return tuple(pairs)


def facet_faces(mesh: SweptMesh, yarn: int, chosen: np.ndarray) -> Surface:
    """Faces of hexahedra that chosen facets of a yarn's lateral surface are.

    Parameters
    ----------
    mesh : SweptMesh
    yarn : int
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
    return Surface(
        elements=elements, faces=3 + edge[owner][j]
    )  # S3 to S6 stand on the bottom quad's four edges


def _yarn_elements(mesh: SweptMesh, yarn: int) -> slice:
    """Range of the elements of one yarn."""
    first, last = mesh.first_slice[yarn : yarn + 2] - np.arange(yarn, yarn + 2)
    return slice(int(first) * mesh.section.quads.shape[0], int(last) * mesh.section.quads.shape[0])


def _title(scene: Scene, specimen: Knit | YarnPair) -> str:
    if scene.specimen == "pair":
        return f"{scene.name}: two yarns at {scene.pair.angle:g} degrees, {scene.interaction}"
    return f"{scene.name}: {specimen.loops} x {specimen.rows} knit, {scene.interaction}, {scene.load.direction} tension"


def _steps(scene: Scene, specimen: Knit | YarnPair) -> tuple[Step, ...]:
    """Grips held, and driven to one corner of the load path after another with equal shares of the increments."""
    motion = load_path(scene, specimen)
    components = (motion.axis,) if scene.value("load.lateral") == "free" else range(3)
    increments = math.ceil(scene.solver.increments / len(motion.displacement))
    held = Prescribed("HELD", 1, 3, 0.0)
    return tuple(
        Step((held, *(Prescribed("DRIVEN", i + 1, i + 1, float(corner[i])) for i in components)), increments)
        for corner in motion.displacement
    )


def _travel(scene: Scene) -> float:
    """Largest distance (m) that the load moves one yarn of a pair over the other; those of a knit move together."""
    return max((float(np.linalg.norm(leg)) for leg in scene.value("load.path") or ()), default=0.0)
