"""What a direct simulation leaves of every converged increment: forces at crossings and on yarns, points in contact."""

from __future__ import annotations

from typing import Any

import numpy as np

from knitstudy.crossings.section_motion import section_motion
from knitstudy.mechanics.increment import Increment
from knitstudy.solids.solid_yarns import SolidYarns


class SolidObserver:
    """Sees the motion of centrelines and sections, and the forces of ties and contact.

    Parameters
    ----------
    yarns : SolidYarns
    """

    def __init__(self, yarns: SolidYarns) -> None:
        self.yarns = yarns

    def record(self, increment: Increment) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return columns of the history, and of the points in contact."""
        yarns, state = self.yarns, increment.state
        mesh, tie, facets = yarns.parts.mesh, yarns.tie, yarns.facets
        moved = yarns.model.node_displacement(state)
        displacement = yarns.parts.sampled(moved)
        force = tie.resultants(increment.response.node_force, moved)
        contact, points = {}, {}
        if yarns.touching is not None:
            contact, points, pushed = yarns.touching.record(increment, len(force))
            force += pushed
        stations = mesh.ring_means(displacement)
        resultant, moment = yarn_resultants(yarns, increment.response.node_force, moved, stations)
        sections = section_motion(facets.crossings, mesh, yarns.parts.sampled(tie.nodes), displacement)
        columns = {
            "centreline_displacement": stations,
            "crossing_force": force,
            "crossing_displacement": facets.displacement(displacement),
            "section_gradient": sections.gradient,
            "section_displacement": sections.displacement,
            "yarn_force": resultant,
            "yarn_moment": moment,
        }
        return columns | contact, points


def yarn_resultants(
    yarns: SolidYarns, node_force: np.ndarray, displacement: np.ndarray, stations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return net force (Y, 3) [N] and moment (Y, 3) [N m] of all interactions on every yarn (Fig. 10a).

    What the elements of a free node resist is what the interactions supply; grips are left out. Moments are about
    the mean of the yarn's stations.

    Parameters
    ----------
    yarns : SolidYarns
    node_force : ndarray, shape (N, 3)
        Internal forces of the elements [N].
    displacement : ndarray, shape (N, 3)
        Of the nodes [m].
    stations : ndarray, shape (S, 3)
        Displacement of the slices' centres [m].
    """
    mesh, ends, unity = yarns.parts.mesh, yarns.parts.ends, yarns.parts.unity
    force = node_force.copy()
    force[np.concatenate([ends.held, ends.driven])] = 0
    position = yarns.tie.nodes + displacement
    resultant, moment = np.zeros((2, mesh.yarns, 3))
    for yarn in range(mesh.yarns):
        here, slices = yarns.parts.nodes_of(yarn), mesh.yarn_of_slice == yarn
        centre = (mesh.centres + stations)[slices].mean(axis=0)
        resultant[yarn] = unity[here] @ force[here]
        moment[yarn] = np.cross(position[here] - unity[here, None] * centre, force[here]).sum(axis=0)
    return resultant, moment
