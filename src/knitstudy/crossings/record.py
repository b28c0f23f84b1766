"""What a simulation keeps of its contact points: one row for every point that touches, at every increment."""

from __future__ import annotations

import numpy as np

from knitstudy.crossings.facets import CrossingFacets
from knitstudy.mechanics.contact.friction import OPEN, STICK
from knitstudy.mechanics.contact.interaction import PASS_SHARE, Contact
from knitstudy.mechanics.contact.points import ContactPoints

COLUMNS = {
    "crossing": ((), "1", "nearest crossing of the two yarns, -1 away from all"),
    "side": ((), "1", "0: on the lower row's yarn, 1: on the upper row's"),
    "yarn": ((), "1", "yarn that carries the point"),
    "target": ((), "1", "yarn that it touches"),
    "cell": (("grid",), "1", "its facet: layer along the yarn, place around it"),
    "position": (("xyz",), "m", "current position"),
    "reference": (("xyz",), "m", "undeformed position"),
    "area": ((), "m2", "undeformed area that the point stands for"),
    "normal": (("xyz",), "1", "outward normal of the touched surface"),
    "pressure": ((), "Pa", "contact pressure"),
    "traction": (("xyz",), "Pa", "tangential traction on the yarn that carries the point"),
    "gap": ((), "m", "gap, negative where surfaces penetrate each other"),
    "slip": ((), "m", "length slipped since the point first touched"),
    "sticks": ((), "1", "1 sticks, 0 slips"),
}
"""Dimensions besides `point`, unit and meaning of what is kept."""


def touching_points(contact: Contact, points: ContactPoints, facets: CrossingFacets) -> dict[str, np.ndarray]:
    """Return the columns of all points that touch, in the order of `COLUMNS`.

    Parameters
    ----------
    contact : Contact
    points : ContactPoints
        Of a converged increment, after its history was brought up to date.
    facets : CrossingFacets
    """
    quadrature, history = contact.quadrature, points.history
    active = np.flatnonzero(history.status != OPEN)
    point, target = history.point[active], history.surface[active]
    yarn = quadrature.surface[point]
    crossing, side = facets.nearest(yarn, target, quadrature.xi[point, 0])
    return {
        "crossing": crossing,
        "side": side,
        "yarn": yarn,
        "target": target,
        "cell": quadrature.cell[point],
        "position": points.position[active],
        "reference": contact.reference(point),
        "area": quadrature.area[point],
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
