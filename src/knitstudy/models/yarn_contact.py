"""Contact of the yarns of a fabric with each other and with themselves: smooth tubes of the true radius."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from knitstudy.contacts.facets import CrossingFacets, Rings, crossing_forces, touching_points
from knitstudy.errors import ConvergenceError
from knitstudy.loading.history import Recorder
from knitstudy.mechanics.contact.friction import ContactHistory, Coulomb
from knitstudy.mechanics.contact.indentation import Indentation, indentation
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.materials import material_of
from knitstudy.mechanics.model import FreeBodies
from knitstudy.mechanics.solid import Penetration, SolidModel, SolidState
from knitstudy.models.discretisation import Discretisation
from knitstudy.models.ties import Ties
from knitstudy.study.scene import Scene

MARGIN = 0.3
"""Distance up to which pairs of points and surfaces are followed, over the yarn's radius."""


def contact_of(scene: Scene, yarns: Discretisation, labels: np.ndarray) -> Contact:
    """Return the contact of all yarns of a scene.

    Raises MeshError if yarns overlap before anything moves.

    Parameters
    ----------
    labels : ndarray of int, shape (R,)
        Of the rings of the surfaces (`contacts.facets.tied_pieces`): rings with one label, if it is not -1, do not
        touch.
    """
    return Contact(
        yarns.nodes,
        yarns.surfaces,
        contact_law(scene, yarns),
        pieces=labels,
        points=scene.contact.points,
        margin=MARGIN * yarns.mesh.radius,
        overlap=scene.contact.penetration * yarns.size,
    )


def contact_law(scene: Scene, yarns: Discretisation) -> Coulomb | Indentation:
    """Return the law of a scene; yarns without hexahedra may add the local indentation that they do not resolve."""
    if scene.value("mesh.crossing_degree") is not None:
        modulus, poisson = material_of(scene.yarn).across
        return indentation(
            scene.mesh.crossing_degree,
            scene.mesh.crossing_span,
            scene.mesh.spline_degree,
            modulus=modulus,
            poisson=poisson,
            radius=yarns.mesh.radius,
            friction=scene.kind.interaction.friction(scene),
        )
    return penalties(scene, yarns.size)


def penalties(scene: Scene, size: float) -> Coulomb:
    """Return stiffnesses as ratios to E / h (Table 1), h = `size` [m], with no slip at all where contact is rough."""
    unit = scene.yarn.youngs_modulus / size
    return Coulomb(
        normal=scene.contact.normal_stiffness * unit,
        tangential=scene.contact.tangential_stiffness * unit,
        friction=scene.kind.interaction.friction(scene),
    )


def penetration_of(scene: Scene, law: Coulomb | Indentation, size: float) -> Penetration:
    """Return the penetration limit of a scene with elements of a size [m]."""
    if isinstance(law, Indentation):
        return Penetration(
            law.end,
            remedy="the law of indentation is not known beyond: use a smaller load, a smaller "
            "mesh.crossing_degree, or hexahedra",
        )
    return Penetration(
        scene.contact.penetration * size,
        scene.contact.augmentations,
        "Use a larger contact.normal_stiffness or contact.augmentations",
    )


def free_yarns(
    yarns: Discretisation, ties: Ties, volume: np.ndarray, youngs_modulus: float
) -> FreeBodies | None:
    """Return the yarns without grip and tie, which nothing but contact can hold; None if there are none.

    Parameters
    ----------
    volume : ndarray, shape (N,)
        Of every node [m3].
    youngs_modulus : float
        Of the yarns [Pa].
    """
    fixed = np.concatenate([yarns.ends.held, yarns.ends.driven, ties.joined])
    free = np.setdiff1d(np.arange(yarns.mesh.yarns), yarns.yarn[fixed])
    if not len(free):
        return None
    return FreeBodies.of(
        [yarns.nodes_of(yarn) for yarn in free], volume, youngs_modulus, yarns.size, yarns.unity
    )


class BesideTies:
    """Gaps between pieces of yarn that are tied to each other, beside the ties: no contact acts there.

    Parameters
    ----------
    scene : Scene
    yarns : Discretisation
    ties : Ties
    pairs : ndarray of int, shape (k, 2)
        Yarns that are tied to each other.
    labels : ndarray of int, shape (R,)
        Of the rings of the surfaces, -1 where yarns are not tied (`contacts.facets.tied_pieces`).
    """

    def __init__(
        self, scene: Scene, yarns: Discretisation, ties: Ties, pairs: np.ndarray, labels: np.ndarray
    ) -> None:
        mesh = yarns.mesh
        meets = np.zeros((mesh.yarns, mesh.yarns), dtype=bool)
        meets[pairs[:, 0], pairs[:, 1]] = meets[pairs[:, 1], pairs[:, 0]] = True
        self._contact = Contact(
            yarns.nodes,
            yarns.surfaces,
            contact_law(scene, yarns),
            meets=meets,
            points=1,
            margin=MARGIN * mesh.radius,
            overlap=np.inf,
        )
        self._labels, self._rings, self._ties = labels, yarns.rings, ties
        # With the same empty history all along, pairs of a search stay followed.
        self._history = ContactHistory.empty()

    def smallest_gap(self, nodes: np.ndarray) -> float:
        """Return the smallest gap of current nodes (N, 3) beside the ties [m]; inf if nothing is near."""
        points = self._contact.points(nodes, nodes, self._history)
        (xi, gap), pairs = self._contact.everywhere(points), points.followed
        quadrature = self._contact.quadrature
        own = self._label(quadrature.surface[pairs.point], quadrature.xi[pairs.point, 0])
        other = self._label(pairs.surface, xi[:, 0])
        near = np.flatnonzero(np.isfinite(gap) & (own == other) & (own >= 0))
        place = self._contact.reference(pairs.point[near])
        return float(gap[near[self._ties.beside(place)]].min(initial=np.inf))

    def _label(self, yarn: np.ndarray, along: np.ndarray) -> np.ndarray:
        return self._labels[self._rings.nearest(yarn, along)]


@dataclass(frozen=True, eq=False)
class YarnContact:
    """Contact of solid yarns, as the history reports it."""

    model: SolidModel
    facets: CrossingFacets
    rings: Rings  # of the surfaces
    beside: BesideTies | None  # where some yarns are tied and others in contact
    # Largest penetration beside ties [m]. Undeformed surfaces are a^2 / R apart at the edge of a tied disc of
    # radius a; flattening the disc indents them as deep
    overlap: float

    def record(
        self, state: SolidState, crossings: int
    ) -> tuple[dict[str, Any], dict[str, np.ndarray], np.ndarray]:
        """Return columns of the history, columns of the points in contact, and forces (K, 3) at the crossings [N]."""
        model = self.model
        near = model.contact_points(state)
        points = touching_points(model.contact, near, self.facets, self.rings)
        columns = {"smallest_gap": model.contact.smallest_gap(near), "augmentations": state.augmentations}
        if self.beside is not None:
            beside = self.beside.smallest_gap(model.nodes + model.node_displacement(state))
            columns["smallest_gap"] = min(columns["smallest_gap"], beside)
            columns["gap_beside_ties"] = beside
        columns |= {name: np.nan for name, value in columns.items() if np.isinf(value)}  # nothing is near
        return columns, points, crossing_forces(points, crossings)

    def require_apart(self, increment: Increment, recorder: Recorder) -> None:
        """Refuse a state in which tied yarns penetrate each other beside their ties.

        Raises
        ------
        ConvergenceError
        """
        gap = recorder.columns["gap_beside_ties"][-1]
        if gap < -self.overlap:
            raise ConvergenceError(
                f"increment {increment.index}: tied yarns penetrate each other by {-gap:.3g} m beside their ties; "
                f"tie.radius allows {self.overlap:.3g} m. Use contact.tied_edges 'none', a larger tie.radius or a "
                "smaller load.strain"
            )

    def attributes(self) -> dict[str, float]:
        """Return the attributes of a history for the contact."""
        law = self.model.contact.law
        return {
            "facets_around": int(self.model.contact.surfaces.cells[0, 1]),
            **law.attributes(),
            "friction": law.friction,
            "penetration_limit": self.model.penetration.limit,
        }
