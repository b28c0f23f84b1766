"""Contact between the yarns of a specimen: smooth tubes of the true radius."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.contact.indentation import Indentation, indentation
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.solids.discretisation import Discretisation
from knitstudy.study.scene import Scene

MARGIN = 0.3
"""Distance up to which pairs of points and surfaces are followed, over the yarn's radius."""


def yarn_contact(scene: Scene, yarns: Discretisation, nodes: np.ndarray, pieces: np.ndarray) -> Contact:
    """Return the contact of all yarns of a scene with each other and with themselves.

    Pieces of yarn that are tied to each other do not touch: what the tie does would be done twice there.

    Parameters
    ----------
    scene : Scene
    yarns : Discretisation
    nodes : ndarray, shape (N, 3)
        Undeformed nodes, adjusted to the ties [m].
    pieces : ndarray of int, shape (R,)
        What every ring is tied in; see `tied_crossings.tied_pieces`.

    Raises
    ------
    MeshError
        If yarns overlap before anything moves.
    """
    return Contact(
        nodes,
        yarns.surfaces,
        contact_law(scene, yarns),
        pieces=pieces,
        points=scene.contact.points,
        margin=MARGIN * yarns.mesh.radius,
        overlap=scene.contact.penetration * yarns.size,
    )


def contact_law(scene: Scene, yarns: Discretisation) -> Coulomb | Indentation:
    """Return the law of a scene.

    Of solid yarns without hexahedra it can be what their space does not show of the local indentation.
    """
    if scene.value("contact.law") == "indentation":
        return indentation(
            scene.mesh.crossing_degree,
            scene.mesh.crossing_span,
            scene.mesh.spline_degree,
            modulus=scene.yarn.youngs_modulus,
            poisson=scene.yarn.poisson_ratio,
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
