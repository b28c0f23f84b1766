"""A uniform pressure through contact: a ring pressed into another one."""

import numpy as np
import pytest
from contact_bodies import Body, back, crossed_yarns, drive, law, reaction, together
from hexahedral_block import unknowns

from knitstudy.mechanics.contact.grids import Grid
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear.direct import LU
from knitstudy.mechanics.newton import trace

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


def test_patch_where_the_facets_are_turned(verify):
    """By half a facet: the pressure becomes uniform with the third power of the facet size."""
    errors = [spread(pressures(count, count, np.pi / count, points=3)) for count in (24, 48)]
    rate = np.log2(errors[0] / errors[1])
    verify.at_most(
        "contact patch, rings of 48 facets turned by half of one: spread of the pressure", errors[1], 0.02
    )
    verify.at_least("contact patch, rings turned by half a facet: order", rate, 2.5, "3")


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


# A yarn dragged across the facets of another one: what the grid adds to a force that should be constant


@pytest.mark.parametrize(
    ("lower", "friction", "bar", "slow"),
    [
        ("rigid", 0.0, 0.02, False),
        ("rigid", 0.3, 0.02, True),
        # A node or the middle of an element below the contact: the elastic yarn itself is not equally stiff.
        ("elastic", 0.0, 0.03, True),
        ("elastic", 0.3, 0.035, True),
    ],
)
def test_ironing(lower, friction, bar, slow, full, verify):
    """Two yarns pressed by 5% of the diameter; the upper one is moved along the lower one over four facets or more.

    They are 8 elements across at full resolution, otherwise 5. With friction the force is judged from where the whole
    contact slides.
    """
    if slow and not full:
        pytest.skip("takes --full")
    core, rings, slide, increments = (4, 2, 1.2, 20) if full else (3, 1, 1.6, 12)
    size = 2 / (core + 2 * rings)
    bodies = crossed_yarns(core, rings, length=5.0)
    model, first = together(bodies, law(size, friction), size=size)
    up = np.array([0, 0, 1.0])
    held = np.arange(first[1]) if lower == "rigid" else back(bodies[0], -up)
    driven = back(bodies[1], up) + first[1]
    settings = Settings(increments=2 * increments, growth=1.0)
    motion = drive(held, driven, [[0, 0, -0.1], [slide, 0, -0.1]])
    begin = 0.7 if friction else 0.5
    force = [reaction(each, driven) for each in trace(model, motion, settings, LU()) if each.load >= begin]
    tangential, _, normal = np.transpose(force)
    case = f"ironing, lower yarn {lower}, mu = {friction}: ripple of the"
    verify.at_most(f"{case} normal force", abs(np.ptp(normal) / normal.mean()), bar)
    mean = tangential.mean() if friction else normal.mean()
    verify.at_most(f"{case} tangential force", abs(np.ptp(tangential) / mean), bar)
