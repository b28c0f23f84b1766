"""The 3D network of a scene: points C where yarns touch, ties, and springs from a direct simulation (Figs. 5 and 6)."""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.loading.solve import Problem
from knitstudy.knit.models.rom3d import SpatialNetwork, SpringKeys, TiedSpatialNetwork
from knitstudy.knit.yarns.joints import CrossingJoints, Springs, joint_points, patch_stiffness, springs
from knitstudy.knit.yarns.network import contacts_of, problem, require_named, spatial_network

PIN = 10.0  # stiffness of pins over E R: a newton moves the pinned points by a tenth of a micrometre


def build(
    scene: TiedSpatialNetwork | SpatialNetwork,
    fabric: Fabric,
    contacts: xr.Dataset | None = None,  # as `rom.contacts_from` says; by default predicted by the geometry
    springs: xr.Dataset | None = None,  # contacts of the simulation that `rom.springs_from` names
) -> Problem:
    """Return a scene with the 3D network as a problem.

    Raises ConfigurationError if the scene asks for springs that the contacts do not give; DataFileError if the contacts
    belong to another fabric, or not all crossings have one; GeometryError if no joints can be made of the contacts.
    """
    rom = scene.rom
    contacts = contacts_of(fabric, contacts, scene.tie if isinstance(scene, TiedSpatialNetwork) else None)
    points = joint_points(fabric, contacts, rom.normal)
    joints = CrossingJoints.all_tied(len(points.yarn))
    if isinstance(rom, SpringKeys):
        require_named(f"rom.springs_from of scene {scene.name}", rom.springs_from, "springs", springs)
        joints = spring_joints(contacts, rom, springs)
    if rom.joint == "pinned":
        joints = joints.pinned(PIN * scene.yarn.youngs_modulus * scene.yarn.radius)
    elif rom.joint == "patch":
        joints = joints.pinned(patch_stiffness(fabric, points, contacts, scene.yarn))
    stops = fabric.grip_ends(scene.load.direction)
    arms = "printed" if rom.joint == "printed" else "rigid"
    beams = spatial_network(fabric, points, scene.mesh.beam_size, arms, joints, stops)
    return problem(scene, fabric, beams, {"joint_off_plane": points.off_plane})


def spring_joints(
    contacts: xr.Dataset,  # of a simulation with contact
    rom: SpringKeys,  # of the scene that is simulated
    springs_from: xr.Dataset | None = None,  # contacts of another simulation whose averaged springs are taken
) -> CrossingJoints:
    """Return the joints of a knit in contact: ties where it is tied, springs where yarns touch at full load.

    Raises ConfigurationError if the average is not positive along all axes; DataFileError if the contacts are not of a
    simulation with contact.
    """
    kind = rom.displacement, rom.axes, rom.normal
    own = springs(contacts, *kind)
    source = contacts if springs_from is None else springs_from
    stiffness = rom.stiffness or _averaged(springs(source, *kind), source)
    matrices = np.einsum("a,kai,kaj->kij", stiffness, own.axes, own.axes)
    return CrossingJoints(own.open, np.where(own.bridged[:, None, None], matrices, np.nan))


def _averaged(measured: Springs, contacts: xr.Dataset) -> tuple[float, ...]:
    """Return the averaged stiffness along x, y and z; refuse one that is not positive."""
    averaged = measured.averaged
    if not np.all(averaged > 0):
        axis = int(np.argmin(np.nan_to_num(averaged, nan=-np.inf)))
        scene = contacts.attrs.get("scene", "the contacts")
        raise ConfigurationError(
            f"the averaged spring of {scene} along {'xyz'[axis]} is {averaged[axis]:.4g} N/m "
            f"({measured.negative[axis]} of {measured.used[axis]} crossings have a negative secant) but must be "
            "positive; rom.axes local, rom.normal normal_resultant or rom.springs_from another scene may help"
        )
    return tuple(averaged)
