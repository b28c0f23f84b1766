"""What a simulation keeps of its contact points: one row for every point that touches, at every increment."""

from __future__ import annotations

import numpy as np

from knitstudy.crossings.facets import CrossingFacets
from knitstudy.crossings.rings import Rings
from knitstudy.mechanics.contact.friction import OPEN, STICK
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.contact.passes import PASS_SHARE
from knitstudy.mechanics.contact.points import ContactPoints


def touching_points(
    contact: Contact, points: ContactPoints, facets: CrossingFacets, rings: Rings
) -> dict[str, np.ndarray]:
    """Return the columns of all points that touch, by the names that `loading.columns` has after ``contact_``.

    Parameters
    ----------
    contact : Contact
    points : ContactPoints
        Of a converged increment, after its history was brought up to date.
    facets : CrossingFacets
    rings : Rings
        Of the surfaces.
    """
    quadrature, history = contact.quadrature, points.history
    active = np.flatnonzero(history.status != OPEN)
    point, target = history.point[active], history.surface[active]
    yarn = quadrature.surface[point]
    crossing, side = facets.nearest(yarn, target, rings.arc_length_at(yarn, quadrature.xi[point, 0]))
    return {
        "crossing": crossing,
        "side": side,
        "yarn": yarn,
        "target": target,
        "cell": quadrature.cell[point],
        "position": points.position[active],
        "reference": contact.reference(point),
        "area": quadrature.area[point],
        "cell_area": quadrature.cell_area[point],
        "normal": points.projection.normal[active],
        "pressure": history.pressure[active],
        # Traction of the law acts with the internal force; on the yarn it is the reaction.
        "traction": -history.traction[active],
        "gap": history.gap[active],
        "slip": history.slip[active],
        "sticks": (history.status[active] == STICK).astype(np.int8),
    }


def crossing_forces(columns: dict[str, np.ndarray], count: int) -> np.ndarray:
    """Return the force (count, 3) of contact on the lower row's yarn at every crossing [N].

    Each side's points carry half of the stiffness; what acts on the upper row's yarn counts with the other sign.
    """
    force = columns["pressure"][:, None] * columns["normal"] + columns["traction"]
    force *= (PASS_SHARE * columns["area"] * np.where(columns["side"] == 0, 1.0, -1.0))[:, None]
    total = np.zeros((count, 3))
    near = columns["crossing"] >= 0
    np.add.at(total, columns["crossing"][near], force[near])
    return total
