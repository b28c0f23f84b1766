"""A loose knot of n turns that is pulled tight: its braid, its loop and its tails, with the next terms of sqrt(h / R).

Audoly et al. (2007) have the first terms of a small e = sqrt(h / R). The next ones are not small: the braid of one turn
is 6 e R long, and its tails leave it at an angle of 1.5 e; with friction they are of the order of sqrt(mu e). So here
loop and tails are elastica, and the braid between them (`braid.py`) bends as two rods. What remains is of the order of
e^2. Lengths are over the radius h of the rod, B = 1.
"""

from dataclasses import dataclass

import numpy as np
from braid import braid
from scipy.optimize import brentq, fsolve

ANGLES = np.linspace(0.0, 1.0, 2001)


@dataclass(frozen=True)
class LooseKnot:
    """Equilibrium of a knot while its strands slide."""

    curvature: float  # of the loop where it leaves the braid
    force: float  # F h^2 / B
    shortening: float  # length of the rod less the distance of its ends
    angle: float  # of the tails with the axis where they leave the braid [rad]
    half: float  # half the length of the braid
    parting: float  # curvature of one strand less that of the other where they part


def knot(turns, curvature, friction):
    """Return the knot whose loop leaves the braid with a curvature (times h)."""
    inner, k = braid(turns), curvature

    def state(unknown):
        """Return the errors of angle, force and gap of the loop, and the knot."""
        angle, force, inside = unknown * [1, k**2, k**2]  # `inside`: force in the loop along the axis
        tail = 2 * np.sqrt(abs(force)) * np.sin(angle / 2)  # curvature of the elastica that a tail is
        parting = k + tail
        half = inner.half * np.sqrt(2 / parting)
        # The braid is a beam of both rods: moments of loop and tail bend it, tension straightens it.
        tension = 0.5 * (force + inside)
        rate = np.sqrt(tension + 0j)
        bend = (0.5 * (k - tail) * np.tanh(rate * half) / rate).real
        # Tension presses a helix: k^3 -> k^3 + T k, and makes it longer.
        rubbed = friction * inner.friction * parting**1.5 * (1 + 0.75 * tension * np.sqrt(12) / parting)
        turn = angle + (np.pi - angle) * ANGLES
        way = 1 / np.sqrt(np.maximum(k**2 + 2 * inside * (np.cos(angle) - np.cos(turn)), 1e-6 * k**2))
        across, along = (np.trapezoid(each, turn) for each in (np.cos(turn) * way, way))
        reach = half * (1 - angle**2 / 6)
        tails = 2 / np.sqrt(abs(force)) * (1 - np.cos(angle / 2))
        short = 2 * along + 4 * half - 2 * reach + 2 * tails
        errors = bend - angle, force - rubbed - inside * np.cos(angle) - k**2 / 2, across + reach
        return np.array(errors) / [1, k**2, 1 / k], LooseKnot(k, force, short, angle, half, parting)

    start = [
        inner.half * np.sqrt(k) / 2,
        0.5 + friction * inner.friction / np.sqrt(k),
        -inner.half * np.sqrt(k) / 5,
    ]
    found, _, done, message = fsolve(lambda x: state(x)[0], start, full_output=True)
    if done != 1:
        raise RuntimeError(f"no loose knot of {turns} turns at a curvature of {curvature:g} / h: {message}")
    return state(found)[1]


def shortened(turns, shortening, friction):
    """Return the knot of a shortening (over h)."""
    loop = 2 * np.pi / shortening
    return knot(
        turns, brentq(lambda k: knot(turns, k, friction).shortening - shortening, loop, 3 * loop), friction
    )
