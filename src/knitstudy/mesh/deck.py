"""Input decks of other finite-element programs: what they hold, whatever the dialect.

The same tied knit can be handed over in two ways. As *surfaces*, the other program finds the ties itself; as
*equations* it gets exactly the linear constraints that are eliminated here, on the adjusted mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.errors import ConfigurationError
from knitstudy.mesh.sweep import SweptMesh

if TYPE_CHECKING:
    from knitstudy.contact.tie import Tie
    from knitstudy.geometry.pattern import Knit
    from knitstudy.scene import Scene

CONSTRAINTS = ("surfaces", "equations")

POSITION_MARGIN = 1.05
"""Position tolerance over the gap of the farthest slave node: rounding must not lose it."""


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
    """Constraints x_slave = sum of weights times x_master: slave (K,), master (K, 4), weight (K, 4)."""

    slave: np.ndarray
    master: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class Prescribed:
    """Displacement ``value`` (m) of the components ``first`` to ``last`` (1 to 3) of all nodes of a set."""

    node_set: str
    first: int
    last: int
    value: float


@dataclass(frozen=True, eq=False)
class Deck:
    """One nonlinear static step on a mesh of C3D8R, numbered from 0.

    Attributes
    ----------
    title : str
    nodes : ndarray (N, 3)
        Coordinates, m.
    elements : dict of str to ndarray (e, 8)
        Corner nodes of the elements of every set; the sets follow each other in the numbering of elements.
    node_sets : dict of str to ndarray
    ties : tuple of TiedPair
    equations : Equations or None
    youngs_modulus, poisson_ratio : float
        Pa, 1.
    prescribed : tuple of Prescribed
    driven : str
        Node set whose total reaction is written.
    increments : int
    automatic : bool
        Whether the program may choose other increments.
    tolerance : float or None
        Largest residual force over the mean one, and largest last correction over the increment, at which an
        increment has converged; None leaves it to the program (0.005 and 0.01 in both).
    fields : bool
        Whether displacements are written; the total reaction always is.
    """

    title: str
    nodes: np.ndarray
    elements: dict[str, np.ndarray]
    node_sets: dict[str, np.ndarray]
    ties: tuple[TiedPair, ...]
    equations: Equations | None
    youngs_modulus: float
    poisson_ratio: float
    prescribed: tuple[Prescribed, ...]
    driven: str
    increments: int
    automatic: bool = False
    tolerance: float | None = None
    fields: bool = True


def tied_knit(
    scene: Scene,
    knit: Knit,
    mesh: SweptMesh,
    tie: Tie,
    constraints: str = "surfaces",
    automatic: bool = False,
) -> Deck:
    """Deck of a tied knit in course tension: left ends fixed, right ends driven.

    Parameters
    ----------
    scene : Scene
    knit : Knit
    mesh : SweptMesh
    tie : Tie
        Constraints of the tied crossings.
    constraints : {"surfaces", "equations"}
        Whether the other program ties the surfaces itself, or gets the constraints as equations.
    automatic : bool
        Whether the program may choose other increments than the scene's.

    Raises
    ------
    ConfigurationError
        If the load is not course tension, or ``constraints`` is unknown.
    """
    if constraints not in CONSTRAINTS:
        raise ConfigurationError(
            f"deck constraints: {constraints!r} is not allowed; one of {', '.join(CONSTRAINTS)}"
        )
    if scene.load.direction != "course":
        raise ConfigurationError(
            f"scene {scene.name!r}: load.direction {scene.load.direction!r} has no deck; allowed is 'course'"
        )
    as_equations = constraints == "equations"
    return Deck(
        title=f"{scene.name}: tied {knit.loops} x {knit.rows} knit, course tension",
        nodes=tie.nodes if as_equations else mesh.nodes,
        elements={f"YARN{yarn}": mesh.hexahedra[_yarn_elements(mesh, yarn)] for yarn in range(mesh.yarns)},
        node_sets={side.upper(): np.sort(mesh.end_nodes(side)) for side in ("left", "right")},
        ties=() if as_equations else tied_rows(mesh, tie),
        equations=Equations(tie.slave, tie.master, tie.weight) if as_equations else None,
        youngs_modulus=scene.yarn.youngs_modulus,
        poisson_ratio=scene.yarn.poisson_ratio,
        prescribed=_course_tension(scene, knit),
        driven="RIGHT",
        increments=scene.solver.increments,
        automatic=automatic,
    )


def tied_rows(mesh: SweptMesh, tie: Tie) -> tuple[TiedPair, ...]:
    """One pair of surfaces for every interlock row.

    The slave surface holds exactly the tied facets of the upper yarn; the master surface the facets of the
    lower yarn that lie within a radius of them.
    """
    yarn_of_slave = mesh.yarn_of_slice[tie.slave // mesh.section.size]
    pairs = []
    for yarn in np.unique(yarn_of_slave):
        slaves = tie.slave[yarn_of_slave == yarn]
        tied = np.isin(mesh.surface_quads(yarn), slaves).all(axis=1)
        centroids = mesh.nodes[mesh.surface_quads(yarn - 1)].mean(axis=1)
        near = cKDTree(mesh.nodes[slaves]).query(centroids)[0] < mesh.radius
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


def _course_tension(scene: Scene, knit: Knit) -> tuple[Prescribed, ...]:
    """Left ends held, right ends moved by strain times the width of the knit."""
    stretch = scene.load.strain * knit.width
    held = Prescribed("LEFT", 1, 3, 0.0)
    drive = Prescribed("RIGHT", 1, 1, stretch)
    if scene.load.lateral == "free":
        return held, drive
    return held, drive, Prescribed("RIGHT", 2, 3, 0.0)
