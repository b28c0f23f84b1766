"""Stress in yarns of polynomials, in the cells between the sections that are drawn, by quadrature in each."""

from __future__ import annotations

import numpy as np

from knitstudy.errors import DataFileError
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.cauchy import cauchy_stress
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.polynomial_yarn.sections import deformation_gradient, sections
from knitstudy.mechanics.polynomial_yarn.space import YarnSpace
from knitstudy.mesh.section import Section
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.cell_stress import CellStress
from knitstudy.solids.polynomial_yarns import space_on, undeformed
from knitstudy.solids.yarn_spans import yarn_spans
from knitstudy.study.scene import Scene

GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3)
"""Places on (-1, 1) of two points, each of weight 1."""

LAYERS = 100
"""Layers of cells evaluated at once; bounds the memory of their derivatives."""


def cell_stress(
    scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair, displacement: np.ndarray
) -> CellStress:
    """Return the stress in every cell from the coefficients (N, 3) of the displacement [m].

    Raises
    ------
    DataFileError
        If the displacement is of another discretisation.
    """
    space = space_on(scene, yarn_spans(scene, specimen))
    nodes = undeformed(space, specimen)
    if displacement.shape != nodes.shape:
        raise DataFileError(
            f"node_displacement has the shape {displacement.shape}, but the yarns of scene {scene.name!r} have "
            f"{len(nodes)} coefficients: run the scene again"
        )
    yarn = scene.yarn
    material = Material(yarn.material, yarn.youngs_modulus, yarn.poisson_ratio)
    parts = []
    for number, (own, stations) in enumerate(zip(space.yarns, mesh.stations, strict=True)):
        here = slice(*space.first_node[number : number + 2].tolist())
        for low in range(0, len(stations) - 1, LAYERS):
            breaks = stations[low : low + LAYERS + 1]
            parts.append(_layers(own, nodes[here], displacement[here], breaks, mesh.section, material))
    return CellStress(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _layers(
    yarn: YarnSpace,
    nodes: np.ndarray,
    displacement: np.ndarray,
    breaks: np.ndarray,
    section: Section,
    material: Material,
) -> tuple[np.ndarray, ...]:
    """Return integral (k e, 3, 3), volume (k e,), middle and deformed middle (k e, 3) of the cells of k layers."""
    x, area = _section_points(section)
    rise = np.diff(breaks)
    s = (breaks[:-1, None] + 0.5 * rise[:, None] * (1 + GAUSS)).ravel()
    place, slope = sections(yarn, nodes, s, x)
    moved, change = sections(yarn, displacement, s, x)
    gradient = deformation_gradient(slope, change)
    weight = np.repeat(0.5 * rise, len(GAUSS))[:, None] * area * np.linalg.det(slope)
    after = weight * np.linalg.det(gradient)
    stress = cauchy_stress(gradient.reshape(-1, 3, 3), material).reshape(gradient.shape)

    def summed(values: np.ndarray) -> np.ndarray:
        """Sum over the points of every cell: two along, four across."""
        each = values.reshape(len(rise), len(GAUSS), len(section.quads), len(GAUSS) ** 2, *values.shape[2:])
        return each.sum(axis=(1, 3)).reshape(-1, *values.shape[2:])

    before, volume = summed(weight), summed(after)
    middle = summed(weight[..., None] * place) / before[:, None]
    now = summed(after[..., None] * (place + moved)) / volume[:, None]
    return summed(after[..., None, None] * stress), volume, middle, now


def _section_points(section: Section) -> tuple[np.ndarray, np.ndarray]:
    """Return four points (4 e, 2) in every quad of a section, quad by quad, and their areas (4 e,), over the radius."""
    u, v = (each.ravel() for each in np.meshgrid(GAUSS, GAUSS, indexing="ij"))
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    one, other = 1 + signs[:, :1] * u, 1 + signs[:, 1:] * v  # (4 corners, 4 points)
    corner = section.points[section.quads]  # (e, 4, 2)
    by_u, by_v = (
        np.einsum("eni,np->epi", corner, slope)
        for slope in (0.25 * signs[:, :1] * other, 0.25 * one * signs[:, 1:])
    )
    area = by_u[..., 0] * by_v[..., 1] - by_u[..., 1] * by_v[..., 0]
    return np.einsum("eni,np->epi", corner, 0.25 * one * other).reshape(-1, 2), area.ravel()
