"""What a direct simulation leaves of every converged increment: forces at crossings and on yarns, points in contact."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from knitstudy.crossings.record import crossing_forces, touching_points
from knitstudy.crossings.section_motion import section_motion
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.solid import SolidState

if TYPE_CHECKING:
    from knitstudy.solids.dns import Simulation

log = logging.getLogger(__name__)


def record(simulation: Simulation, increment: Increment) -> None:
    """Add a converged increment to the history: motion of centrelines and sections, forces of ties and contact."""
    model, mesh, tie, recorder = simulation.model, simulation.mesh, simulation.tie, simulation.recorder
    state, facets = increment.state, simulation.facets
    displacement = model.node_displacement(state)
    rings = mesh.slice_nodes(np.arange(mesh.slices))[:, mesh.section.ring]
    force = tie.resultants(increment.response.node_force)
    points, columns = None, {}
    if model.contact is not None:
        touching = model.contact_points(state)
        points = touching_points(model.contact, touching, facets)
        force += crossing_forces(points, len(force))
        gap = model.contact.smallest_gap(touching)
        if simulation.beside is not None:
            gap = min(gap, simulation.beside.smallest_gap(tie.nodes + displacement))
        columns = {
            "smallest_gap": gap if np.isfinite(gap) else np.nan,
            "augmentations": state.augmentations,
        }
    stations = displacement[rings].mean(axis=1)
    resultant, moment = yarn_resultants(simulation, increment.response.node_force, displacement, stations)
    sections = section_motion(facets.crossings, mesh, tie.nodes, displacement)
    recorder.add(
        increment,
        stations,
        points,
        crossing_force=force,
        crossing_displacement=facets.displacement(displacement),
        section_gradient=sections.gradient,
        section_displacement=sections.displacement,
        yarn_force=resultant,
        yarn_moment=moment,
        **columns,
    )
    log.info(
        "increment %d: strain %.4f, force %.6g N, %d Newton and %d Krylov iterations, residual %.1e",
        increment.index,
        recorder.columns["strain"][-1],
        recorder.columns["force"][-1],
        increment.newton_iterations,
        increment.krylov_iterations,
        increment.residual,
    )


def yarn_resultants(
    simulation: Simulation, node_force: np.ndarray, displacement: np.ndarray, stations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return net force (Y, 3) [N] and moment (Y, 3) [N m] of all interactions on every yarn (Fig. 10a).

    What the elements of a free node resist is what the interactions supply; grips are left out. Moments are about
    the mean of the yarn's stations.

    Parameters
    ----------
    simulation : Simulation
    node_force : ndarray, shape (N, 3)
        Internal forces of the elements [N].
    displacement : ndarray, shape (N, 3)
        Of the nodes [m].
    stations : ndarray, shape (S, 3)
        Displacement of the slices' centres [m].
    """
    mesh, ends = simulation.mesh, simulation.ends
    force = node_force.copy()
    force[np.concatenate([ends.held, ends.driven])] = 0
    position = simulation.tie.nodes + displacement
    resultant, moment = np.zeros((2, mesh.yarns, 3))
    for yarn in range(mesh.yarns):
        here, slices = mesh.yarn_nodes(yarn), mesh.yarn_of_slice == yarn
        centre = (mesh.centres + stations)[slices].mean(axis=0)
        resultant[yarn] = force[here].sum(axis=0)
        moment[yarn] = np.cross(position[here] - centre, force[here]).sum(axis=0)
    return resultant, moment


def _contact_attributes(simulation: Simulation) -> dict[str, float]:
    """Return what contact was computed with."""
    contact = simulation.model.contact
    if contact is None:
        return {}
    return {
        "facets_around": simulation.mesh.section.ring.size,
        "contact_stiffness": contact.law.normal,
        "stick_stiffness": contact.law.tangential,
        "friction": contact.law.friction,
        "penetration_limit": simulation.model.penetration.limit,
    }


def dataset(simulation: Simulation, state: SolidState) -> xr.Dataset:
    """Return the history so far in the format of docs/architecture.md, with the fields of a state if asked for."""
    scene, mesh, model, tie = simulation.scene, simulation.mesh, simulation.model, simulation.tie
    dataset = simulation.recorder.to_dataset(
        scene=scene.name,
        scene_hash=scene.hash,
        fidelity=scene.fidelity,
        interaction=scene.interaction,
        dof=mesh.nodes.size,
        unknowns=model.size - len(simulation.drive.fixed),
        elements=len(mesh.hexahedra),
        linear_solver=type(getattr(simulation.solver, "preconditioner", simulation.solver)).__name__,
        linear_setups=getattr(simulation.solver, "setups", 0),
        tie_tolerance=tie.tolerance,
        tie_nodes=len(tie.slave),
        tie_largest_adjustment=float(tie.adjustment.max(initial=0.0)),
        **_contact_attributes(simulation),
    )
    dataset["crossing_tied"] = (
        "crossing",
        np.isfinite(tie.area).astype(np.int8),
        {"units": "1", "long_name": "1 where the crossing is tied"},
    )
    dataset["tied_area"] = ("crossing", tie.area, {"units": "m2", "long_name": "tied area"})
    dataset["tied_centroid"] = (
        ("crossing", "xyz"),
        tie.centroid,
        {"units": "m", "long_name": "its centroid"},
    )
    if "fields" in scene.outputs:
        field = model.node_displacement(state)
        dataset["node_displacement"] = (("node", "xyz"), field, {"units": "m", "long_name": "displacement"})
    return dataset
