"""Reduced models under load: networks of beams, with the loop and the history of the solids."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.gates import require_sound
from knitstudy.loading.history import Meter
from knitstudy.loading.load_path import Motion, load_path
from knitstudy.loading.restart import IN_MEMORY, Run
from knitstudy.loading.solve import Problem, solve_load_path
from knitstudy.mechanics.beam_model import BeamModel
from knitstudy.mechanics.increment import Increment, Settings
from knitstudy.mechanics.linear.direct import LU
from knitstudy.models import honeycomb
from knitstudy.models import network as rom3d
from knitstudy.models.joints import (
    Joints,
    contacts_of_crossings,
    joint_points,
    patch_stiffness,
    spring_joints,
)
from knitstudy.models.network import Network, grips, tension
from knitstudy.study.scene import Scene

PIN = 10.0
"""Stiffness of pins over E R: a newton moves the pinned points by a tenth of a micrometre."""


def simulate(
    scene: Scene,
    geometry: xr.Dataset,
    contacts: xr.Dataset | None = None,
    springs: xr.Dataset | None = None,
    stresses: xr.Dataset | None = None,
    run: Run = IN_MEMORY,
) -> xr.Dataset:
    """Return the history of a scene of fidelity "rom2d" or "rom3d".

    Parameters
    ----------
    scene : Scene
    geometry : Dataset
        Of the scene, in the format of docs/files.md.
    contacts, springs : Dataset, optional
        Contacts of the simulations that ``rom.contacts_from`` and ``rom.springs_from`` name.
    stresses : Dataset, optional
        Stresses of the simulation that ``rom.stress_from`` names.
    run : Run

    Raises
    ------
    ConfigurationError, DataFileError, GeometryError
        As `problem`.
    ConvergenceError, DataFileError
        As `knitstudy.loading.solve.solve_load_path`.
    """
    return solve_load_path(problem(scene, Fabric.from_dataset(geometry), contacts, springs, stresses), run)


def run(
    scene: Scene,
    knit: Fabric,
    contacts: xr.Dataset | None = None,
    springs_from: xr.Dataset | None = None,
    how: Run = IN_MEMORY,
    stresses: xr.Dataset | None = None,
) -> xr.Dataset:
    """Return the history of a scene: `problem`, followed; see `simulate`."""
    return solve_load_path(problem(scene, knit, contacts, springs_from, stresses), how)


def problem(
    scene: Scene,
    knit: Fabric,
    contacts: xr.Dataset | None = None,
    springs_from: xr.Dataset | None = None,
    stresses: xr.Dataset | None = None,
) -> Problem:
    """Return a scene of fidelity "rom2d" or "rom3d" as a problem.

    Parameters
    ----------
    scene : Scene
        What to load and how.
    knit : Fabric
        The knit of the scene.
    contacts : Dataset, optional
        Contacts of the simulation with solid yarns, in the format of docs/files.md; those that the geometry
        predicts where ``rom.contacts_from`` names none.
    springs_from : Dataset, optional
        Contacts of the simulation that ``rom.springs_from`` names.
    stresses : Dataset, optional
        Stresses of the simulation that ``rom.stress_from`` names.

    Raises
    ------
    ConfigurationError
        If the scene asks for springs that the contacts do not give, or for stresses that are not given.
    DataFileError
        If the contacts are those of another knit, or not all crossings have one.
    GeometryError
        If no joints can be made of the contacts.
    """
    meter = Meter()
    if contacts is None:
        contacts = contacts_of_crossings(knit, scene.value("tie.radius") or 0.0)
    _require_all_crossings(contacts, knit)
    return problem_of(assemble(scene, knit, contacts, springs_from, stresses), scene, knit, meter)


def problem_of(network: Network, scene: Scene, knit: Fabric, meter: Meter | None = None) -> Problem:
    """Return a network with the load of a scene."""
    meter = meter or Meter()
    model = network.model(scene.yarn, scene.value("mesh.section_law") or "straight")
    motion = _motion(network, scene, knit)
    ends = grips(network, knit, scene.load.direction)
    joints = network.joints
    return Problem(
        scene=scene,
        model=model,
        prescribed=tension(ends, motion, scene.load.lateral),
        solver=LU(),
        settings=Settings.of(scene.solver),
        motion=motion,
        driven=6 * ends.driven[:, None] + np.arange(3),
        stations=network.stations,
        observers=(NetworkObserver(network, model),),
        checks=(partial(require_sound, scene, None),),
        constants={} if joints is None else {"joint_stiffness": joints.stiffness},
        attributes={
            "dof": model.block * network.beam_nodes,
            "elements": len(network.ends),
            **({} if joints is None else {"open_crossings": int(joints.open.sum())}),
        },
        meter=meter,
    )


@dataclass(frozen=True, eq=False)
class NetworkObserver:
    """Sees the motion of the stations, and the couples that joints leave without balance.

    Their magnitudes are summed as well: on a symmetric knit couples cancel.
    """

    network: Network
    model: BeamModel

    def record(self, increment: Increment) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return columns of the history."""
        couples = self.model.couples(increment.state)
        columns = {
            "centreline_displacement": self.network.station_displacement(self.model, increment.state),
            "joint_couple": couples.sum(axis=0),
            "joint_couple_magnitude": np.linalg.norm(couples, axis=1).sum(),
        }
        return columns, {}


def _motion(network: Network, scene: Scene, knit: Fabric) -> Motion:
    """Return how the grips move: strains refer to the height of the network, where it is not that of the knit."""
    motion = load_path(scene, knit)
    if scene.load.direction == "course" or network.height is None:
        return motion
    scale = network.height / knit.height
    return replace(motion, displacement=scale * motion.displacement, length=scale * motion.length)


def assemble(
    scene: Scene,
    knit: Fabric,
    contacts: xr.Dataset,
    springs_from: xr.Dataset | None = None,
    stresses: xr.Dataset | None = None,
) -> Network:
    """Return the network of beams that a scene asks for.

    The planar one joins the yarns at all crossings by shared nodes, whatever the interaction.

    Raises
    ------
    ConfigurationError, DataFileError, GeometryError
        As `problem`.
    """
    if scene.fidelity == "rom2d":
        if (scene.rom.stress_from is None) != (stresses is None):
            raise ConfigurationError(
                f"rom.stress_from of scene {scene.name} is {scene.rom.stress_from or 'empty'}, and stresses are "
                f"{'not ' if stresses is None else ''}given: they must be where it names a dns scene, and only there"
            )
        return honeycomb.planar_network(knit, contacts, 1, scene.rom.section == "doubled", stresses)
    points = joint_points(knit, contacts)
    if scene.interaction == "tie":
        joints = Joints.all_tied(len(points.yarn))
    else:
        _require_springs(scene, springs_from)
        rom, each = scene.rom, scene.rom.springs == "zones"
        joints = spring_joints(contacts, rom.displacement, rom.axes, each, springs_from, rom.stiffness)
    if scene.rom.joint == "pinned":
        joints = joints.pinned(PIN * scene.yarn.youngs_modulus * scene.yarn.radius)
    elif scene.rom.joint == "patch":
        joints = joints.pinned(patch_stiffness(knit, points, contacts, scene.yarn))
    stops = knit.grip_ends(scene.load.direction)
    arms = "printed" if scene.rom.joint == "printed" else "rigid"
    return rom3d.spatial_network(knit, points, scene.mesh.beam_size, arms, joints, stops)


def _require_all_crossings(contacts: xr.Dataset, knit: Fabric) -> None:
    """Refuse contacts that do not describe every crossing of this knit."""
    crossings = knit.crossings
    same = contacts.sizes["crossing"] == len(crossings.row) and all(
        np.array_equal(contacts[name], getattr(crossings, name)) for name in ("row", "column", "zone", "yarn")
    )
    if not same:
        count = contacts.sizes["crossing"]
        raise DataFileError(
            f"the contacts describe {count} crossings that are not the {len(crossings.row)} of a "
            f"{knit.cells[0]} x {knit.cells[1]} knit: contacts and knit must be of the same scene"
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
