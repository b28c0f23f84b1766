"""What is simulated and by which discretisation: names, solids and their resolution, digests of physical problems."""

from __future__ import annotations

from math import inf
from typing import Any

from knitstudy.study.scene import Scene, digest

# ---- What models and interactions are called in figures and tables


NAMES = {"dns": "DNS", "rom3d": "3D ROM", "rom2d": "2D ROM", "beam": "beams", "window": "window"}
"""What models are called in figures and tables, by fidelity."""

INTERACTIONS = {"tie": "tie constraint", "rough": "rough contact", "isotropic": "isotropic friction"}
"""What interactions are called in figures and tables."""


# ---- What direct simulations are made of, and how finely


HEXAHEDRA = {
    "one_point": "one-point hexahedra",
    "quadratic": "quadratic hexahedra",
}
"""By ``mesh.element``; an element from outside goes by its own name."""

SOLID_YARNS = "solid yarns"


def is_direct(scene: Scene) -> bool:
    """Whether a scene is a direct simulation: of solids, whatever they are made of."""
    return scene.kind.stage == "dns"


def is_cut(scene: Scene) -> bool:
    """Whether a scene is one of cells that are cut out of a knit: of solids, too, but of another specimen."""
    return scene.kind.stage == "cut_knit"


def discretisation(scene: Scene) -> str:
    """Return what the yarns of a direct simulation are made of."""
    element = scene.value("mesh.element")
    return SOLID_YARNS if element is None else HEXAHEDRA.get(element, element)


def resolution(scene: Scene) -> float:
    """Return the element size [m], or the degree of polynomials near crossings, of a direct simulation."""
    degree = scene.value("mesh.crossing_degree")
    return scene.mesh.size if degree is None else degree


def finer(scene: Scene, other: Scene) -> bool:
    """Whether a direct simulation resolves more than another one of its kind: smaller elements, higher degrees."""
    if scene.value("mesh.crossing_degree") is not None:
        return resolution(scene) > resolution(other)
    return resolution(scene) < resolution(other)


def made_of(scene: Scene) -> str:
    """Return both, in words."""
    if scene.value("mesh.crossing_degree") is None:
        finer = scene.value("mesh.refinement") or 1
        near = f", {finer:g} times finer at crossings" if finer != 1 else ""
        return f"{discretisation(scene)} of {1e3 * scene.mesh.size:.2f} mm{near}"
    near, far = scene.mesh.crossing_degree, scene.mesh.degree
    return f"{SOLID_YARNS} of degree {near}" + (f", {far} on legs" if far != near else "")


# ---- What a simulation is of, whatever it is computed with: specimen, yarn, load and how yarns act on each other


HOW_FAR = "load.strain"
"""Simulations of one problem may be pulled to different strains: their results are compared at the same strain."""

EXTENT = ("pattern.loops", "pattern.rows")


def physics_of(scene: Scene) -> dict[str, Any]:
    """Return what is simulated: the values of all keys whose role is physics, but for how far the scene is pulled."""
    labels = {"specimen": scene.specimen, "interaction": scene.interaction}
    return labels | {key: value for key, value in scene.values_of("physics").items() if key != HOW_FAR}


def problem_of(scene: Scene) -> str:
    """Return a digest that scenes of one physical problem share, and no others."""
    return digest(physics_of(scene))


def sticks(scene: Scene) -> bool:
    """Whether yarns touch, and do not slip where they do."""
    interaction = scene.kind.interaction
    return interaction.touches and interaction.friction(scene) == inf


def tied_problem_of(scene: Scene) -> str:
    """Return the digest (`problem_of`) of the same knit under the same load with yarns that are all tied."""
    return digest(_without_contact(scene) | {"interaction": "tie"})


def loops_of(scene: Scene) -> str:
    """Return a digest that scenes of the same loops under the same load share, however many of them there are."""
    keys = _without_contact(scene)
    return digest({key: value for key, value in keys.items() if key not in ("interaction", *EXTENT)})


def _without_contact(scene: Scene) -> dict[str, Any]:
    return {key: value for key, value in physics_of(scene).items() if not key.startswith("contact.")}
