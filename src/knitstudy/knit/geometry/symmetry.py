"""Symmetries of a knit, and the motions of its control points that keep them.

A plain loop is its own mirror image about the plane through head and sinker (x = w/2). Where head and sinker have the
same shape, a half turn about the z axis through the middle of a leg maps the yarn onto itself too. Other repeats have
some of these, and may become themselves by a shift, or seen from behind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.loop import Loop
from knitstudy.knit.geometry.stitches import PLAIN
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints

SYMMETRY_TOLERANCE = 1e-9  # distance over the wale spacing by which an image may miss its point
SAME_PLACE = 1e-3  # Bezier segments within which two places on a yarn are one


@dataclass(frozen=True, eq=False)
class Symmetry:
    """A motion of space that maps a knit onto itself, as a map of rows and parameters."""

    sign: Ints  # (3,) of the components: 1 or -1
    by: int  # parameter u of a row goes to sign[0] u + by,
    up: int  # row i to sign[1] i + up
    rows: int
    period: int  # control points of a row in one period

    def action(self, count: int) -> Floats:
        """Return the matrix (3 P, 3 P) that maps displacements of control points."""
        row, u = np.divmod(np.arange(count), self.period)
        image = self.row(row) % self.rows * self.period + (self.sign[0] * u + self.by) % self.period
        return np.asarray(np.kron(np.eye(count)[:, image], np.diag(self.sign.astype(float))), dtype=float)

    def row(self, row: Ints) -> Ints:
        """Return the images of rows."""
        return self.sign[1] * row + self.up

    def pairs(self, row: Ints, u: Floats) -> tuple[Ints, Floats]:
        """Return the images of pairs of places, rows (n, 2) and parameters (n, 2), alike for a pair and its shifts.

        The first place lies in the first repeat, on the lower row, or to the left if both lie on one row.
        """
        row = self.row(row)
        u = self.sign[0] * u + self.by
        swap = (row[:, 0] > row[:, 1]) | ((row[:, 0] == row[:, 1]) & (u[:, 0] > u[:, 1]))
        row, u = (np.where(swap[:, None], pair[:, ::-1], pair) for pair in (row, u))
        row = row - self.rows * (row[:, :1] // self.rows)
        return row, u - self.period * np.floor((u[:, :1] + SAME_PLACE) / self.period)


def symmetries(loop: Loop) -> list[Symmetry]:
    """Return all symmetries of the loops of a repeat, the identity among them.

    The first control point of every loop is a sinker's centre.
    Raises GeometryError when the loop of a plain knit is not its own mirror image.
    """
    points, wale = loop.control_points, loop.wale_spacing
    count = len(points) // (loop.rows * loop.columns)
    period = count * loop.columns
    row, k = np.divmod(np.arange(len(points)), period)
    half = count // 2 if count % 4 == 0 else count  # without a point in the middle of a leg nothing is turned
    group = []
    misses = {}
    for *sign, by, up in product((1, -1), (1, -1), (1, -1), range(0, period, half), range(loop.rows)):
        if (sign[1] < 0) != (by % count > 0):
            continue  # heads become sinkers where the knit is turned upside down, and only there
        symmetry = Symmetry(np.array(sign), by, up, loop.rows, period)
        over_rows, i = np.divmod(symmetry.row(row), loop.rows)
        over, image = np.divmod(sign[0] * k + by, period)
        there = points[i * period + image] + over[:, None] * loop.advance
        apart = there + (over_rows * loop.rows)[:, None] * loop.rise - points * sign
        misses[(*sign, by, up)] = miss = np.abs(apart - apart[0]).max()
        if miss <= SYMMETRY_TOLERANCE * wale:
            group.append(symmetry)
    mirrored = misses[-1, 1, 1, 0, 0]
    if loop.stitches == PLAIN and (count % 2 or mirrored > SYMMETRY_TOLERANCE * wale):
        raise GeometryError(
            f"pattern.control_points: {count} points that miss their mirror images about the loop's middle "
            f"by {mirrored / wale:.2e} wale spacings: allowed is an even number of points, mirrored within "
            f"{SYMMETRY_TOLERANCE:g}, the first one at the sinker's centre"
        )
    return group


def first_of_orbits(group: Sequence[Symmetry], row: Ints, u: Floats) -> Bools:
    """Return which pairs of places, rows (n, 2) and parameters (n, 2), are no image of an earlier pair: (n,)."""
    here = group[0].pairs(row, u)
    same = np.zeros((len(u), len(u)), dtype=bool)
    for symmetry in group:
        rows, places = symmetry.pairs(row, u)
        alike = (rows[:, None] == here[0]).all(axis=-1)
        same |= alike & (np.abs(places[:, None] - here[1]).max(axis=-1) < SAME_PLACE)
    return np.asarray(~np.tril(same | same.T, -1).any(axis=1))


def symmetric_motions(free: Bools, group: Sequence[Symmetry]) -> Floats:
    """Return a basis (P, 3, n) of the displacements of free components (P, 3) that keep all symmetries.

    The parameter of a displacement field is the displacement of one component of one point.
    Raises GeometryError when nothing may move, or a component is free and its image is not.
    """
    count = len(free)
    average = np.add.reduce([symmetry.action(count) for symmetry in group]) / len(group)
    moved = (np.abs(average) > 0).any(axis=1)
    reach = average[~free.ravel()][:, free.ravel()]
    if np.abs(reach).any():
        point = int(np.flatnonzero(~free.ravel())[np.abs(reach).any(axis=1)][0] // 3)
        raise GeometryError(
            f"geometry.free: control point {point} is held, its image by a symmetry of the loop is free: "
            "allowed is both or none"
        )
    columns = average[:, free.ravel() & moved]
    peak = np.abs(columns).max(axis=0)
    columns = columns[:, peak > 0] / peak[peak > 0]
    # Points of one orbit give the same field up to its sign: keep the first.
    leading = np.take_along_axis(columns, (columns != 0).argmax(axis=0)[None], axis=0)
    fields = np.unique(columns * np.sign(leading), axis=1)
    if fields.shape[1] == 0:
        raise GeometryError(
            "geometry.free lists no component that may move: name at least one of x, y, z of a point"
        )
    return fields.reshape(count, 3, -1)
