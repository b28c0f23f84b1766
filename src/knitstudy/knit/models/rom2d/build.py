"""The 2D network: straight beams in the plane from contact zone to contact zone (section 3.4 of the paper, Fig. 4).

A node in a contact zone is shared by both yarns. Between the lower and the upper zone of one side of an interlock both
yarns run along the same segment, which has the section of one yarn (or of both, as a variant). All crossings are shared
nodes, whatever the interaction.

The feet of the bottom yarn and the heads of the top yarn, where these are whole, meet no other yarn. Their corners
stand where the contact zones of the next row would be: the zones of the outermost row of interlocks, one course away. A
yarn that ends in a sinker ends on the line through the zones that the sinker would join; a cut leg ends half way to the
zone that it would lead to.

Segments may lie along the maximum principal stress of the deformed knit instead (Fig. 14, Table 4), averaged over the
segments that end in the centre cell. The paper keeps the distances between contact zones and positions the segments by
angles. A honeycomb repeats from row to row, so an interlock leads as far along x as a leg leads back: with distances
along x kept, any two angles of interlock and leg close it, with the heights h = |dx| tan(angle to x). Heads and sinkers
lie along x.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.errors import GeometryError
from knitstudy.knit.contacts.segments import KINDS
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.loading.history import Stations
from knitstudy.knit.loading.solve import Problem
from knitstudy.knit.models.rom2d import PlanarNetwork
from knitstudy.knit.yarns.network import Network, contacts_of, problem, require_named
from knitstudy.mechanics.core.arrays import Floats, Ints

INTERLOCKS, LEGS = ("interlock, left", "interlock, right"), ("leg, left", "leg, right")

# Angle to x beyond which a segment is too steep to give a height [deg]: there a tenth of a degree is a fifth of it
UPRIGHT = 89.5


@dataclass(frozen=True)
class Heights:
    """Heights of the parts of a honeycomb's row."""

    interlock: float  # from the lower to the upper zones of an interlock [m]
    leg: float  # from there to the lower zones of the next row [m]

    @property
    def course(self) -> float:
        """Distance of two rows [m]."""
        return self.interlock + self.leg


def heights(fabric: Fabric, contacts: xr.Dataset, interlock: float, leg: float) -> Heights:
    """Return the heights of a honeycomb with the contacts' distances along x, from the angles of its segments [deg]."""
    x = zone_places(fabric, contacts)[:, 0]
    step = 0.5 * (abs(x[2] - x[0]) + abs(x[3] - x[1]))
    return Heights(*(float(step * np.tan(np.radians(angle))) for angle in (interlock, leg)))


def heights_by_stress(fabric: Fabric, contacts: xr.Dataset, stresses: xr.Dataset) -> Heights:
    """Return the heights of the honeycomb along the maximum principal stress of the segments of the centre cell.

    Raises GeometryError if the knit has no legs, or a direction gives no height.
    """
    angles = []
    central = stresses["segment_central"].to_numpy() == 1
    for name, kinds in (("interlocks", INTERLOCKS), ("legs", LEGS)):
        here = central & np.isin(stresses["segment_kind"], [KINDS.index(kind) for kind in kinds])
        if not here.any():
            raise GeometryError(
                f"the centre cell has no {name} with stresses: a honeycomb by principal stress needs a knit of two "
                "rows or more"
            )
        axis = np.abs(stresses["segment_axis"].sel(extent="whole").to_numpy()[here, 0])
        angle = float(np.degrees(np.arctan2(axis[:, 1], axis[:, 0])).mean())
        if not 90 - UPRIGHT < angle < UPRIGHT:
            raise GeometryError(
                f"the maximum principal stress in {name} of the centre cell is at {angle:.2f} degrees to x: only "
                f"angles from {90 - UPRIGHT:g} to {UPRIGHT:g} make a honeycomb; use rom.honeycomb geometry"
            )
        angles.append(angle)
    return heights(fabric, contacts, *angles)


def zone_places(fabric: Fabric, contacts: xr.Dataset) -> Floats:
    """Return the mean places (4, 2) of the zones in their cells, from the left edge of the cell and row 0 on [m]."""
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    steps = np.column_stack([column * fabric.cell[0], row * fabric.cell[1]])
    within = contacts["centroid"].to_numpy()[:, :2] - steps
    return np.stack([within[zone == number].mean(axis=0) for number in range(4)])


def moved(fabric: Fabric, contacts: xr.Dataset, height: Heights) -> xr.Dataset:
    """Return contacts whose centroids are the joints of a honeycomb of some heights; x is each zone's mean."""
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    place = zone_places(fabric, contacts)
    centroid = contacts["centroid"].to_numpy().copy()
    centroid[:, 0] = column * fabric.cell[0] + place[zone, 0]
    centroid[:, 1] = place[:2, 1].mean() + row * height.course + np.where(zone >= 2, height.interlock, 0.0)
    return contacts.assign(centroid=(contacts["centroid"].dims, centroid, contacts["centroid"].attrs))


def build(
    scene: PlanarNetwork,
    fabric: Fabric,
    contacts: xr.Dataset | None = None,  # as `rom.contacts_from` says; by default predicted by the geometry
    stresses: xr.Dataset | None = None,  # of the simulation that `rom.stress_from` names
) -> Problem:
    """Return a scene with the 2D network as a problem.

    Raises ConfigurationError if the scene names stresses that are not given; DataFileError if the contacts belong to
    another fabric; GeometryError if the stresses make no honeycomb.
    """
    contacts = contacts_of(fabric, contacts)
    require_named(f"rom.stress_from of scene {scene.name}", scene.rom.stress_from, "stresses", stresses)
    beams = planar_network(fabric, contacts, scene.rom.section == "doubled", stresses)
    return problem(scene, fabric, beams)


def planar_network(
    fabric: Fabric,
    contacts: xr.Dataset,
    doubled: bool = False,  # whether a segment that two yarns share has the section of both
    stresses: xr.Dataset | None = None,  # whose directions segments take instead of joining the contacts
) -> Network:
    """Return the network of a knit; raises GeometryError if the stresses make no honeycomb."""
    course = fabric.cell[1]
    if stresses is not None:
        rows = heights_by_stress(fabric, contacts, stresses)
        contacts = moved(fabric, contacts, rows)
        course = rows.course
    corners = _with_ends(fabric, _corners(fabric, contacts, course), contacts, course)
    first = np.flatnonzero(corners.yarn[1:] == corners.yarn[:-1])  # passages from which the yarn goes on
    legs = np.column_stack([corners.number[first], corners.number[first + 1]])
    segments, yarns = np.unique(np.sort(legs, axis=1), axis=0, return_counts=True)
    return Network(
        nodes=corners.point,
        ends=segments,
        offsets=np.zeros((len(segments), 2, 3)),
        arms_turn=True,
        yarns_side_by_side=yarns if doubled else np.ones(len(yarns)),
        stations=Stations(corners.yarn, corners.arc_length, corners.point[corners.number]),
        station_node=corners.number,
        station_offset=np.zeros((len(corners.number), 3)),
        beam_nodes=len(corners.point),
        height=fabric.cells[1] * course,
    )


@dataclass(frozen=True)
class _Corners:
    """The corners that the yarns pass, yarn by yarn and in order of arc length."""

    yarn: Ints  # of every passage
    arc_length: Floats  # of every passage [m]
    number: Ints  # of the corner of every passage
    point: Floats  # (C, 3) of the corners [m]

    def and_more(self, yarn: Ints, arc_length: Floats, number: Ints, point: Floats) -> _Corners:
        """Return these and further passages, with further corners, in order."""
        yarn, arc_length = np.append(self.yarn, yarn), np.append(self.arc_length, arc_length)
        order = np.lexsort((arc_length, yarn))
        number = np.append(self.number, number)[order]
        return _Corners(yarn[order], arc_length[order], number, np.concatenate([self.point, point]))


def _corners(fabric: Fabric, contacts: xr.Dataset, spacing: float) -> _Corners:
    """Return corners in contact zones, and where whole yarns would have zones with the rows beyond the edges."""
    zone = contacts["centroid"].to_numpy() * [1.0, 1.0, 0.0]
    row = contacts["row"].to_numpy()
    yarn = contacts["yarn"].to_numpy().astype(int)
    arc_length = contacts["arc_length"].to_numpy()
    course = np.array([0.0, spacing, 0.0])
    whole = fabric.arcs is None
    feet, heads = (np.flatnonzero((row == edge) & whole) for edge in (0, fabric.cells[1] - 1))
    passed = _Corners(yarn.T.ravel(), arc_length.T.ravel(), np.tile(np.arange(len(zone)), 2), zone)
    # All yarns have one shape: the bottom yarn's feet are where yarn 1 has them, the top yarn's heads where
    # the yarn below it has them.
    return passed.and_more(
        np.append(yarn[feet, 0], yarn[heads, 1]),
        np.append(arc_length[feet, 1], arc_length[heads, 0]),
        len(zone) + np.arange(len(feet) + len(heads)),
        np.concatenate([zone[feet] - course, zone[heads] + course]),
    )


def _with_ends(fabric: Fabric, corners: _Corners, contacts: xr.Dataset, course: float) -> _Corners:
    """Add the ends of the yarns, in sinkers or half way up a leg; rows are `course` apart [m]."""
    start = np.flatnonzero(np.append(True, np.diff(corners.yarn) != 0))
    stop = np.append(start[1:], len(corners.yarn)) - 1
    length = np.array([centreline.length for centreline in fabric.centrelines])
    ends = np.stack([np.zeros(len(length)), length], axis=1)
    tips, ways = (
        np.concatenate(
            np.stack([getattr(c, of)(s) for c, s in zip(fabric.centrelines, ends, strict=True)], axis=1)
        )
        for of in ("position", "tangent")
    )
    number = corners.number[np.append(start, stop)]
    end = corners.point[number]
    in_leg = np.abs(ways[:, 1]) > np.abs(ways[:, 0])
    end[~in_leg, 0] = tips[~in_leg, 0]
    # A leg leads from an upper zone to the lower one of the next row, on the same side; crossings stand in fours.
    number = number[in_leg]
    up = np.where(contacts["zone"].to_numpy()[number] >= 2, 1, -1)
    end[in_leg] = 0.5 * (end[in_leg] + corners.point[number - 2 * up])
    end[in_leg, 1] += 0.5 * up * course
    return corners.and_more(
        corners.yarn[np.append(start, stop)],
        ends.T.ravel(),
        len(corners.point) + np.arange(len(end)),
        end,
    )
