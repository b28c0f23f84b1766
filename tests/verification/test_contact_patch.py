"""A uniform pressure through contact: a ring pressed into another one."""

import numpy as np
from contact_bodies import Body, law, together
from hexahedral_block import unknowns

from knitstudy.mechanics.contact.grids import Grid
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.load_path import trace

EXACT = Settings(increments=1, residual_tolerance=1e-11, correction_tolerance=1e-9)
INNER, OUTER, SHRINK = 0.7, 1.4, 0.01
"""Radii of the pair of rings, which touch at 1, and what both are moved by towards each other."""


def ring(angles, radii, *, outward):
    """One layer of elements around z, of height 0.5, whose surface is its outer or its inner one.

    In axial direction the surface is linear, as the elements are: with more layers, the ends of a smooth open grid
    take less of a uniform pressure than the elements there do.
    """
    z, theta, r = np.meshgrid([0, 0.5], angles, radii, indexing="ij")
    number = np.arange(z.size).reshape(z.shape)
    ahead = np.roll(number, -1, axis=1)
    quads = [number[..., 0], number[..., 1], ahead[..., 1], ahead[..., 0]]
    hexahedra = np.stack([quad[0] for quad in quads] + [quad[1] for quad in quads], axis=1)
    nodes = np.stack([r * np.cos(theta), r * np.sin(theta), z], axis=-1).reshape(-1, 3)
    surface = number[..., 1] if outward else number[:, ::-1, 0]
    return Body(nodes, hexahedra, Grid(np.ascontiguousarray(surface)))


def pressures(inner, outer, turn, points):
    """Pressures at all points of two rings with so many facets, turned against each other by an angle [rad]."""
    angles = [2 * np.pi * np.arange(inner) / inner, turn + 2 * np.pi * np.arange(outer) / outer]
    bodies = [ring(angles[0], (INNER, 1.0), outward=True), ring(angles[1], (1.0, OUTER), outward=False)]
    size = 2 * np.pi / max(inner, outer)
    model, _ = together(bodies, law(size), size=size, points=points, overlap=1e-2)
    nodes = model.nodes
    radius = np.hypot(nodes[:, 0], nodes[:, 1])
    moved = np.flatnonzero((radius < INNER + 1e-9) | (radius > OUTER - 1e-9))
    way = nodes[moved] * [1, 1, 0] * (SHRINK * np.where(radius[moved] < 1, 1, -1) / radius[moved])[:, None]
    flat = unknowns(np.setdiff1d(np.arange(len(nodes)), moved))[2::3]
    motion = PrescribedDisplacement(
        np.concatenate([unknowns(moved), flat]), np.concatenate([way.ravel(), np.zeros(len(flat))])
    )
    *_, end = trace(model, motion, EXACT, LU())
    answer = model.contact_points(end.state)
    assert len(answer.active) == len(model.contact.quadrature.area)
    return answer.pressure


def spread(pressure):
    return np.ptp(pressure) / pressure.mean()


def test_patch_where_the_facets_match(verify):
    """Two Gauss points a side lie at one height over the facet, and carry the same."""
    error = spread(pressures(48, 48, 0.0, points=2))
    verify.at_most("contact patch, matching rings of 48 facets: spread of the pressure", error, 1e-10)


def test_patch_where_the_facets_differ(full, verify):
    """48 facets on 64: what is left falls with the number of Gauss points."""
    bars = {2: 0.04, 3: 0.025, 4: 0.015} if full else {2: 0.04, 3: 0.025}
    errors = {points: spread(pressures(48, 64, 0.1, points)) for points in bars}
    assert sorted(errors.values(), reverse=True) == list(errors.values())
    for points, bar in bars.items():
        case = (
            f"contact patch, rings of 48 on 64 facets, {points} Gauss points a side: spread of the pressure"
        )
        verify.at_most(case, errors[points], bar)
