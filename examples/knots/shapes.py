"""Curves of the book of knots as points at the nodes of rods."""

import numpy as np


def resampled(curve, spacing):
    """Return points (m, 3) of a fine curve (n, 3); `spacing` takes arc lengths (n,) to distances between nodes (n,)."""
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1)))
    density = 1 / spacing(s)
    number = np.append(0.0, np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(s)))
    at = np.interp(np.linspace(0, number[-1], round(number[-1]) + 1), number, s)
    return np.column_stack([np.interp(at, s, x) for x in curve.T])


def evenly(curve, count):
    """Return the nodes of `count` elements of one length along a fine curve (n, 3)."""
    length = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
    return resampled(curve, lambda s: length / count + 0 * s)


def straight(length, count):
    """Return the nodes of a straight rod along x of `count` elements."""
    return np.column_stack([np.linspace(0, length, count + 1), np.zeros((count + 1, 2))])


def knot(radius, turns=1, rod=1.0, tail=8.0, size=1.0, clear=1.1):
    """Return the nodes of an open knot of so many turns, and the number of the middle of its loop.

    Two strands wind around each other along a part of a circle of `radius`, by 2 `turns` + 1 half turns with a gap
    between them; the rest of the circle joins them, and tails of `tail` radii leave along tangents and become straight.
    Elements are `size` radii of the rod long where strands may touch, and a sixteenth of `radius` elsewhere.
    """
    half = min(3.5 * turns**1.75 * np.sqrt(rod / radius), 1.3)  # angle of half of the braid
    u = np.linspace(0.0, 1.0, 4001)
    turn = (2 * turns + 1) * np.pi * (u - np.sin(2 * np.pi * u) / (2 * np.pi)) - 0.5 * np.pi

    def at(angle, inward, aside):
        """Return points at angles (n,) from the bottom of the circle."""
        r = radius - inward
        return np.column_stack([r * np.sin(angle), radius - r * np.cos(angle), aside + 0 * angle])

    out, back = (
        at((2 * u - 1) * half, off * np.sin(turn), off * np.cos(turn)) for off in (clear * rod, -clear * rod)
    )
    loop = at(np.linspace(half, 2 * np.pi - half, 4001)[1:-1], clear * rod, 0.0)
    along = np.linspace(0, tail * radius, 8001)
    angle = half * np.exp(-0.5 * (along[1:] + along[:-1]) / radius)  # as a rod under tension does
    right = back[-1] + np.cumsum(
        np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) * along[1], axis=0
    )
    curve = np.concatenate([right[::-1] * [-1, 1, 1], out, loop, back, right])
    step = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1)))
    middles = np.array([0, step[-1]]) + np.array([1, -1]) * (tail + half) * radius
    reach = half * radius + 3 * np.sqrt(rod * radius)

    def spacing(s):
        beyond = np.abs(s[:, None] - middles).min(axis=1) - reach
        return np.clip(size * rod + 0.15 * beyond, size * rod, radius / 16)

    nodes = resampled(curve, spacing)
    return nodes, len(nodes) // 2
