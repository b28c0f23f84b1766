"""What direct simulations are made of, and how finely."""

from __future__ import annotations

from knitstudy.study.scene import Scene

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
