"""Joints of the 3D network: normals of contacts, points C1 to C4, ties, and springs from a direct simulation.

Sections 2.5 and 2.6 of the paper, Fig. 5 and Table 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr
from scipy.optimize import elementwise

from knitstudy.errors import DataFileError, GeometryError
from knitstudy.knit.geometry.columns import CONTACTS
from knitstudy.knit.geometry.crossings import Crossings
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.spline import Centreline
from knitstudy.knit.scene.sections import Yarn
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.cylinder import local_compliance

# The normal of a contact (section 2.5): "a contact normal vector was defined in the direction of the resultant contact
# force on the yarn interface". Section 4 says of which force: "contact forces along the contact normal direction, as
# well as frictional forces in the corresponding tangent plane". So the main reading is the resultant of the pressure.
# Along the resultant of pressure and friction no force is left in the tangent plane, and k_x = k_y = 0. "The normal
# direction at points P1 and P2 is the same since loops are assumed symmetric": in the main reading the two are mirror
# images in the plane of the fabric; the readings "mean" take one direction for both.

MAIN = "normal_resultant"

# Variable of the contacts that holds the directions, and whether P1 and P2 share their mean
NORMALS = {
    MAIN: ("contact_normal", False),
    "mean_normal_resultant": ("contact_normal", True),
    "resultant": ("resultant_direction", False),
    "mean_resultant": ("resultant_direction", True),
    "closest_points": ("normal", False),
}


def contact_normals(contacts: xr.Dataset, reading: str = MAIN) -> Floats:
    """Return unit normals (K, 3) by a reading of `NORMALS`, at the last increment.

    Contacts without a force have the line of the closest points, and so do contacts that geometry alone predicts.
    Raises DataFileError if the reading needs forces that the contacts do not hold.
    """
    name, shared = NORMALS[reading]
    line = contacts["normal"].to_numpy()
    if name == "resultant_direction" and name not in contacts:
        raise DataFileError(
            f"the contacts hold no {name}: rom.normal {reading} needs rom.contacts_from a scene of solid yarns"
        )
    directions = contacts[name].to_numpy() if name in contacts else line
    last = directions.reshape(-1, *line.shape)[-1]
    normal = np.where(np.isfinite(last), last, line)
    if shared:
        normal = normal + normal[partners(contacts)]
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def partners(contacts: xr.Dataset) -> Ints:
    """Return the other contact (K,) on the side of the interlock of every contact.

    Raises GeometryError if a contact has none.
    """
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    # Zones 0 and 1 are left and right below, 2 and 3 left and right above.
    here, beside = (pd.MultiIndex.from_arrays([row, column, zones]) for zones in (zone, (zone + 2) % 4))
    partner = here.get_indexer(beside)
    if np.any(partner < 0):
        k = int(np.argmin(partner))
        raise GeometryError(
            f"contacts: row {row[k]}, column {column[k]} has zone {zone[k]} but not zone {(zone[k] + 2) % 4} on "
            "the same side of the interlock; the contact normal plane needs both"
        )
    return partner


# Joints of the 3D network: the points C1 to C4 where yarns are joined, and ties and springs (section 2.5, Fig. 5)
#
# P1 and P2 are the centroids of the lower and the upper contact on one side of an interlock. The line P1 P2 and the
# contact normal at P1 span the contact normal plane of P1, which cuts the centrelines of the two yarns near P1 in C1
# and C3; the normal at P2 gives C2 and C4. Where a plane misses a centreline within a diameter of the crossing, or the
# normal lies along P1 P2, C is the closest point of the crossing, some way off the plane.

SAMPLES = 40  # intervals of the search for the cut, over a diameter to either side of the crossing


@dataclass(frozen=True)
class JointPoints:
    """Where two yarns touch and where their centrelines belong to that touch, for K crossings."""

    yarn: Ints  # (K, 2) the lower row's yarn and the upper row's yarn
    arc_length: Floats  # (K, 2) of the points C on their centrelines [m]
    point: Floats  # (K, 2, 3) the points C [m]
    centroid: Floats  # (K, 3) the points P [m]
    off_plane: Floats  # (K, 2) distance of the points C from their contact normal plane [m]

    @classmethod
    def at_crossings(cls, crossings: Crossings, chosen: Bools) -> JointPoints:
        """Return the closest points of chosen crossings as C, and their middles as P."""
        some = crossings[chosen]
        off = np.zeros(some.yarn.shape)
        return cls(some.yarn, some.arc_length, some.point, some.point.mean(axis=1), off)


def joint_points(fabric: Fabric, contacts: xr.Dataset, reading: str = MAIN) -> JointPoints:
    """Return points P and C of all crossings of a fabric, with normals by a reading of `NORMALS`.

    Raises GeometryError if a contact has no partner on its side of the interlock.
    """
    yarn = contacts["yarn"].to_numpy().astype(int)
    near = contacts["arc_length"].to_numpy()
    centroid = contacts["centroid"].to_numpy()
    plane = contact_normal_planes(contacts, reading)
    arc_length = np.empty(yarn.shape)
    point = np.empty((*yarn.shape, 3))
    for number, line in enumerate(fabric.centrelines):
        on_yarn = yarn == number
        crossing = np.nonzero(on_yarn)[0]
        cut = _cut(line, near[on_yarn], plane[crossing], centroid[crossing], 2 * fabric.radius)
        arc_length[on_yarn], point[on_yarn] = cut, line.position(cut)
    off = np.abs(np.einsum("ksi,ki->ks", point - centroid[:, None], plane))
    return JointPoints(yarn, arc_length, point, centroid, off)


def contact_normal_planes(contacts: xr.Dataset, reading: str = MAIN) -> Floats:
    """Return the unit normals (K, 3) of the contact normal planes, which hold P1, P2 and the contact normal.

    They are nan where the contact normal lies along the line P1 P2.
    """
    centroid = contacts["centroid"].to_numpy()
    normal = contact_normals(contacts, reading)
    line = centroid[partners(contacts)] - centroid
    across = np.cross(line / np.linalg.norm(line, axis=1, keepdims=True), normal)
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    return across / np.where(sine > 1e-3, sine, np.nan)


def _cut(centreline: Centreline, start: Floats, plane: Floats, centroid: Floats, reach: float) -> Floats:
    """Return the arc lengths (k,) nearest to `start` where a centreline cuts planes (k, 3) through centroids (k, 3).

    They are `start` where it does not do so within a `reach` [m], or a plane is nan.
    """
    curve = centreline.curve

    def height(u: Floats, *plane_and_level: Floats) -> Floats:
        """Return the heights of the curve over the planes."""
        *across, level = plane_and_level
        return np.einsum("ki,ki->k", curve.value(u), np.column_stack(across)) - level

    level = np.einsum("ki,ki->k", plane, centroid)
    # In the curve's own parameter u, whose unit is a segment: arc lengths would be inverted at every point.
    limits = np.clip(start + np.array([[-reach], [reach]]), 0.0, centreline.length)
    low, high = centreline.parameter(limits)
    u = np.linspace(low, high, SAMPLES + 1, axis=1)
    above = np.einsum("kqi,ki->kq", curve.value(u), plane) > level[:, None]
    changes = above[:, 1:] != above[:, :-1]
    middle = centreline.arc_length(0.5 * (u[:, 1:] + u[:, :-1]))
    nearest = np.argmin(np.where(changes, np.abs(middle - start[:, None]), np.inf), axis=1)
    row = np.arange(len(u))
    bracket = (u[row, nearest], u[row, nearest + 1])
    cut = elementwise.find_root(height, bracket, args=(*plane.T, level), tolerances={"xatol": 1e-12})
    hit = changes.any(axis=1)
    return np.where(hit, centreline.arc_length(np.where(hit, cut.x, 0.0)), start)


def contacts_of_crossings(fabric: Fabric, tied: float = 0.0) -> xr.Dataset:
    """Return the contacts that geometry alone predicts: a point or a tied disc midway between closest points.

    The normal points from side 0 to side 1. Forces and displacements are left out.
    Discs have a radius of `tied` yarn radii; points have no area.
    Raises GeometryError if two centrelines meet, so that there is no normal.
    """
    crossings = fabric.crossings
    apart = crossings.point[:, 1] - crossings.point[:, 0]
    distance = np.linalg.norm(apart, axis=1)
    if not np.all(distance > 0):
        k = int(np.argmin(distance))
        raise GeometryError(
            f"crossing {k} (row {crossings.row[k]}, column {crossings.column[k]}, zone {crossings.zone[k]}): "
            "the centrelines of its two yarns meet, which leaves no contact normal; they must be apart"
        )
    labels = {name: getattr(crossings, name) for name in ("row", "column", "zone", "yarn", "arc_length")}
    variables = {
        "centroid": crossings.point.mean(axis=1),
        "normal": apart / distance[:, None],
        "area": np.full(len(distance), np.pi * (tied * fabric.radius) ** 2),
    }
    return xr.Dataset(CONTACTS.variables(labels | variables), coords={"xyz": list("xyz")})


# Radius of a patch over that of the yarn: waves to resolve a smaller one are many, a larger one is not local
SMALLEST, LARGEST = 0.1, 0.6


def patch_stiffness(fabric: Fabric, points: JointPoints, contacts: xr.Dataset, yarn: Yarn) -> Floats:
    """Return the stiffness matrices (K, 3, 3) [N/m] of the tied patches of all crossings.

    Tied areas are alike in size: their mean is taken. The two yarns yield one after the other, each along the contact
    normal, along itself and across.
    Raises DataFileError if the contacts have no ties, or of a size that this is not for.
    """
    tied = contacts["tied"].to_numpy() > 0 if "tied" in contacts else np.ones(len(points.yarn), dtype=bool)
    area = contacts["area"].to_numpy()[tied].mean() if tied.any() else 0.0
    size = round(float(np.sqrt(area / np.pi)) / yarn.radius, 3)
    if not SMALLEST <= size <= LARGEST:
        raise DataFileError(
            f"ties have a radius of {size:g} yarn radii, but rom.joint 'patch' needs {SMALLEST} to {LARGEST}: use "
            "such a tie.radius, contacts of a scene of solid yarns with ties of such a size, or rom.joint 'pinned'"
        )
    normal = contacts["normal"].to_numpy()
    compliance = np.zeros((len(normal), 3, 3))
    for number, centreline in enumerate(fabric.centrelines):
        crossing, side = np.nonzero(points.yarn == number)
        tangent = centreline.tangent(points.arc_length[crossing, side])
        across = np.cross(normal[crossing], tangent)
        across /= np.linalg.norm(across, axis=1)[:, None]
        # Rows: normal, along the yarn in the tangent plane, across both
        frame = np.stack([normal[crossing], np.cross(across, normal[crossing]), across], axis=1)
        own = frame.swapaxes(1, 2) @ (np.array(local_compliance(size, yarn.poisson_ratio))[:, None] * frame)
        np.add.at(compliance, crossing, own)
    return np.asarray(yarn.youngs_modulus * yarn.radius * np.linalg.inv(compliance), dtype=float)


@dataclass(frozen=True)
class CrossingJoints:
    """Joints of K crossings; a crossing without a spring that is not open is tied."""

    open: Bools  # (K,) crossings without a joint
    stiffness: Floats  # (K, 3, 3) symmetric matrices of the springs [N/m]; nan where there is none

    @property
    def sprung(self) -> Bools:
        """Crossings with a spring (K,)."""
        return np.isfinite(self.stiffness[:, 0, 0])

    @property
    def tied(self) -> Bools:
        """Crossings that are tied (K,)."""
        return ~self.sprung & ~self.open

    def pinned(self, stiffness: float | Floats) -> CrossingJoints:
        """Return these joints with pins for ties: they hold the two points together and leave sections free to turn.

        The stiffness of the pins is the same in all directions, or a matrix (3, 3) each [N/m].
        """
        matrices = stiffness * np.eye(3) if np.ndim(stiffness) == 0 else stiffness
        pins = np.where(self.tied[:, None, None], matrices, self.stiffness)
        return CrossingJoints(self.open, pins)

    @classmethod
    def all_tied(cls, count: int) -> CrossingJoints:
        """Return the joints of a knit whose crossings are all tied."""
        return cls(np.zeros(count, dtype=bool), np.full((count, 3, 3), np.nan))


# Springs that stand for contact, from a direct simulation (Table 2 and section 2.6 of the paper)
#
# At every crossing that is not tied, the net force F on the lower row's yarn over the displacement d of the upper row's
# side to the lower row's, both at the last increment and d from first contact on, along x, y and z. Table 2 does not
# say of which system: "local" axes have z along the contact normal and x and y in the tangent plane; "global" axes are
# the axes of the knit. Along these a crossing that slides down its tangent plane moves against the force: its secant is
# negative.
#
# The average is the one stiffness that comes nearest to all forces, sum(F d) / sum(d d): a mean of the ratios has no
# bound where a crossing hardly moves.

# Displacement variables of the contacts: of the facets that face each other, or of the yarns' centrelines
MEASURES = {
    "interface": "relative_displacement",
    "centreline": "centreline_relative_displacement",
}

# Angle [deg] by which x is turned in the tangent plane from the projection of the course direction, the other way round
# on the other side of a loop; none for the axes of the knit
AXES = {
    "global": None,
    "local": 0.0,
    "local, turned 30": 30.0,
    "local, turned 60": 60.0,
    "local, turned 90": 90.0,
}
STEEP = 0.1  # length of that projection below which the wale direction is projected instead


def spring_axes(normal: Floats, axes: str) -> Floats:
    """Return the unit vectors x, y and z (K, 3, 3) of springs at contacts with normals (K, 3).

    Examples
    --------
    >>> spring_axes(np.array([[0.0, 0.0, 1.0]]), "local").tolist()[0]
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    turn = AXES[axes]
    if turn is None:
        return np.broadcast_to(np.eye(3), (len(normal), 3, 3))
    course, wale = (direction - normal * (normal @ direction)[:, None] for direction in np.eye(3)[:2])
    x = np.where(np.linalg.norm(course, axis=1, keepdims=True) > STEEP, course, wale)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    angle = np.radians(turn) * np.copysign(1.0, normal[:, :1])
    x = np.cos(angle) * x + np.sin(angle) * np.cross(normal, x)
    return np.stack([x, np.cross(normal, x), normal], axis=1)


@dataclass(frozen=True)
class Springs:
    """Secants of K crossings along x, y and z; nan where there is none."""

    axes: Floats  # (K, 3, 3) unit vectors x, y and z
    tied: Bools  # (K,) crossings that are tied instead
    open: Bools  # (K,) crossings that are neither tied nor in contact at the last increment
    force: Floats  # (K, 3) net force on the lower row's yarn at the last increment, along the axes [N]
    # (K, 3) of the upper row's side to the lower row's since first contact, along them [m]
    displacement: Floats

    @property
    def stiffness(self) -> Floats:
        """Secants (K, 3) [N/m]; nan as well where the displacement along an axis is zero."""
        return self.force / np.where(self.displacement == 0, np.nan, self.displacement)

    @property
    def averaged(self) -> Floats:
        """The stiffness (3,) [N/m] of all crossings that comes nearest to their forces."""
        return _nearest(self.force, self.displacement, axis=0)

    @property
    def tangential(self) -> float:
        """Isotropic in-plane version: one stiffness for x and y, whatever the orientation of the axes [N/m]."""
        return float(_nearest(self.force[:, :2], self.displacement[:, :2]))

    @property
    def bridged(self) -> Bools:
        """Crossings (K,) in contact without a tie."""
        return ~self.tied & ~self.open

    @property
    def used(self) -> Ints:
        """Number (3,) of crossings with a secant."""
        return np.isfinite(self.stiffness).sum(axis=0)

    @property
    def negative(self) -> Ints:
        """Number (3,) of crossings whose secant is negative."""
        return (self.stiffness < 0).sum(axis=0)

    @property
    def undefined(self) -> Ints:
        """Number (3,) of crossings in contact without a secant."""
        return np.count_nonzero(self.bridged) - self.used


def _nearest(force: Floats, displacement: Floats, axis: int | None = None) -> Floats:
    """Return the stiffness nearest to forces by least squares; nan where nothing is in contact."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.nansum(force * displacement, axis) / np.nansum(displacement**2, axis))


def springs(
    contacts: xr.Dataset,  # of a simulation with contact
    measure: str,  # of `MEASURES`: whose displacement is taken
    axes: str = "local",  # of `AXES`
    normal: str = MAIN,  # of `NORMALS`
) -> Springs:
    """Return the springs of a direct simulation.

    Raises DataFileError if the contacts hold no forces or not these displacements.
    """
    needed = ("tied", "zones", "force", MEASURES[measure])
    missing = [name for name in needed if name not in contacts]
    if missing:
        raise DataFileError(
            f"the contacts hold no {missing[0]}: springs come from the contacts of a scene of solid yarns with contact"
        )
    tied = contacts["tied"].to_numpy().astype(bool)
    in_contact = contacts["zones"].to_numpy() > 0
    opened = ~tied & ~in_contact[-1]
    displacement = contacts[MEASURES[measure]].to_numpy()
    first = np.argmax(in_contact, axis=0)
    since = displacement[-1] - displacement[first, np.arange(len(first))]
    frame = spring_axes(contact_normals(contacts, normal), axes)
    force, moved = (
        np.where((tied | opened)[:, None], np.nan, np.einsum("kai,ki->ka", frame, vector))
        for vector in (contacts["force"].to_numpy()[-1], since)
    )
    return Springs(frame, tied, opened, force, moved)
