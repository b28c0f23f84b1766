"""Springs that stand for contact, from a direct simulation (Table 2, sections 2.5 and 2.6), and normals of contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError, GeometryError

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


def contact_normals(contacts: xr.Dataset, reading: str = MAIN) -> np.ndarray:
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


def partners(contacts: xr.Dataset) -> np.ndarray:
    """Return the other contact (K,) on the side of the interlock of every contact.

    Raises GeometryError if a contact has none.
    """
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    place = {key: k for k, key in enumerate(zip(row, column, zone, strict=True))}
    # Zones 0 and 1 are left and right below, 2 and 3 left and right above.
    partner = np.array(
        [place.get((r, c, (z + 2) % 4), -1) for r, c, z in zip(row, column, zone, strict=True)]
    )
    if np.any(partner < 0):
        k = int(np.argmin(partner))
        raise GeometryError(
            f"contacts: row {row[k]}, column {column[k]} has zone {zone[k]} but not zone {(zone[k] + 2) % 4} on "
            "the same side of the interlock; the contact normal plane needs both"
        )
    return partner


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


def spring_axes(normal: np.ndarray, axes: str) -> np.ndarray:
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

    axes: np.ndarray  # (K, 3, 3) unit vectors x, y and z
    tied: np.ndarray  # (K,) crossings that are tied instead
    open: np.ndarray  # (K,) crossings that are neither tied nor in contact at the last increment
    force: np.ndarray  # (K, 3) net force on the lower row's yarn at the last increment, along the axes [N]
    # (K, 3) of the upper row's side to the lower row's since first contact, along them [m]
    displacement: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """Secants (K, 3) [N/m]; nan as well where the displacement along an axis is zero."""
        return self.force / np.where(self.displacement == 0, np.nan, self.displacement)

    @property
    def averaged(self) -> np.ndarray:
        """The stiffness (3,) [N/m] of all crossings that comes nearest to their forces."""
        return _nearest(self.force, self.displacement, axis=0)

    @property
    def tangential(self) -> float:
        """The same of one stiffness for x and y together, which no turn of the axes changes [N/m]."""
        return float(_nearest(self.force[:, :2], self.displacement[:, :2]))

    @property
    def bridged(self) -> np.ndarray:
        """Crossings (K,) in contact without a tie."""
        return ~self.tied & ~self.open

    @property
    def used(self) -> np.ndarray:
        """Number (3,) of crossings with a secant."""
        return np.isfinite(self.stiffness).sum(axis=0)

    @property
    def negative(self) -> np.ndarray:
        """Number (3,) of crossings whose secant is negative."""
        return (self.stiffness < 0).sum(axis=0)

    @property
    def undefined(self) -> np.ndarray:
        """Number (3,) of crossings in contact without a secant."""
        return np.count_nonzero(self.bridged) - self.used


def _nearest(force: np.ndarray, displacement: np.ndarray, axis: int | None = None) -> np.ndarray:
    """Return the stiffness nearest to forces by least squares; nan where nothing is in contact."""
    with np.errstate(invalid="ignore"):
        return np.nansum(force * displacement, axis) / np.nansum(displacement**2, axis)


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
