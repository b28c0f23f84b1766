"""Results as the stages would write them, made up: small, exact, and without a simulation."""

import numpy as np
import xarray as xr

from knitstudy.knit.contacts.segments import KINDS, segments
from knitstudy.knit.geometry.columns import STRESSES
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_dataset
from knitstudy.knit.yarns.joints import spring_axes

TERMS = ("distance", "continuous", "join", "bending", "length", "total")

COST = {"dof": 600, "unknowns": 500, "elements": 90, "memory_growth": 2e6, "memory_peak": 3e8}
COST |= {"wall_seconds": 1.5, "processor_seconds": 1.5}


def history(strain=(0.0, 0.025, 0.05), force=(0.0, 5.0, 10.0), lift=0.0, yarns=2, stations=5, **attributes):
    """History of yarns along x of 10 mm, one above the other, that bulge by `lift` [m] at full load."""
    s = np.linspace(0, 0.01, stations)
    yarn, arc_length = np.repeat(np.arange(yarns), stations), np.tile(s, yarns)
    position = np.column_stack([arc_length, 5e-3 * yarn, 0 * arc_length])
    strain = np.array(strain)
    motion = np.zeros((len(strain), len(yarn), 3))
    motion[-1, :, 2] = lift * np.sin(np.pi * arc_length / 0.01) * (1 + yarn)
    return xr.Dataset(
        {
            "strain": ("increment", strain),
            "displacement": ("increment", 0.01 * strain),
            "force": ("increment", np.array(force, dtype=float)),
            "newton_iterations": ("increment", np.full(len(strain), 3)),
            "krylov_iterations": ("increment", np.full(len(strain), 9)),
            "yarn": ("station", yarn),
            "arc_length": ("station", arc_length),
            "centreline": (("station", "xyz"), position),
            "centreline_displacement": (("increment", "station", "xyz"), motion),
        },
        attrs=COST | attributes,
    )


def history_of(knit, size=2e-3):
    """History whose stations follow the centrelines of a knit, without any motion."""
    s = [np.linspace(0, c.length, int(c.length / size)) for c in knit.centrelines]
    position = np.concatenate([c.position(at) for c, at in zip(knit.centrelines, s, strict=True)])
    yarn = np.repeat(np.arange(len(s)), [len(at) for at in s])
    return xr.Dataset(
        {
            "yarn": ("station", yarn),
            "arc_length": ("station", np.concatenate(s)),
            "centreline": (("station", "xyz"), position),
        },
        attrs={"scene": "rom3d-a", "digest": "0123"},
    )


def geometry(knit: Fabric, flattened=0.5):
    """Geometry of a knit that was optimised from a flatter one."""
    before = knit.loop.control_points * [1.0, 1.0, flattened]
    expected = (2 + knit.loop.clearance) * knit.radius
    state = {
        "penetration": [4e-4, 0.0],
        "gap": [-4e-4, 1.8e-5],
        "other_gap": [1e-3, 1.1e-3],
        "radius_of_curvature": [2e-3, 2.5e-3],
        "loop_length": [40e-3, 40.2e-3],
        "interlock_angle": [60.0, 66.5],
        "leg_angle": [75.0, 80.0],
    }
    return fabric_dataset(knit).assign(
        control_points_before=(("point", "xyz"), before),
        cost=(("state", "term"), np.arange(12.0).reshape(2, 6)),
        crossing_distance=(("state", "cell_zone"), [[expected - 4e-4] * 4, [expected + 1e-8] * 4]),
        state=["before", "after"],
        term=list(TERMS),
        **{name: ("state", values) for name, values in state.items()},
    )


SNAPSHOTS = (0.0, 0.0005, 0.0033, 0.0045, 0.0195, 0.05)
"""Strains of the history of a knit in contact: unloaded, the four that the paper shows, and the last."""

ZONES_BY_SNAPSHOT = ((), (), (0,), (0, 1), (0, 1, 2, 3), (0, 1, 2, 3))
"""Which zones of every cell have touched by then."""


def contact_history(knit: Fabric, interaction="isotropic", friction=0.76, **attributes):
    """History of a knit whose outer rows are tied, and whose other crossings close zone after zone.

    A closed crossing has two points of 1e-8 m2 on each side, 2 mm apart, under 1 MPa times its zone plus one at full
    load; slipping contacts carry `friction` times the pressure along x.
    """
    stations = history_of(knit)
    strain = np.array(SNAPSHOTS)
    position = stations["centreline"].to_numpy()
    motion = strain[:, None, None] * position * [1.0, -0.5, 0.0]
    motion[..., 2] = 4e-3 * strain[:, None] * np.sin(np.pi * position[:, 0] / knit.width)
    points = _points(knit, strain, friction)
    crossings = knit.crossings
    tied = (
        (crossings.row == 0) | (crossings.row == knit.cells[1] - 1)
        if knit.cells[1] > 2
        else 0 * crossings.row
    )
    force = np.zeros((len(strain), len(crossings.row), 3))
    force[:, tied == 1] = strain[:, None, None] * [10.0, 0.0, 5.0]
    increment, crossing = points["contact_increment"][1], points["contact_crossing"][1]
    share = (0.5 * points["contact_area"][1] * np.where(points["contact_side"][1] == 0, 1, -1))[:, None]
    pressure = points["contact_pressure"][1][:, None] * points["contact_normal"][1]
    np.add.at(force, (increment, crossing), share * (pressure + points["contact_traction"][1]))
    place = strain[:, None, None, None] * np.stack([crossings.point[:, 0], crossings.point[:, 1]], axis=1)
    count = len(strain)
    energy = np.zeros((count, 6))
    energy[:, 1] = energy[:, 0] = 1e-3 * strain
    untied = np.where(tied[:, None], crossings.point.mean(axis=1), np.nan)
    return (
        stations.drop_attrs()
        .assign_attrs(scene="dns-a", digest="abcd", interaction=interaction, facets_around=24, **attributes)
        .assign(
            strain=("increment", strain),
            displacement=("increment", knit.width * strain),
            force=("increment", 300 * strain + 200 * np.maximum(strain - 0.0046, 0)),
            energy=(("increment", "form"), energy),
            form=["external", "internal", "hourglass", "penalty", "friction", "stabilisation"],
            newton_iterations=("increment", np.full(count, 4)),
            smallest_gap=("increment", np.full(count, -1e-7)),
            centreline_displacement=(("increment", "station", "xyz"), motion),
            crossing_force=(("increment", "crossing", "xyz"), force),
            crossing_displacement=(("increment", "crossing", "side", "xyz"), place),
            crossing_tied=("crossing", tied.astype(np.int8)),
            tied_area=("crossing", np.where(tied, 1e-7, np.nan)),
            tied_centroid=(("crossing", "xyz"), untied),
            yarn_force=(("increment", "yarn_number", "xyz"), np.zeros((count, knit.cells[1] + 1, 3))),
            yarn_moment=(("increment", "yarn_number", "xyz"), np.zeros((count, knit.cells[1] + 1, 3))),
            **points,
        )
    )


def _points(knit, strain, friction):
    """Points of all closed crossings that are not tied, one increment after another."""
    crossings = knit.crossings
    inner = (
        (crossings.row > 0) & (crossings.row < knit.cells[1] - 1) if knit.cells[1] > 2 else crossings.row >= 0
    )
    closed = [np.flatnonzero(inner & np.isin(crossings.zone, zones)) for zones in ZONES_BY_SNAPSHOT]
    increment = np.repeat(np.arange(len(strain)), [4 * len(each) for each in closed])
    crossing = np.repeat(np.concatenate(closed), 4)
    side, place = np.tile([0, 0, 1, 1], len(crossing) // 4), np.tile([0, 1], len(crossing) // 2)
    apart = np.diff(crossings.point, axis=1)[:, 0] / crossings.distance[:, None]
    middle = crossings.point.mean(axis=1)[crossing] + (place * 2e-3 - 1e-3)[:, None] * [1.0, 0.0, 0.0]
    pressure = 1e6 * (1 + crossings.zone[crossing]) * strain[increment] / strain[-1]
    slips = crossings.zone[crossing] > 1
    traction = np.where(slips, friction * pressure, 0.0)[:, None] * [1.0, 0.0, 0.0]
    traction *= np.where(side == 0, 1.0, -1.0)[:, None]
    columns = {
        "increment": increment,
        "crossing": crossing,
        "side": side,
        "yarn": crossings.yarn[crossing, side],
        "target": crossings.yarn[crossing, 1 - side],
        "area": np.full(len(crossing), 1e-8),
        "cell_area": np.full(len(crossing), 9e-8),
        "pressure": pressure,
        "gap": np.full(len(crossing), -1e-8),
        "slip": np.where(slips, 1e-5, 0.0),
        "sticks": (~slips).astype(np.int8),
    }
    vectors = {
        "position": middle * (1 + strain[increment, None]),
        "reference": middle,
        "normal": np.where(side == 0, -1.0, 1.0)[:, None] * apart[crossing],
        "traction": traction,
    }
    cell = np.stack([10 * crossing + place, np.where(place, 23, 0)], axis=1)
    return (
        {f"contact_{name}": ("point", values) for name, values in columns.items()}
        | {f"contact_{name}": (("point", "xyz"), values) for name, values in vectors.items()}
        | {"contact_cell": (("point", "grid"), cell)}
    )


def contacts_with_springs(contacts, stiffness, axes="global"):
    """Contacts of a 3 x 3 knit whose middle row touches from the second of three states on, with given springs.

    The sides of a crossing move apart evenly in time, each crossing in its own direction; the force grows from first
    contact on with the displacement since then times `stiffness` (3,) [N/m] along `axes`. Other rows are tied.
    """
    count = contacts.sizes["crossing"]
    tied = contacts["row"].to_numpy() != 1
    end = 1e-5 * np.random.default_rng(3).uniform(0.5, 1.5, size=(count, 3))
    displacement = np.linspace(0, 1, 3)[:, None, None] * end
    unit = spring_axes(contacts["normal"].to_numpy(), axes)
    force = np.einsum(
        "kai,a,kaj,tkj->tki", unit, stiffness, unit, np.maximum(displacement - displacement[1], 0)
    )
    size = np.linalg.norm(force, axis=-1, keepdims=True)
    direction = -force / np.where(size == 0, 1, size)
    zones = np.ones((3, count), dtype=int)
    zones[0, ~tied] = 0
    return contacts.assign(
        tied=("crossing", tied.astype(np.int8)),
        zones=(("increment", "crossing"), zones),
        force=(("increment", "crossing", "xyz"), force),
        resultant_direction=(("increment", "crossing", "xyz"), np.where(size == 0, np.nan, direction)),
        relative_displacement=(("increment", "crossing", "xyz"), displacement),
    )


def with_kinematics(contacts):
    """Contacts whose sections turn and whose crossings slide, spin and come closer in proportion to the strain.

    At 5% strain by 0.1 rad, 0.1 mm, 0.2 rad and 1% of the chord to the crossing before; the one after goes away.
    """
    share = contacts["strain"] / 0.05
    each = xr.zeros_like(contacts["arc_length"]) + share
    each = each.transpose("increment", "crossing", "side")
    values = each.to_numpy()
    vectors, neighbours = values[..., None] * [0.06, 0.0, 0.08], values[..., None] * [0.01, -0.02]
    touching = contacts["zones"].to_numpy()[..., None] > 0
    dims = each.dims
    return contacts.assign(
        section_rotation=((*dims, "xyz"), vectors),
        relative_rotation=(("increment", "crossing", "xyz"), np.zeros_like(vectors[:, :, 0])),
        segment_contraction=((*dims, "neighbour"), neighbours),
        sliding=(dims, np.where(touching, 1e-4 * values * [1.0, -0.9], np.nan)),
        contact_travel=(dims, np.where(touching, 1e-4 * values * [1.0, -0.9], np.nan)),
        contact_spin=(dims, np.where(touching, 0.2 * values, np.nan)),
    )


LEANING = {
    "head": 0,
    "interlock, left": 1,
    "interlock, right": -1,
    "leg, left": -1,
    "leg, right": 1,
    "sinker": 0,
}
"""To which side segments lean: 0 lies along x."""


def stresses(knit: Fabric, direction, interlock, leg, mesh=None, force=10.0):
    """Stresses of 1 MPa along lines at given angles to x [deg] in all segments; with a mesh in its cells, along x."""
    cut = segments(knit.crossings, np.array([each.length for each in knit.centrelines]))
    angle = {"interlock": interlock, "leg": leg}
    turn = [np.radians(LEANING[kind] * angle.get(kind.split(",")[0], 0.0)) for kind in KINDS]
    turn = np.array(turn)[cut.kind]
    axis = np.zeros((len(turn), 2, 3, 3))
    axis[:, :, 2, 2] = 1
    axis[:, :, 0, :2] = np.column_stack([np.cos(turn), np.sin(turn)])[:, None]
    axis[:, :, 1, :2] = np.column_stack([-np.sin(turn), np.cos(turn)])[:, None]
    principal = np.zeros(axis.shape[:3])
    principal[..., 0] = 1e6
    values = {
        "piece_yarn": cut.yarn,
        "piece_arc_length": cut.arc_length,
        "piece_segment": cut.of_piece,
        "piece_stress": np.zeros((len(cut.yarn), 2, 3, 3)),
        "piece_volume": np.ones((len(cut.yarn), 2)),
        "segment_kind": cut.kind,
        "segment_row": cut.row,
        "segment_column": cut.column,
        "segment_central": cut.central.astype(np.int8),
        "segment_stress": 1e6 * axis[:, :, 0, :, None] * axis[:, :, 0, None],
        "segment_volume": np.ones(axis.shape[:2]),
        "segment_principal": principal,
        "segment_axis": axis,
        "segment_rotation": np.tile(np.eye(3), (len(turn), 1, 1)),
    }
    if mesh is not None:
        cells = mesh.nodes[mesh.hexahedra]
        values |= {
            "cell_stress": np.tile([1e6, 0, 0, 0, 0, 0], (len(cells), 1)),
            "cell_volume": np.ones(len(cells)),
            "cell_place": cells.mean(axis=1),
            "cell_yarn": mesh.yarn_of_slice[mesh.slice_of_element],
        }
    return xr.Dataset(
        STRESSES.variables(values),
        coords={"extent": ["whole", "middle"]},
        attrs={"strain": 0.05, "force": force, "direction": direction},
    )


def flowing(stresses, history, contacts, radius, at_contact=18.0, elsewhere=8.0, pressed=0.0):
    """Stresses with a cell of 1 MPa at every station, along lines that leave the yarn by angles [deg].

    Beside it lies a cell that is pressed along the yarn by `pressed` times as much: what bending does.
    """
    place = history["centreline"].to_numpy() + history["centreline_displacement"].to_numpy()[-1]
    yarn, s = history["yarn"].to_numpy(), history["arc_length"].to_numpy()
    tangent = np.empty_like(place)
    near = np.zeros(len(s), dtype=bool)
    free = contacts["tied"].to_numpy() == 0
    owner, crossing = (contacts[name].to_numpy()[free] for name in ("yarn", "arc_length"))
    for number in np.unique(yarn):
        here = yarn == number
        tangent[here] = np.gradient(place[here], axis=0)
        apart = np.abs(s[here, None] - crossing[owner == number]).min(axis=1, initial=np.inf)
        near[here] = apart < 1.6 * radius
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    across = np.cross(tangent, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    angle = np.radians(np.where(near, at_contact, elsewhere))[:, None]
    line = np.cos(angle) * tangent + np.sin(angle) * across
    pulled, pushed = (np.einsum("ki,kj->kij", each, each) for each in (line, tangent))
    tensor = 1e6 * np.concatenate([pulled, -pressed * pushed])
    values = {
        "cell_stress": tensor[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]],
        "cell_volume": np.ones(2 * len(s)),
        "cell_place": np.tile(place, (2, 1)),
        "cell_yarn": np.tile(yarn, 2),
    }
    return stresses.assign(STRESSES.variables(values))


LINEAR = {"along": 500.0, "across": 800.0, "contraction": 0.4, "shear": 60.0}  # stiffnesses [N/m]


def fabric_cell(other, direction, strain=0.5, **changed):
    """Cell of a fabric with W = along e^2 / 2 + across (l + contraction e)^2 / 2 + shear g^2 / 2."""
    law = LINEAR | changed
    e, zero = np.linspace(0, strain, 21), np.zeros(21)
    across = zero if other == "held" else -law["contraction"] * e
    pressed = law["across"] * (across + law["contraction"] * e)
    strains, forces = (e, across), (law["along"] * e + law["contraction"] * pressed, pressed)
    if direction == "wale":
        strains, forces = strains[::-1], forces[::-1]
    values = {"cell_strain": (*strains, zero), "force_per_width": (*forces, zero)}
    if direction == "shear":
        values = {"cell_strain": (zero, zero, e), "force_per_width": (zero, zero, law["shear"] * e)}
    return xr.Dataset(
        {name: (("increment", "form"), np.stack(each, axis=1)) for name, each in values.items()}
    )
