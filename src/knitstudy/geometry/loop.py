"""One loop of a plain knit, and the motions of its control points that keep its symmetries.

A loop is its own mirror image about the plane through head and sinker (x = w/2). Where head and sinker have the same
shape, a half turn about the z axis through the middle of a leg maps the yarn onto itself too.
"""

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.geometry.spline import CatmullRom


@dataclass(frozen=True)
class Loop:
    """Control points of one loop and the spacings at which it is repeated.

    Raises GeometryError when a length is not positive, rows or loops stand closer than a diameter, or the clearance is
    negative.
    """

    control_points: np.ndarray  # (P, 3) from the sinker's centre, x = 0, to the one before the next's. [m]
    wale_spacing: float  # distance w of neighbouring loops along x. [m]
    course_spacing: float  # distance c of neighbouring rows along y. [m]
    radius: float  # R of the yarn. [m]
    clearance: float = 0.0  # gap c0 between yarns at the crossings that the optimisation aims at, in radii

    def __post_init__(self):
        object.__setattr__(self, "control_points", np.array(self.control_points, dtype=float))
        self.control_points.setflags(write=False)
        diameter = 2 * self.radius
        wider = f"more than yarn.diameter = {diameter} m"
        for name, value, fits, allowed in (
            ("yarn.diameter", f"{diameter} m", self.radius > 0, "a positive number"),
            ("pattern.clearance", f"{self.clearance} radii", self.clearance >= 0, "zero or more"),
            ("pattern.wale_spacing", f"{self.wale_spacing} m", self.wale_spacing > diameter, wider),
            ("pattern.course_spacing", f"{self.course_spacing} m", self.course_spacing > diameter, wider),
        ):
            if not fits:
                raise GeometryError(f"{name} = {value}: allowed is {allowed}")
        _ = self.curve  # the control points are checked where they become a curve

    @property
    def curve(self):
        """Centreline of one loop as a periodic curve. [m]"""
        return CatmullRom(self.control_points, [self.wale_spacing, 0.0, 0.0])

    @property
    def rise(self):
        """Vector from a row to the next one: (3,), m."""
        return np.array([0.0, self.course_spacing, 0.0])

    @property
    def target(self):
        """Distance 2R + c0 of two centrelines at a crossing. [m]"""
        return (2 + self.clearance) * self.radius

    @property
    def length(self):
        """Arc length of yarn in a loop. [m]"""
        return float(self.curve.segment_lengths().sum())

    def in_radii(self):
        """The same loop with the radius as unit of length."""
        factor = 1 / self.radius
        spacings = self.wale_spacing * factor, self.course_spacing * factor
        return Loop(self.control_points * factor, *spacings, 1.0, self.clearance)


def whole_loop(quarter, wale_spacing):
    """All control points (4 k, 3) of a loop from those of a quarter (k + 1, 3): sinker to middle of the leg."""
    turned = [wale_spacing / 2, 0, 0] + quarter[-2::-1] * [-1, -1, 1]
    half = np.vstack([quarter, turned])
    mirrored = [wale_spacing, 0, 0] + half[-2:0:-1] * [-1, 1, 1]
    return np.vstack([half, mirrored])


# ---- Symmetries

SYMMETRY_TOLERANCE = 1e-9  # distance over the wale spacing by which an image may miss its point


def symmetries(curve):
    """Symmetries of a loop, the mirror and the half turn if the loop has it: matrices (3 P, 3 P) on displacements.

    Parameters
    ----------
    curve : CatmullRom
        Its first control point is the sinker's centre; its advance is (w, 0, 0).

    Raises
    ------
    GeometryError
        When the loop is not its own mirror image.
    """
    count, wale = curve.period, curve.advance[0]
    k = np.arange(count)
    points = curve.control_points
    mirrored = curve.points(count - k) * [-1, 1, 1] + [wale + 2 * points[0, 0], 0, 0]
    miss = np.abs(mirrored - points).max()
    if count % 2 or miss > SYMMETRY_TOLERANCE * wale:
        raise GeometryError(
            f"pattern.control_points: {count} points that miss their mirror images about the loop's middle "
            f"by {miss / wale:.2e} wale spacings: allowed is an even number of points, mirrored within "
            f"{SYMMETRY_TOLERANCE:g}, the first one at the sinker's centre"
        )

    def action(image, sign):
        """Control point k goes to image[k], its displacement is multiplied by the sign."""
        return np.kron(np.eye(count)[:, image % count], np.diag(sign))

    found = [action(count - k, [-1.0, 1.0, 1.0])]
    if count % 4 == 0:
        centre = 2 * points[count // 4]
        turned = centre * [1, 1, 0] - curve.points(count // 2 - k) * [1, 1, -1]
        if np.abs(turned - points).max() <= SYMMETRY_TOLERANCE * wale:
            found.append(action(count // 2 - k, [-1.0, -1.0, 1.0]))
    return found


def symmetric_motions(free, group):
    """Basis (P, 3, n) of the displacements of free components that keep the symmetries.

    The parameter of a displacement field is the displacement of one component of one point.

    Parameters
    ----------
    free : ndarray of bool (P, 3)
        Which components of which control points may move.

    Raises
    ------
    GeometryError
        When nothing may move, or a component is free and its image is not.
    """
    count = len(free)
    average = np.eye(3 * count)
    for symmetry in group:
        average = 0.5 * (average + symmetry @ average)
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
