"""What contact adds to solid yarns: their model, what is seen of it, and what is refused.

An interaction names this module (`study.kinds.Interaction`); scenes whose yarns are all tied never load it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from knitstudy.crossings.facets import CrossingFacets
from knitstudy.crossings.record import crossing_forces, touching_points
from knitstudy.crossings.rings import Rings
from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.contact.indentation import Indentation
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.solids_in_contact import Penetration, SolidsInContact
from knitstudy.solids.beside_ties import BesideTies
from knitstudy.solids.discretisation import Discretisation
from knitstudy.solids.free_yarns import free_yarns
from knitstudy.solids.tie import Tie
from knitstudy.solids.yarn_contact import yarn_contact
from knitstudy.study.scene import Scene

if TYPE_CHECKING:
    from knitstudy.loading.history import Recorder


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
    allowed_by, widened_by : str
        Keys that say so, and how wide the ties are.
    """

    model: SolidsInContact
    facets: CrossingFacets
    rings: Rings
    around: int
    beside: BesideTies | None
    overlap: float
    allowed_by: str
    widened_by: str

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
                f"{self.allowed_by} allows {limit:.3g} m. Use contact.tied_edges 'none', a larger {self.widened_by} or "
                "a smaller load.strain"
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
    tie: Tie,
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
    tie : Tie
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
    contact = yarn_contact(scene, yarns, tie.nodes, pieces)
    model = SolidsInContact(
        *solids,
        contact=contact,
        penetration=_penetration(scene, contact.law, yarns.size),
        free_bodies=free_yarns(yarns, tie, volume, scene.yarn.youngs_modulus),
    )
    beside = BesideTies(scene, yarns, tie, pieces) if len(tie.joined) else None
    around = int(yarns.surfaces.cells[0, 1])
    allowed_by, overlap = _overlap(scene, yarns)
    widened_by = "tie.tolerance" if scene.value("tie.rule") == "facets" else "tie.radius"
    return Touching(model, facets, yarns.rings, around, beside, overlap, allowed_by, widened_by)


def _penetration(scene: Scene, law: Coulomb | Indentation, size: float) -> Penetration:
    """Return what is allowed of elements of a size [m]: of local indentation all of it, else what the scene says."""
    if isinstance(law, Indentation):
        return Penetration(
            law.end,
            remedy="contact.law 'indentation' is not known beyond: use a smaller load, a smaller "
            "mesh.crossing_degree, or hexahedra",
        )
    return Penetration(scene.contact.penetration * size, scene.contact.augmentations)


def _overlap(scene: Scene, yarns: Discretisation) -> tuple[str, float]:
    """Return how far tied yarns may overlap beside their ties [m], after the key that says so.

    Beside a disc that is tied, what the undeformed surfaces are apart at its edge, a^2 / R: flattening the disc indents
    them as deep, and nothing but contact would keep the rest apart.
    """
    if scene.value("tie.rule") == "facets":
        return "contact.penetration", scene.contact.penetration * yarns.size
    return "tie.radius", scene.tie.radius**2 * yarns.mesh.radius
