"""Grids of surface nodes without solids inside: tubes, straight or bent."""

import numpy as np

from knitstudy.mechanics.contact.grids import Grid


def tube(slices=13, angles=12, *, radius=1.0, length=6.0, axis=0, middle=(0.0, 0.0, 0.0), first=0):
    """Nodes (slices angles, 3) of a straight tube along x or y, and its grid; nodes count from `first`."""
    along, side = np.eye(3)[axis], np.eye(3)[1 - axis]
    if axis == 0:
        d1, d2 = side, np.eye(3)[2]
    else:
        d1, d2 = np.eye(3)[2], side
    s = np.linspace(-0.5 * length, 0.5 * length, slices)
    theta = 2 * np.pi * np.arange(angles) / angles
    ring = radius * (np.cos(theta)[:, None] * d1 + np.sin(theta)[:, None] * d2)
    nodes = np.asarray(middle) + s[:, None, None] * along + ring
    return nodes.reshape(-1, 3), Grid(first + np.arange(slices * angles).reshape(slices, angles))


def crossing(gap, **options):
    """Nodes and grids of two tubes that cross at right angles, `gap` apart, and the mask of the upper one's nodes."""
    lower, grid = tube(**options)
    upper, other = tube(axis=1, middle=(0.1, 0.07, 2 + gap), first=len(lower), **options)
    return np.concatenate([lower, upper]), [grid, other], np.arange(len(lower) + len(upper)) >= len(lower)


def hairpin(apart, *, radius=1.0, leg=8.0, slices=40, angles=12):
    """Nodes and grid of a tube bent to a U whose legs' axes are `apart`, in the plane z = 0."""
    bend = 0.5 * np.pi * apart
    s = np.linspace(0, 2 * leg + bend, slices)
    phi = np.clip((s - leg) / (0.5 * apart), 0, np.pi)
    tangent = np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)
    normal = np.stack([-np.sin(phi), np.cos(phi), 0 * phi], axis=1)
    centre = np.array([0, 0.5 * apart, 0]) - 0.5 * apart * normal
    centre += (np.minimum(s - leg, 0) + np.maximum(s - leg - bend, 0))[:, None] * tangent
    theta = 2 * np.pi * np.arange(angles) / angles
    ring = np.cos(theta)[:, None] * normal[:, None] + np.sin(theta)[:, None] * [0, 0, 1.0]
    return (centre[:, None] + radius * ring).reshape(-1, 3), Grid(
        np.arange(slices * angles).reshape(slices, angles)
    )
