"""Grids of surface nodes without solids inside: straight tubes."""

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
