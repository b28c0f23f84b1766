"""Names of models and interactions, discretisations of direct simulations, and digests of physical problems."""

from __future__ import annotations

from typing import Any

from knitstudy.knit.scene.scene import Scene, digest

# Interactions in figures and tables.
INTERACTIONS = {"tie": "tie constraint", "rough": "rough contact", "isotropic": "isotropic friction"}
# By ``mesh.element``; elements of plugins go by their own names.
HEXAHEDRA = {"one_point": "one-point hexahedra", "quadratic": "quadratic hexahedra"}

SOLID_YARNS = "solid yarns"


def is_direct(scene: Scene) -> bool:
    """Whether a scene is a direct simulation, that is, of solids."""
    return scene.kind.direct


def discretisation(scene: Scene) -> str:
    """Return the discretisation of a direct simulation in words, without its resolution."""
    element = scene.value("mesh.element")
    return SOLID_YARNS if element is None else HEXAHEDRA.get(element, element)


def resolution(scene: Scene) -> float:
    """Return the element size in yarn radii, or the degree of polynomials near crossings, of a direct simulation."""
    degree = scene.value("mesh.crossing_degree")
    return scene.mesh.size if degree is None else degree


def made_of(scene: Scene) -> str:
    """Return discretisation and resolution in words."""
    if scene.value("mesh.crossing_degree") is None:
        times = scene.value("mesh.refinement") or 1
        near = f", {times:g} times finer at crossings" if times != 1 else ""
        return f"{discretisation(scene)} of {1e3 * scene.metres('mesh.size'):.2f} mm{near}"
    near, far = scene.mesh.crossing_degree, scene.mesh.degree
    return f"{SOLID_YARNS} of degree {near}" + (f", {far} on legs" if far != near else "")


# Simulations of one problem may be pulled to different strains: their results are compared at the same
# strain.
HOW_FAR = "load.strain"


def physics_of(scene: Scene) -> dict[str, Any]:
    """Return the physical problem: the values of all keys whose role is physics, but for the largest strain."""
    labels = {"specimen": scene.specimen, "interaction": scene.interaction}
    return labels | {key: value for key, value in scene.values_of("physics").items() if key != HOW_FAR}


def problem_of(scene: Scene) -> str:
    """Return a digest of the physical problem of a scene, the same for all models and discretisations."""
    return digest(physics_of(scene))
