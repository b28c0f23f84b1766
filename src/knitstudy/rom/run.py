"""Pulls a reduced model and records its history, with the solver and the format of the solids."""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.cost import Meter
from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.fem.increment import Drive, Settings
from knitstudy.fem.linear.lu import LU
from knitstudy.fem.newton import trace
from knitstudy.geometry.pattern import Knit
from knitstudy.history import Recorder
from knitstudy.rom import honeycomb, rom3d
from knitstudy.rom.network import Network
from knitstudy.rom.points import contact_points
from knitstudy.scene import Scene

X, Y, Z = range(3)
SPIN_X, SPIN_Y, SPIN_Z = range(3, 6)


def run(scene: Scene, knit: Knit, contacts: xr.Dataset) -> xr.Dataset:
    """Return the history of a scene of fidelity "rom2d" or "rom3d".

    Parameters
    ----------
    scene : Scene
        What to load and how.
    knit : Knit
        The knit of the scene.
    contacts : Dataset
        Contacts of the simulation with solid yarns, in the format of docs/architecture.md.

    Raises
    ------
    ConfigurationError
        If the scene asks for something that beams do not offer.
    DataFileError
        If the contacts are those of another knit, or not all crossings have one.
    GeometryError
        If no joints can be made of the contacts.
    ConvergenceError
        If the load cannot be reached.
    """
    _require_beams(scene)
    _require_all_crossings(contacts, knit)
    meter = Meter()
    return pull(build(scene, knit, contacts), scene, knit.width, meter)


def pull(network: Network, scene: Scene, gauge: float, meter: Meter | None = None) -> xr.Dataset:
    """Return the history of a network of width `gauge` [m] under the load of a scene.

    Beside the format of docs/architecture.md it holds `joint_couple`, the sum of `BeamModel.couples`.
    """
    meter = meter or Meter()
    model = network.model(scene.yarn.diameter, scene.yarn.youngs_modulus, scene.yarn.poisson_ratio)
    travel = scene.load.strain * gauge
    drive = course_tension(network, travel, scene.load.lateral)
    driven = 6 * network.end_nodes("right")[:, None] + [X, Y, Z]
    way = np.array([travel, 0.0, 0.0])
    recorder = Recorder(network.stations, driven, X, lambda load: load * way, gauge, meter=meter)
    settings = Settings.of(scene.solver)
    couples = []
    for increment in trace(model, drive, settings, LU()):
        recorder.add(increment, network.station_displacement(model, increment.state))
        couples.append(model.couples(increment.state).sum(axis=0))
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
    return history.assign(joint_couple=(("increment", "xyz"), np.array(couples), meaning))


def build(scene: Scene, knit: Knit, contacts: xr.Dataset) -> Network:
    """Return the network of beams that a scene asks for."""
    if scene.fidelity == "rom2d":
        return honeycomb.build(knit, contacts)
    return rom3d.build(knit, contact_points(knit, contacts), scene.mesh.beam_size, scene.rom.joint)


def course_tension(network: Network, travel: float, lateral: str) -> Drive:
    """Return the boundary conditions of course tension.

    The left ends are held. The right ends move in x by `travel` [m] and, with `lateral` "fixed", in no other
    way. A face whose points all move by the same u_x cannot tilt either: with `lateral` "free" the ends may
    move in y and z and spin about x, as such a face may.
    """
    left, right = network.end_nodes("left"), network.end_nodes("right")
    held = [X, Y, Z, SPIN_X, SPIN_Y, SPIN_Z] if lateral == "fixed" else [X, SPIN_Y, SPIN_Z]
    driven = 6 * right[:, None] + held
    value = np.zeros(driven.shape)
    value[:, 0] = travel
    clamped = (6 * left[:, None] + np.arange(6)).ravel()
    return Drive(
        fixed=np.concatenate([clamped, driven.ravel()]),
        value=np.concatenate([np.zeros(len(clamped)), value.ravel()]),
    )


def _require_beams(scene: Scene) -> None:
    """Refuse what would otherwise be left out in silence."""
    allowed = {
        "fidelity": (scene.fidelity, ("rom2d", "rom3d")),
        "load.direction": (scene.load.direction, ("course",)),
        "interaction": (scene.interaction, ("tie",)),
        "solver.linear": (scene.solver.linear, ("auto", "lu")),
    }
    for key, (value, values) in allowed.items():
        if value not in values:
            raise ConfigurationError(
                f"{key} is {value!r}: a reduced model of scene {scene.name} allows {' and '.join(values)}"
            )


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
