"""What a window leaves of every converged increment: what solid yarns leave of its crossings, and forces at seams."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from knitstudy.crossings.section_motion import section_motion
from knitstudy.mechanics.increment import Increment
from knitstudy.window.mixed_knit import MixedKnit


class WindowObserver:
    """Sees crossings by their numbers in the whole knit; nothing is known of those that lie outside of the window.

    Parameters
    ----------
    knit : MixedKnit
    crossings : int
        K, of the whole knit.
    """

    def __init__(self, knit: MixedKnit, crossings: int) -> None:
        self.knit, self.crossings = knit, crossings

    def record(self, increment: Increment) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return columns of the history, and of the points in contact."""
        knit, state = self.knit, increment.state
        yarns, solids = knit.yarns, state.solids
        mesh, tie, facets = yarns.parts.mesh, yarns.tie, yarns.facets
        moved = yarns.model.node_displacement(solids)
        displacement = yarns.parts.sampled(moved)
        force = tie.resultants(increment.response.node_force, moved)
        contact, points = {}, {}
        if yarns.touching is not None:
            contact, points, pushed = yarns.touching.record(_of_solids(increment), len(force))
            force += pushed
        sections = section_motion(facets.crossings, mesh, yarns.parts.sampled(tie.nodes), displacement)
        columns = {
            "centreline_displacement": knit.station_displacement(state, mesh.ring_means(displacement)),
            "crossing_force": self.of_all(force),
            "crossing_displacement": self.of_all(facets.displacement(displacement)),
            "section_gradient": self.of_all(sections.gradient),
            "section_displacement": self.of_all(sections.displacement),
        }
        return columns | contact | self._seams(state), self._named(points)

    def _seams(self, state: Any) -> dict[str, np.ndarray | float]:
        """Return what the beams exert on the solids at the seams, and by how much both sides differ."""
        force, moment = self.knit.model.seam_forces(state)
        return {
            "seam_force": -force[:, 1],
            "seam_moment": -moment[:, 1],
            "seam_jump": float(np.linalg.norm(force.sum(axis=1), axis=1).max()),
        }

    def of_all(self, values: np.ndarray) -> np.ndarray:
        """Return values (K, ...) of all crossings from those of the window (V, ...)."""
        every = np.full((self.crossings, *values.shape[1:]), np.nan)
        every[self.knit.window.crossing] = values
        return every

    def _named(self, points: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the points in contact by crossings and yarns of the whole knit."""
        if not points:
            return {}
        window, here = self.knit.window, points["crossing"]
        crossing = np.where(here < 0, -1, window.crossing[here])
        yarns = {name: window.yarn[points[name]] for name in ("yarn", "target")}
        return points | {"crossing": crossing} | yarns


def _of_solids(increment: Increment) -> Increment:
    """Return an increment as the solids alone would leave it."""
    return replace(increment, state=increment.state.solids)
