"""Pulls a reduced model and records its history, with the solver and the format of the solids."""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.cost import Meter
from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.gates.increment import require_sound
from knitstudy.geometry.pattern import Knit
from knitstudy.history import Recorder
from knitstudy.load_path import load_path
from knitstudy.mechanics.increment import Settings
from knitstudy.mechanics.linear.lu import LU
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.parallel import serial_blas
from knitstudy.networks.rom import honeycomb, rom3d
from knitstudy.networks.rom.grips import gripped_arcs, grips, tension
from knitstudy.networks.rom.joints import Joints, spring_joints
from knitstudy.networks.rom.network import Network
from knitstudy.networks.rom.points import contact_points
from knitstudy.study.scene import Scene

PIN = 10.0
"""Stiffness of pins over E R: a newton moves the pinned points by a tenth of a micrometre."""


def run(scene: Scene, knit: Knit, contacts: xr.Dataset, springs_from: xr.Dataset | None = None) -> xr.Dataset:
    """Return the history of a scene of fidelity "rom2d" or "rom3d".

    Parameters
    ----------
    scene : Scene
        What to load and how.
    knit : Knit
        The knit of the scene.
    contacts : Dataset
        Contacts of the simulation with solid yarns, in the format of docs/architecture.md.
    springs_from : Dataset, optional
        Contacts of the simulation that ``rom.springs_from`` names.

    Raises
    ------
    ConfigurationError
        If the scene asks for springs that the contacts do not give.
    DataFileError
        If the contacts are those of another knit, or not all crossings have one.
    GeometryError
        If no joints can be made of the contacts.
    ConvergenceError
        If the load cannot be reached.
    """
    _require_all_crossings(contacts, knit)
    meter = Meter()
    network = build(scene, knit, contacts, springs_from)
    history = pull(network, scene, knit, meter)
    joints = network.joints
    if joints is None:
        return history
    meaning = {
        "units": "N/m",
        "long_name": "force over displacement of the springs, nan where there are none",
    }
    dims = ("crossing", "xyz", "displacement_xyz")
    return history.assign(joint_stiffness=(dims, joints.stiffness, meaning)).assign_attrs(
        open_crossings=int(joints.open.sum())
    )


def pull(network: Network, scene: Scene, knit: Knit, meter: Meter | None = None) -> xr.Dataset:
    """Return the history of a network under the load of a scene.

    Beside the format of docs/architecture.md it holds `joint_couple`, the sum of `BeamModel.couples`, and
    `joint_couple_magnitude`, the sum of their magnitudes: on a symmetric knit couples cancel.
    """
    meter = meter or Meter()
    model = network.model(scene.yarn.diameter, scene.yarn.youngs_modulus, scene.yarn.poisson_ratio)
    motion = load_path(scene, knit)
    ends = grips(network, knit, scene.load.direction)
    drive = tension(ends, motion, scene.load.lateral)
    driven = 6 * ends.driven[:, None] + np.arange(3)
    recorder = Recorder(network.stations, driven, motion.axis, motion.at, motion.length, meter=meter)
    settings = Settings.of(scene.solver)
    couples, magnitudes = [], []
    with serial_blas():
        for increment in trace(model, drive, settings, LU()):
            recorder.add(increment, network.station_displacement(model, increment.state))
            require_sound(scene, recorder, increment)
            left = model.couples(increment.state)
            couples.append(left.sum(axis=0))
            magnitudes.append(np.linalg.norm(left, axis=1).sum())
    history = recorder.to_dataset(
        scene=scene.name,
        scene_hash=scene.hash,
        fidelity=scene.fidelity,
        interaction=scene.interaction,
        dof=model.block * network.beam_nodes,
        unknowns=model.size - len(drive.fixed),
        elements=len(network.ends),
    )
    meaning = {"units": "N m", "long_name": "couple that the joints leave without balance"}
    magnitude = {"units": "N m", "long_name": "sum of the magnitudes of these couples"}
    return history.assign(
        joint_couple=(("increment", "xyz"), np.array(couples), meaning),
        joint_couple_magnitude=("increment", np.array(magnitudes), magnitude),
    )


def build(scene: Scene, knit: Knit, contacts: xr.Dataset, springs_from: xr.Dataset | None = None) -> Network:
    """Return the network of beams that a scene asks for.

    The planar one joins the yarns at all crossings by shared nodes, whatever the interaction.

    Raises
    ------
    ConfigurationError, DataFileError, GeometryError
        As `run`.
    """
    if scene.fidelity == "rom2d":
        return honeycomb.build(knit, contacts, doubled=scene.rom.section == "doubled")
    points = contact_points(knit, contacts)
    if scene.interaction == "tie":
        joints = Joints.all_tied(len(points.yarn))
    else:
        _require_springs(scene, springs_from)
        rom, each = scene.rom, scene.rom.springs == "zones"
        joints = spring_joints(contacts, rom.displacement, rom.axes, each, springs_from, rom.stiffness)
    if scene.rom.joint == "pinned":
        joints = joints.pinned(PIN * scene.yarn.youngs_modulus * scene.yarn.radius)
    stops = gripped_arcs(knit, scene.load.direction)
    arms = "printed" if scene.rom.joint == "printed" else "rigid"
    return rom3d.build(knit, points, scene.mesh.beam_size, arms, joints, stops)


def _require_all_crossings(contacts: xr.Dataset, knit: Knit) -> None:
    """Refuse contacts that do not describe every crossing of this knit."""
    crossings = knit.crossings
    same = contacts.sizes["crossing"] == len(crossings.row) and all(
        np.array_equal(contacts[name], getattr(crossings, name)) for name in ("row", "column", "zone", "yarn")
    )
    if not same:
        count = contacts.sizes["crossing"]
        raise DataFileError(
            f"the contacts describe {count} crossings that are not the {len(crossings.row)} of a "
            f"{knit.loops} x {knit.rows} knit: contacts and knit must be of the same scene"
        )
    whole = np.isfinite(contacts["centroid"]).all("xyz") & np.isfinite(contacts["normal"]).all("xyz")
    if not whole.all():
        k = int(np.argmin(whole.to_numpy()))
        raise DataFileError(
            f"the contact at row {crossings.row[k]}, column {crossings.column[k]}, zone {crossings.zone[k]} "
            "has no centroid or no normal: a joint needs both"
        )


def _require_springs(scene: Scene, springs_from: xr.Dataset | None) -> None:
    """Refuse to take springs from elsewhere than the scene says."""
    wanted = scene.rom.springs_from
    if (wanted is None) != (springs_from is None):
        raise ConfigurationError(
            f"rom.springs_from of scene {scene.name} is {wanted or 'empty'}, and contacts of another dns scene are "
            f"{'not ' if springs_from is None else ''}given: they must be given where it names one, and only there"
        )
