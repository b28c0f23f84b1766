"""Contact of the yarns of a specimen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from knitstudy.contacts.facets import CrossingFacets, Rings, crossing_forces, touching_points
from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.contact.friction import ContactHistory, Coulomb
from knitstudy.mechanics.contact.indentation import Indentation, indentation
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.materials import material_of
from knitstudy.mechanics.model import FreeBodies
from knitstudy.mechanics.solids_in_contact import Penetration, SolidsInContact
from knitstudy.models.discretisation import Discretisation
from knitstudy.models.ties import Ties
from knitstudy.study.scene import Scene

if TYPE_CHECKING:
    from knitstudy.loading.history import Recorder


# ---- Contact between the yarns of a specimen: smooth tubes of the true radius


MARGIN = 0.3
"""Distance up to which pairs of points and surfaces are followed, over the yarn's radius."""


def yarn_contact(scene: Scene, yarns: Discretisation, pieces: np.ndarray) -> Contact:
    """Return the contact of all yarns of a scene with each other and with themselves.

    Pieces of yarn that are tied to each other do not touch: what the tie does would be done twice there.

    Parameters
    ----------
    scene : Scene
    yarns : Discretisation
    pieces : ndarray of int, shape (R,)
        What every ring is tied in; see `tied_crossings.tied_pieces`.

    Raises
    ------
    MeshError
        If yarns overlap before anything moves.
    """
    return Contact(
        yarns.nodes,
        yarns.surfaces,
        contact_law(scene, yarns),
        pieces=pieces,
        points=scene.contact.points,
        margin=MARGIN * yarns.mesh.radius,
        overlap=scene.contact.penetration * yarns.size,
    )


def contact_law(scene: Scene, yarns: Discretisation) -> Coulomb | Indentation:
    """Return the law of a scene: of spline yarns what their space does not show of the local indentation."""
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


# ---- Yarns that are tied to each other have no contact; whether they stay apart beside the ties is watched instead


class BesideTies:
    """The gaps between pieces of yarn that are tied, away from the ties.

    Parameters
    ----------
    scene : Scene
    yarns : Discretisation
    tie : Ties
    pieces : ndarray of int, shape (R,)
        Interlock row that every ring is tied in; see `tied_crossings.tied_pieces`.
    """

    def __init__(self, scene: Scene, yarns: Discretisation, tie: Ties, pieces: np.ndarray) -> None:
        mesh = yarns.mesh
        rows = np.unique(pieces[pieces >= 0])
        meets = np.zeros((mesh.yarns, mesh.yarns), dtype=bool)
        meets[rows, rows + 1] = meets[rows + 1, rows] = True
        self._contact = Contact(
            yarns.nodes,
            yarns.surfaces,
            contact_law(scene, yarns),
            meets=meets,
            points=1,
            margin=MARGIN * mesh.radius,
            overlap=np.inf,
        )
        self._pieces, self._rings = pieces, yarns.rings
        self._tie = tie
        # Nothing is remembered: with the same empty history all along, pairs of a search stay followed.
        self._history = ContactHistory.empty()

    def smallest_gap(self, nodes: np.ndarray) -> float:
        """Return the smallest gap of current nodes (N, 3) beside the ties [m]; inf if nothing is near."""
        points = self._contact.points(nodes, nodes, self._history)
        (xi, gap), pairs = self._contact.everywhere(points), points.followed
        quadrature = self._contact.quadrature
        own = self._piece(quadrature.surface[pairs.point], quadrature.xi[pairs.point, 0])
        other = self._piece(pairs.surface, xi[:, 0])
        near = np.flatnonzero(np.isfinite(gap) & (own == other) & (own >= 0))
        place = self._contact.reference(pairs.point[near])
        return float(gap[near[self._tie.beside(place)]].min(initial=np.inf))

    def _piece(self, yarn: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Return what places (k,) along yarns (k,) are tied in."""
        return self._pieces[self._rings.nearest(yarn, along)]


# ---- Which yarns of a specimen nothing but contact can hold: those without a grip and without a tie


def free_yarns(
    yarns: Discretisation, tie: Ties, volume: np.ndarray, youngs_modulus: float
) -> FreeBodies | None:
    """Return the free yarns of a specimen, as knits in wale tension have between their grips; None if there are none.

    Parameters
    ----------
    yarns : Discretisation
    tie : Ties
    volume : ndarray, shape (N,)
        Of every node [m3].
    youngs_modulus : float
        Of the yarns [Pa].
    """
    fixed = np.concatenate([yarns.ends.held, yarns.ends.driven, tie.joined])
    free = np.setdiff1d(np.arange(yarns.mesh.yarns), yarns.yarn[fixed])
    if not len(free):
        return None
    return FreeBodies.of(
        [yarns.nodes_of(yarn) for yarn in free], volume, youngs_modulus, yarns.size, yarns.unity
    )


# ---- What contact adds to solid yarns: their model, what is seen of it, and what is refused
# An interaction names this module (`study.kinds.Interaction`); scenes whose yarns are all tied never load it.


@dataclass(frozen=True, eq=False)
class Touching:
    """Contact of solid yarns, as the history sees it.

    Attributes
    ----------
    model : SolidsInContact
    facets : CrossingFacets
    rings : Rings
        Of the surfaces.
    around : int
        Cells of contact around a yarn.
    beside : BesideTies or None
        Watches tied yarns where others are in contact.
    overlap : float
        How far these may go through each other [m].
    """

    model: SolidsInContact
    facets: CrossingFacets
    rings: Rings
    around: int
    beside: BesideTies | None
    overlap: float

    def record(
        self, increment: Increment, crossings: int
    ) -> tuple[dict[str, Any], dict[str, np.ndarray], np.ndarray]:
        """Return columns of the history, columns of the points in contact, and forces (K, 3) at the crossings [N]."""
        model, state = self.model, increment.state
        touching = model.contact_points(state)
        points = touching_points(model.contact, touching, self.facets, self.rings)
        columns = {"smallest_gap": model.contact.smallest_gap(touching), "augmentations": state.augmentations}
        if self.beside is not None:
            beside = self.beside.smallest_gap(model.nodes + model.node_displacement(state))
            columns["smallest_gap"] = min(columns["smallest_gap"], beside)
            columns["gap_beside_ties"] = beside
        columns |= {name: np.nan for name, value in columns.items() if np.isinf(value)}  # nothing is near
        return columns, points, crossing_forces(points, crossings)

    def require_apart(self, increment: Increment, recorder: Recorder) -> None:
        """Refuse a state in which tied yarns go through each other beside the ties; contact sees to all others.

        Raises
        ------
        ConvergenceError
            If they overlap by more than the scene allows.
        """
        gap, limit = recorder.columns["gap_beside_ties"][-1], self.overlap
        if gap < -limit:
            raise ConvergenceError(
                f"increment {increment.index}: tied yarns penetrate each other by {-gap:.3g} m beside their ties; "
                f"tie.radius allows {limit:.3g} m. Use contact.tied_edges 'none', a larger tie.radius or a smaller "
                "load.strain"
            )

    def attributes(self) -> dict[str, float]:
        """Return what contact was computed with."""
        law = self.model.contact.law
        return {
            "facets_around": self.around,
            **law.attributes(),
            "friction": law.friction,
            "penetration_limit": self.model.penetration.limit,
        }


def touching(
    scene: Scene,
    yarns: Discretisation,
    tie: Ties,
    pieces: np.ndarray,
    facets: CrossingFacets,
    volume: np.ndarray,
    solids: tuple[Any, ...],
) -> Touching:
    """Return the contact of a scene's yarns, with the model that it is a part of.

    Parameters
    ----------
    scene : Scene
    yarns : Discretisation
    tie : Ties
    pieces : ndarray of int, shape (R,)
        What every ring is tied in; see `tied_crossings.tied_pieces`.
    facets : CrossingFacets
    volume : ndarray, shape (N,)
        Of every node [m3].
    solids : tuple
        Arguments of `SolidModel`.

    Raises
    ------
    MeshError
        If yarns overlap before anything moves.
    """
    contact = yarn_contact(scene, yarns, pieces)
    model = SolidsInContact(
        *solids,
        contact=contact,
        penetration=_penetration(scene, contact.law, yarns.size),
        free_bodies=free_yarns(yarns, tie, volume, scene.yarn.youngs_modulus),
    )
    beside = BesideTies(scene, yarns, tie, pieces) if len(tie.joined) else None
    around = int(yarns.surfaces.cells[0, 1])
    # The undeformed surfaces are a^2 / R apart at the edge of a tied disc of radius a: flattening the disc indents
    # them as deep, and nothing but contact would keep the rest apart.
    overlap = scene.tie.radius**2 * yarns.mesh.radius
    return Touching(model, facets, yarns.rings, around, beside, overlap)


def _penetration(scene: Scene, law: Coulomb | Indentation, size: float) -> Penetration:
    """Return what is allowed of elements of a size [m]: of local indentation all of it, else what the scene says."""
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
