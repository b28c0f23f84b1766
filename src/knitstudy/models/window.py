"""A window: solid yarns (`spline_yarns`) in some cells of a fabric whose other cells are a network of beams.

Solid yarns are arcs of the fabric's yarns; at their ends, the seams, nodes of beams carry whole sections. Outside of
the window crossings are joined, or beams are in contact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import xarray as xr

from knitstudy.contacts.facets import tied_crossings
from knitstudy.errors import ConfigurationError
from knitstudy.geometry.crossings import Crossings
from knitstudy.geometry.fabric import NO_ARCS, Arcs, Fabric, pieces_of
from knitstudy.loading.gates import require_no_jump
from knitstudy.loading.history import Stations
from knitstudy.loading.solve import Problem, Reported, settings_of
from knitstudy.mechanics.beam_contact import BeamContact
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.solids_and_beams import Seams, SolidsAndBeams
from knitstudy.mesh.mesher import Grips
from knitstudy.models import solids, spline_yarns
from knitstudy.models.beams_in_contact import beam_contact
from knitstudy.models.joints import (
    LARGEST,
    SMALLEST,
    JointPoints,
    Joints,
    contact_normals,
    contacts_of_crossings,
    patch_stiffness,
    spring_axes,
    springs,
)
from knitstudy.models.network_3d import Network, loaded, spatial_network
from knitstudy.models.solids import SolidYarns
from knitstudy.study.scene import Scene


@dataclass(frozen=True, eq=False)
class Window(Arcs):
    """Crossings of which both yarns are solid, and the arcs that they lie on."""

    shown: np.ndarray  # (W,) crossings of the cells that are asked for; the others are of the margin


def window_of(scene: Scene, fabric: Fabric) -> Window:
    """Return the window of a scene.

    Raises ConfigurationError if it does not lie within the knit, or reaches a grip or, where yarns touch, tied
    crossings.
    """
    crossings, cells = fabric.crossings, scene.window.cells // 2
    middle = _middle(scene, fabric)
    rows, columns = np.abs(crossings.row - middle[0]), np.abs(crossings.column - middle[1])
    away = np.maximum(rows, columns)  # cells from the middle one
    crossing = np.flatnonzero(away <= cells + scene.window.margin)
    if scene.kind.interaction.touches:
        _require_untied(scene, crossings, crossing)
    yarn, arc = _arcs(fabric, crossing)
    _require_ungripped(scene, fabric, yarn, arc)
    return Window(crossing, yarn, arc, np.flatnonzero(away <= cells))


def _middle(scene: Scene, fabric: Fabric) -> list[int]:
    """Return row and column of the middle cell; refuse a window that is not wholly in the knit."""
    keys = scene.window
    reach, found = keys.cells // 2 + keys.margin, []
    for name, given, count in (("row", keys.row, fabric.cells[1]), ("column", keys.column, fabric.cells[0])):
        middle = count // 2 if given is None else given
        lowest, highest = reach, count - 1 - reach
        if lowest > highest:
            raise ConfigurationError(
                f"scene {scene.name!r}: window.cells is {keys.cells} and window.margin {keys.margin}, but the knit has "
                f"{count} {name}s: use smaller ones, for together they must be at most that many"
            )
        if not lowest <= middle <= highest:
            why = "does not exist" if middle >= count else "is too near to the edge of the knit"
            raise ConfigurationError(
                f"scene {scene.name!r}: window.{name} is {middle}, which {why} for window.cells {keys.cells} and "
                f"window.margin {keys.margin}: use one from {lowest} to {highest}"
            )
        found.append(middle)
    return found


def _require_untied(scene: Scene, crossings: Crossings, chosen: np.ndarray) -> None:
    """Refuse a window in which some crossings are tied and others are not."""
    tied = chosen[tied_crossings(scene, crossings)[chosen]]
    if len(tied):
        k = tied[0]
        raise ConfigurationError(
            f"scene {scene.name!r}: the window takes in row {crossings.row[k]}, column {crossings.column[k]}, which "
            "contact.tied_edges 'outer' ties: move window.row or window.column inwards, or use a smaller window.cells "
            "or window.margin"
        )


def _require_ungripped(scene: Scene, fabric: Fabric, yarn: np.ndarray, arc: np.ndarray) -> None:
    """Refuse a window whose arcs reach into a grip."""
    gripped = fabric.gripped_arcs(scene.load.direction)
    for one, (low, high) in zip(yarn.tolist(), arc, strict=True):
        ends = gripped.get(one, NO_ARCS)
        if np.any((ends[:, 0] < high) & (ends[:, 1] > low)):
            raise ConfigurationError(
                f"scene {scene.name!r}: the window takes in a part of yarn {one} that is gripped in "
                f"{scene.load.direction} tension: move window.row inwards, or use a smaller window.cells or "
                "window.margin"
            )


def _arcs(fabric: Fabric, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return arcs of yarns (P,) that hold chosen crossings: (P, 2) [m], half the way to those next to them."""
    length = np.array([line.length for line in fabric.centrelines])
    crossings = fabric.crossings[chosen]
    yarn, s = crossings.yarn.ravel(), crossings.arc_length.ravel()
    low, high = piece_bounds(fabric.crossings, length)[chosen].reshape(-1, 2).T
    low = np.where(low == 0, 0.5 * s, low)
    high = np.where(high == length[yarn], 0.5 * (s + high), high)
    order = np.lexsort((s, yarn))
    yarn, low, high = yarn[order], low[order], high[order]
    apart = (yarn[1:] != yarn[:-1]) | (low[1:] != high[:-1])
    begins = np.append(True, apart)
    return yarn[begins], np.column_stack([low[begins], high[np.append(apart, True)]])


def piece_bounds(crossings: Crossings, length: np.ndarray) -> np.ndarray:
    """Return the piece (K, 2, 2) of either yarn that belongs to a crossing: half way to the next along the yarn [m]."""
    yarn, s = crossings.yarn.ravel(), crossings.arc_length.ravel()
    order = np.lexsort((s, yarn))
    middle = 0.5 * (s[order][1:] + s[order][:-1])
    same = yarn[order][1:] == yarn[order][:-1]
    low = np.concatenate([[0.0], np.where(same, middle, 0.0)])
    high = np.concatenate([np.where(same, middle, length[yarn[order][:-1]]), [length[yarn[order][-1]]]])
    bounds = np.empty((len(s), 2))
    bounds[order] = np.stack([low, high], axis=1)
    return bounds.reshape(-1, 2, 2)


def surroundings(scene: Scene, fabric: Fabric, window: Window, contacts: xr.Dataset | None) -> Network:
    """Return the network around a window; it has a node at every cut, and no elements in the solid arcs.

    Contacts are those of the simulation that ``window.springs_from`` names; without them nothing joins yarns that
    touch. Raises ConfigurationError if ties have no size that pins are known for, or springs are not positive.
    """
    outside = np.setdiff1d(np.arange(len(fabric.crossings.row)), window.crossing)
    points = JointPoints.at_crossings(fabric.crossings, outside)
    stops = fabric.grip_ends(scene.load.direction)
    for yarn in np.unique(window.yarn).tolist():
        stops[yarn] = np.append(stops.get(yarn, ()), window.arc[window.yarn == yarn])
    joints = _joints(scene, fabric, points, outside, contacts)
    whole = spatial_network(fabric, points, scene.mesh.beam_size, joints=joints, stops=stops)
    return _without_arcs(whole, window)


def _joints(
    scene: Scene, fabric: Fabric, points: JointPoints, outside: np.ndarray, contacts: xr.Dataset | None
) -> Joints:
    """Return the joints of the beams: pins as compliant as tied patches, and springs or nothing where yarns touch."""
    joints = Joints.all_tied(len(outside))
    tied = tied_crossings(scene, fabric.crossings)[outside]
    every = contacts_of_crossings(fabric, scene.tie.radius).isel(crossing=outside)
    if contacts is not None:
        measured = _measured(scene, contacts, every["normal"].to_numpy())
        joints = replace(joints, stiffness=np.where(tied[:, None, None], joints.stiffness, measured))
    else:
        joints = replace(joints, open=~tied)
    if not tied.any():
        return joints
    radius = scene.tie.radius
    if not SMALLEST <= radius <= LARGEST:
        raise ConfigurationError(
            f"scene {scene.name!r}: tie.radius is {radius:g} but must be from {SMALLEST:g} to {LARGEST:g} where "
            "fidelity is window: beyond, no pins are known that yield as the ties around it do"
        )
    return joints.pinned(patch_stiffness(fabric, points, every, scene.yarn))


ALIKE = 0.9  # cosine between lines of closest points: crossings of one kind have 1, of others 0.4 at most


def _measured(scene: Scene, contacts: xr.Dataset, normal: np.ndarray) -> np.ndarray:
    """Return springs (K, 3, 3) [N/m] at contacts with lines of closest points (K, 3), as measured in a smaller knit."""
    stiffness = springs(contacts, "interface").averaged
    if not np.all(stiffness > 0):
        raise ConfigurationError(
            f"scene {scene.name!r}: window.springs_from is {scene.window.springs_from!r}, whose averaged springs are "
            f"{', '.join(f'{k:.4g}' for k in stiffness)} N/m along x, y, z but must be positive: name another scene"
        )
    # The axes are those of the measurement: of crossings whose line of closest points is the same
    free = ~contacts["tied"].to_numpy().astype(bool)
    alike = normal @ contacts["normal"].to_numpy()[free].T > ALIKE
    along = alike @ contact_normals(contacts)[free]
    along = np.where(alike.any(axis=1, keepdims=True), along, normal)
    axes = spring_axes(along / np.linalg.norm(along, axis=1, keepdims=True), "local")
    return np.einsum("a,kai,kaj->kij", stiffness, axes, axes)


def _without_arcs(whole: Network, window: Window) -> Network:
    """Return a network without the elements and nodes inside of the solid arcs."""
    stations = whole.stations
    first = np.flatnonzero(stations.yarn[1:] == stations.yarn[:-1])
    middle = 0.5 * (stations.arc_length[first] + stations.arc_length[first + 1])
    elements = window.piece(stations.yarn[first], middle) < 0
    kept = np.zeros(len(stations.yarn), dtype=bool)
    kept[first[elements]] = kept[first[elements] + 1] = True
    nodes, place = np.unique(whole.station_node[kept], return_inverse=True)
    renumbered = np.full(len(whole.nodes), -1)
    renumbered[nodes] = np.arange(len(nodes))
    return replace(
        whole,
        nodes=whole.nodes[nodes],
        ends=renumbered[whole.ends[elements]],
        offsets=whole.offsets[elements],
        yarns_side_by_side=whole.yarns_side_by_side[elements],
        stations=stations[kept],
        station_node=place,
        station_offset=whole.station_offset[kept],
        beam_nodes=int(kept.sum()),
        springs=replace(whole.springs, ends=renumbered[whole.springs.ends]),
        curvature=whole.curvature[elements],
    )


def outer_contact(scene: Scene, fabric: Fabric, window: Window, around: Network) -> BeamContact | None:
    """Return the contact of beams outside of the window; None if all of their crossings are tied.

    Raises GeometryError if a piece of yarn has too few nodes for a smooth centreline.
    """
    outside = fabric.crossings[np.setdiff1d(np.arange(len(fabric.crossings.row)), window.crossing)]
    tied = tied_crossings(scene, outside)
    if tied.all():
        return None
    # Chains take the place of yarns; arc lengths stay those of the yarns.
    chain = _chains(around)
    own = replace(outside, yarn=chain[around.stations.nearest(outside.yarn, outside.arc_length)])
    return beam_contact(scene, around, chain, own, tied)


def _chains(around: Network) -> np.ndarray:
    """Return the number (S,) of the chain of beams that every station belongs to; a cut yarn is several."""
    yarn, node, count = around.stations.yarn, around.station_node, len(around.nodes)
    joined = np.zeros(len(yarn), dtype=bool)
    elements = around.ends[:, 0] * count + around.ends[:, 1]
    joined[1:] = (yarn[1:] == yarn[:-1]) & np.isin(node[:-1] * count + node[1:], elements)
    return np.cumsum(~joined) - 1


# Columns of the history with a value for every crossing
OF_CROSSINGS = ("crossing_force", "crossing_displacement", "section_gradient", "section_displacement")


@dataclass(frozen=True, eq=False)
class MixedKnit:
    """A knit of beams with solid yarns in a window, which reports crossings by their numbers in the whole fabric."""

    window: Window
    yarns: SolidYarns  # of the pieces: each solid arc of the window counts as a yarn
    network: Network
    model: SolidsAndBeams
    # (S,) stations of the network, then sections of the pieces, in the order of yarns and arc lengths
    order: np.ndarray
    stations: Stations  # of all yarns, solid or not, in that order
    crossings: int  # K, of the whole fabric

    def record(self, increment: Increment) -> Reported:
        """Return columns of the history, and of the points in contact; nan at crossings outside of the window."""
        state = increment.state
        columns, points = self.yarns.record(state.solids)
        columns |= {name: self.of_all(columns[name]) for name in OF_CROSSINGS}
        outer = self.network.station_displacement(self.model.beams, state.beams)
        stations = np.concatenate([outer, columns["centreline_displacement"]])[self.order]
        columns["centreline_displacement"] = stations
        if points:
            here = points["crossing"]
            points["crossing"] = np.where(here < 0, -1, self.window.crossing[here])
            points |= {name: self.window.yarn[points[name]] for name in ("yarn", "target")}
        force, moment = self.model.seam_forces(state)  # of the solids and of the beams
        columns |= {"seam_force": -force[:, 1], "seam_moment": -moment[:, 1]}
        columns["seam_jump"] = float(np.linalg.norm(force.sum(axis=1), axis=1).max())
        return columns, points

    def of_all(self, values: np.ndarray) -> np.ndarray:
        """Return values (K, ...) of all crossings from those of the window (V, ...)."""
        every = np.full((self.crossings, *values.shape[1:]), np.nan)
        every[self.window.crossing] = values
        return every


def mixed_knit(scene: Scene, fabric: Fabric, contacts: xr.Dataset | None = None) -> MixedKnit:
    """Return the knit of a scene with its window; errors as of `build`."""
    window, touches = window_of(scene, fabric), scene.kind.interaction.touches
    pieces = pieces_of(fabric, window)
    parts = spline_yarns.discretise(scene, pieces)
    # The first three nodes of both end sections (mean and linear moments) are what a beam's node carries.
    first = [[own.first_node[0], own.first_node[-2]] for own in parts.space.yarns]
    section = (parts.space.first_node[:-1, None] + first)[..., None] + np.arange(3)  # (P, 2, 3)
    parts = replace(parts, ends=Grips(section[:, 0].ravel(), section[:, 1].ravel()))
    # All crossings of the window are tied, or all in contact.
    yarns = solids.assemble(scene, pieces, parts, np.full(len(window.crossing), not touches))
    around = surroundings(scene, fabric, window, contacts)
    section = section.reshape(-1, 3)
    cuts = around.station_node[around.stations.nearest(window.yarn[:, None], window.arc)]  # (P, 2)
    seams = Seams(section, cuts.ravel(), parts.nodes[section[:, 1:]])
    outer = outer_contact(scene, fabric, window, around) if touches and contacts is None else None
    beams = around.model(scene.yarn, scene.mesh.section_law, outer)
    model = SolidsAndBeams(yarns.model, beams, seams)
    stations = around.stations.joined(solids.stations_of(parts.mesh, window))
    order = np.lexsort((stations.arc_length, stations.yarn))
    count = len(fabric.crossings.row)
    return MixedKnit(window, yarns, around, model, order, stations[order], count)


def build(scene: Scene, fabric: Fabric, springs: xr.Dataset | None = None) -> Problem:
    """Return a scene with a window as a problem; `springs` are contacts of the scene in ``window.springs_from``.

    Raises ConfigurationError if the window does not lie within the knit, free of grips and, where yarns touch, of ties,
    or the joints around it are not known; GeometryError if two joints of a yarn coincide; MeshError as `spline_yarns`.
    """
    mixed = mixed_knit(scene, fabric, springs)
    model, yarns, window = mixed.model, mixed.yarns, mixed.window
    shown = np.zeros(mixed.crossings, dtype=np.int8)
    shown[window.shown] = 1
    ties = {name: mixed.of_all(values) for name, values in yarns.ties.constants().items()}
    ties["crossing_tied"] = np.nan_to_num(ties["crossing_tied"]).astype(np.int8)
    return loaded(
        scene,
        fabric,
        mixed.network,
        first=model.first_beam,
        model=model,
        observer=mixed,
        settings=settings_of(scene, yarns.touches),
        stations=mixed.stations,
        checks=(partial(require_no_jump, scene),),
        constants={
            "window_crossing": shown,
            **ties,
            "seam_yarn": np.repeat(window.yarn, 2),
            "seam_arc_length": window.arc.ravel(),
        },
        attributes={
            "dof": model.size,
            "solid_unknowns": yarns.model.size,
            "elements": yarns.elements + len(mixed.network.ends),
            **yarns.attributes(),
        },
    )
