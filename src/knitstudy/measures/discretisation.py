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


PHYSICS = (
    "yarn.youngs_modulus",
    "yarn.poisson_ratio",
    "yarn.material",
    "yarn.transverse_modulus",
    "yarn.transverse_poisson_ratio",
    "yarn.axial_shear_modulus",
    "load.direction",
    "load.lateral",
    "contact.friction",
    "contact.tied_edges",
    "tie.radius",
)
"""Keys that say what is simulated, beside the geometry: not how finely, how far, or by which rule ties are made."""


UNIT = (
    "yarn.youngs_modulus",
    "yarn.poisson_ratio",
    "yarn.material",
    "yarn.transverse_modulus",
    "yarn.transverse_poisson_ratio",
    "yarn.axial_shear_modulus",
    "load.direction",
    "load.lateral",
    "tie.radius",
)
"""Those of them that knits of the same loops share, of whatever size and however their yarns act on each other."""

EXTENT = ("pattern.loops", "pattern.rows")


def problem_of(scene: Scene) -> str:
    """Return a digest that scenes of one physical problem share, and no others."""
    keys: dict[str, Any] = {key: scene.value(key) for key in PHYSICS}
    return digest({"interaction": scene.interaction} | scene.geometry_inputs | keys)


def sticks(scene: Scene) -> bool:
    """Whether yarns touch, and do not slip where they do."""
    interaction = scene.kind.interaction
    return interaction.touches and interaction.friction(scene) == inf


def tied_problem_of(scene: Scene) -> str:
    """Return the digest (`problem_of`) of the same knit under the same load with yarns that are all tied."""
    keys = {key: None if key.startswith("contact.") else scene.value(key) for key in PHYSICS}
    return digest({"interaction": "tie"} | scene.geometry_inputs | keys)


def loops_of(scene: Scene) -> str:
    """Return a digest that scenes of the same loops under the same load share, however many of them there are."""
    keys: dict[str, Any] = {key: scene.value(key) for key in UNIT}
    return digest(keys | {key: value for key, value in scene.geometry_inputs.items() if key not in EXTENT})
