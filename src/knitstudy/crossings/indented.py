"""Area and pressure where the local indentation is a law of contact: Hertz's, from the force at the crossing.

The points that touch there lie on the depth that the law stands for, which is not the area of contact.
"""

from __future__ import annotations

import numpy as np

from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.contact.hertz import Crossing

MODULUS = "indentation_modulus"
"""Attribute of the histories that this is for: E* of the yarns [Pa]."""

SMALLEST = np.radians(5.0)
"""Angle below which yarns count as crossing at it: side by side they touch along a line, which has no end."""


def indented(knit: Knit, force: np.ndarray, modulus: float) -> dict[str, np.ndarray]:
    """Return area of contact [m2] and largest pressure [Pa] (I, K) under normal forces (I, K, 3) [N].

    The angle between the yarns is the undeformed one.
    """
    crossings, radius = knit.crossings, knit.radius
    load = np.linalg.norm(force, axis=-1)
    tangents = np.empty(crossings.point.shape)
    for number, curve in enumerate(knit.centrelines):
        here = crossings.yarn == number
        tangents[here] = curve.tangent(crossings.arc_length[here])
    tangents /= np.linalg.norm(tangents, axis=-1, keepdims=True)
    angle = np.arccos(np.clip(np.abs(np.einsum("ki,ki->k", *tangents.swapaxes(0, 1))), 0.0, 1.0))
    kinds = [Crossing.at(max(float(each), SMALLEST)) for each in angle]
    semiaxis = (
        np.array([kind.semiaxis for kind in kinds]) * radius * (load / (modulus * radius**2)) ** (1 / 3)
    )
    area = np.pi * np.array([kind.ratio for kind in kinds]) * semiaxis**2
    pressure = np.divide(1.5 * load, area, out=np.zeros_like(area), where=area > 0)
    return {"contact_area": area, "largest_pressure": pressure}
