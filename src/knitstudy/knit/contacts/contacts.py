"""Contacts of a simulation that keeps its points in contact: areas, forces, motions, by crossing and increment.

Section 2.5 of the paper takes the direction of the resultant contact force for the normal of a contact:
`contact_normal` is that of the pressure, `resultant_direction` that of pressure and friction. `normal` is the line of
the closest points.

Where the local indentation is a law of contact, area and pressure are Hertz's, from the force at the crossing: the
points that touch lie on the depth that the law stands for, which is not the area of contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.knit.contacts.facets import count_zones
from knitstudy.knit.contacts.kinematics import CrossingAxes, kinematics
from knitstudy.knit.geometry.columns import CONTACTS
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.scene.scene import Scene
from knitstudy.mechanics.contact.indentation import CylinderContact
from knitstudy.mechanics.contact.interaction import PASS_SHARE
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints

MODULUS = "indentation_modulus"  # attribute of histories of yarns whose local indentation is a law: E* [Pa]
# Angle below which yarns count as crossing at it: side by side they touch along a line, which has no end.
SMALLEST = np.radians(5.0)


def contacts(scene: Scene, geometry: xr.Dataset, history: xr.Dataset) -> xr.Dataset:
    """Return the contacts of a scene from its geometry and its history; see `extract`.

    Examples
    --------
    >>> from knitstudy import load_scene, simulate
    >>> cell = {"pattern.loops": 1, "pattern.rows": 1, "solver.increments": 1}
    >>> knit = simulate(load_scene("yarns-tie-course").vary(cell))
    >>> contacts(knit.scene, knit.geometry, knit.history)["force"][-1, 0].values.round(2)  # [N]
    array([-1.39, -0.02,  0.01])
    """
    return extract(fabric_of(geometry), history)


def extract(fabric: Fabric, history: xr.Dataset) -> xr.Dataset:
    """Return the contacts dataset of docs/reference/files.md.

    Raises
    ------
    DataFileError
        If the history holds no crossings, or crossings of another fabric, or contact points without the number of
        facets around a yarn.
    """
    if "crossing_force" not in history:
        raise DataFileError("the history holds no crossing_force: contacts come from a scene of solid yarns")
    if history.sizes["crossing"] != len(fabric.crossings):
        raise DataFileError(
            f"the history has {history.sizes['crossing']} crossings and the fabric {len(fabric.crossings)}: "
            "they belong to different scenes"
        )
    crossings = fabric.crossings
    touch = _Touch.of(history)
    tied = history["crossing_tied"].to_numpy().astype(bool)
    motion = history["crossing_displacement"].to_numpy()
    values = {
        **{name: getattr(crossings, name) for name in ("row", "column", "zone", "yarn", "arc_length")},
        "normal": crossings.normal,
        "tied": tied.astype(np.int8),
        "force": history["crossing_force"].to_numpy(),
        "centroid_displacement": motion,
        "relative_displacement": motion[:, :, 1] - motion[:, :, 0],
    }
    values |= touch.results()
    kept = {name: history.attrs[name] for name in ("scene", "interaction") if name in history.attrs}
    if MODULUS in history.attrs:
        values |= indented(fabric, values["normal_resultant"], history.attrs[MODULUS])
        kept["contact_area_from"] = "the force, by Hertz: local indentation is a law of contact"
    values["centroid"] = touch.undeformed_centroid(crossings.point.mean(axis=1))
    values["area"] = values["contact_area"][-1].copy()
    if "section_gradient" in history:
        gradient, moved = history["section_gradient"].to_numpy(), history["section_displacement"].to_numpy()
        relative = values["relative_displacement"]
        centroid = touch.reference_centroid()
        values |= kinematics(fabric, gradient, moved, relative, centroid)
    _put_ties(values, history, tied)
    with np.errstate(invalid="ignore"):  # an open crossing has no direction: 0 / 0
        values["resultant_direction"] = -values["force"] / np.linalg.norm(
            values["force"], axis=-1, keepdims=True
        )
    values |= {name: history[name].to_numpy() for name in ("yarn_force", "yarn_moment") if name in history}
    return xr.Dataset(
        {"strain": history["strain"]} | CONTACTS.variables(values),
        coords={"xyz": list("xyz")},
        attrs=kept,
    )


def indented(fabric: Fabric, force: Floats, modulus: float) -> dict[str, Floats]:
    """Return Hertz's area of contact [m2] and largest pressure [Pa], (I, K), under normal forces (I, K, 3) [N].

    The angle between the yarns is the undeformed one.
    """
    radius = fabric.radius
    load = np.linalg.norm(force, axis=-1)
    cosine = np.abs(np.einsum("ki,ki->k", *CrossingAxes.of(fabric).tangent.swapaxes(0, 1)))
    angle = np.arccos(np.clip(cosine, 0.0, 1.0))
    kinds = [CylinderContact.at(max(float(value), SMALLEST)) for value in angle]
    semiaxis, ratio = (np.array([getattr(kind, name) for kind in kinds]) for name in ("semiaxis", "ratio"))
    longer = semiaxis * radius * (load / (modulus * radius**2)) ** (1 / 3)
    area = np.pi * ratio * longer**2
    pressure = np.divide(1.5 * load, area, out=np.zeros_like(area), where=area > 0)
    return {"contact_area": area, "largest_pressure": pressure}


# Columns of contact points (`knit.geometry.columns`), and the shape of one entry.
_POINT_COLUMNS: dict[str, tuple[int, ...]] = {
    **dict.fromkeys(("side", "area", "cell_area", "pressure", "slip", "sticks"), ()),
    **dict.fromkeys(("position", "reference", "normal", "traction"), (3,)),
    "cell": (2,),
}


@dataclass(frozen=True)
class _Touch:
    """Gauss points under pressure that belong to a crossing, of all increments one after another."""

    shape: tuple[int, int]  # increments I and crossings K
    place: Ints  # (p,) increment times K plus crossing
    around: int  # facets around a yarn
    points: SimpleNamespace  # their columns

    @classmethod
    def of(cls, history: xr.Dataset) -> _Touch:
        """Return the points of a history; none if its crossings are all tied."""
        shape = history.sizes["increment"], history.sizes["crossing"]
        if "contact_pressure" not in history:
            none = {name: np.zeros((0, *entry), dtype=int) for name, entry in _POINT_COLUMNS.items()}
            return cls(shape, np.zeros(0, dtype=int), 1, SimpleNamespace(**none))
        if "facets_around" not in history.attrs:
            raise DataFileError(
                "the history has contact points but no attribute facets_around, the number of facets around a yarn"
            )
        crossing = history["contact_crossing"].to_numpy()
        here = np.flatnonzero((crossing >= 0) & (history["contact_pressure"].to_numpy() > 0))
        columns = {name: history[f"contact_{name}"].to_numpy()[here] for name in _POINT_COLUMNS}
        place = history["contact_increment"].to_numpy()[here] * shape[1] + crossing[here]
        return cls(shape, place, int(history.attrs["facets_around"]), SimpleNamespace(**columns))

    @property
    def load(self) -> Floats:
        """Normal force (p,) of the points [N]."""
        return self.points.area * self.points.pressure

    def results(self) -> dict[str, Floats]:
        """Return all that is known of the crossings (I, K, ...) from their points."""
        points, load = self.points, self.load
        sign = np.where(points.side == 0, 1.0, -1.0)
        area = self._sum(points.area)
        total_load = self._sum(load)
        with np.errstate(invalid="ignore"):  # an open crossing has no centroid, normal, slip or share: 0 / 0
            mean_normal = self._sum(-(load * sign)[:, None] * points.normal)
            results = {
                "contact_centroid": self._sum(load[:, None] * points.position) / total_load[..., None],
                "contact_normal": mean_normal / np.linalg.norm(mean_normal, axis=-1, keepdims=True),
                "slip": self._sum(points.area * points.slip) / area,
                "stick_share": self._sum(points.area * points.sticks) / area,
            }
        return results | {
            "zones": self._zones(),
            "contact_area": 0.5 * area,  # the mean of two sides
            "normal_resultant": self._sum((PASS_SHARE * load * sign)[:, None] * points.normal),
            "tangential_resultant": self._sum((PASS_SHARE * points.area * sign)[:, None] * points.traction),
            "largest_pressure": self._largest_pressure(),
        }

    def _largest_pressure(self) -> Floats:
        """Largest pressure (I, K) that is the mean of a facet.

        There are more points than unknowns of a surface: pressures of single points alternate, their means do not.
        """
        of = np.column_stack([self.place, self.points.side, self.points.cell])
        _, first, facet = np.unique(of, axis=0, return_index=True, return_inverse=True)
        mean = np.bincount(facet.ravel(), self.load, len(first)) / self.points.cell_area[first]
        largest = np.zeros(self.shape)
        np.maximum.at(largest.reshape(-1), self.place[first], mean)
        return largest

    def undeformed_centroid(self, otherwise: Floats) -> Floats:
        """Return where the contact of every crossing (K, 3) lay at the increment when it last touched [m].

        Crossings that never touch get ``otherwise`` (K, 3).
        """
        total = self._sum(self.load)
        last = self.shape[0] - 1 - np.argmax(total[::-1] > 0, axis=0), np.arange(self.shape[1])
        moment = self._sum(self.load[:, None] * self.points.reference)[last]
        weight = total[last]
        touched = weight > 0
        centroid = np.array(otherwise, dtype=float)
        centroid[touched] = moment[touched] / weight[touched, None]
        return centroid

    def reference_centroid(self) -> Floats:
        """Return the centroid of the contact (I, K, 2, 3) on the undeformed yarn of either side [m], nan where open."""
        moment = self._sum(self.load[:, None] * self.points.reference, by_side=True)
        with np.errstate(invalid="ignore"):  # nothing touches: 0 / 0
            return moment / self._sum(self.load, by_side=True)[..., None]

    def _zones(self) -> Ints:
        """Numbers of zones (I, K): facets of the two sides differ, and the larger count stands."""
        place, shape = self._at(by_side=True)
        zones = count_zones(place, self.points.cell, self.around, int(np.prod(shape)))
        return zones.reshape(shape).max(axis=-1)

    def _at(self, by_side: bool) -> tuple[Ints, tuple[int, ...]]:
        """Places (p,) of the points among crossings (I, K), or among the sides of these (I, K, 2)."""
        return (2 * self.place + self.points.side, (*self.shape, 2)) if by_side else (self.place, self.shape)

    def _sum(self, values: Floats, by_side: bool = False) -> Floats:
        """Sums (I, K, ...) of the values (p, ...) of the points, or (I, K, 2, ...) by side."""
        place, shape = self._at(by_side)
        columns = values.reshape(len(values), int(np.prod(values.shape[1:]))).T
        sums = np.stack([np.bincount(place, column, int(np.prod(shape))) for column in columns], axis=-1)
        # Where nothing touches, bincount counts: integers, that forces of ties would be rounded to.
        return sums.astype(float).reshape(*shape, *values.shape[1:])


def _put_ties(values: dict[str, Floats], history: xr.Dataset, tied: Bools) -> None:
    """Write results (..., K, ...) of tied crossings: each is one zone that always sticks, of unknown pressure."""
    centroid, area = (history[name].to_numpy()[tied] for name in ("tied_centroid", "tied_area"))
    normal = values["normal"][tied]
    force = values["force"][:, tied]
    along = np.einsum("iks,ks->ik", force, normal)[..., None] * normal
    values["centroid"][tied], values["area"][tied] = centroid, area
    known = {
        "zones": 1,
        "contact_area": area,
        "contact_centroid": centroid + values["centroid_displacement"][:, tied].mean(axis=2),
        "contact_normal": normal,
        "normal_resultant": along,
        "tangential_resultant": force - along,
        "slip": 0.0,
        "stick_share": 1.0,
        "largest_pressure": np.nan,
    }
    known |= dict.fromkeys({"sliding", "contact_travel", "contact_spin"} & values.keys(), 0.0)
    for name, value in known.items():
        values[name][:, tied] = value
