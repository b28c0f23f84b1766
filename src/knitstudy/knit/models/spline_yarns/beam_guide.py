"""First guesses for large knits of spline yarns in contact: the displacements of beams in contact under the same load.

The loops of a large knit are slack and close one after the other, at loads that neither the tangent nor the path so far
predicts. Beams predict the closed loops for a tenth of the price. Newton's method of the spline yarns then corrects
sections and contacts, whatever the size of the knit. No result depends on a guess.
"""

from __future__ import annotations

import logging
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from knitstudy.errors import ConfigurationError, KnitstudyError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.loading.history import Stations
from knitstudy.knit.loading.run import ReportProgress, silent
from knitstudy.knit.mesh.sweep import rotation_minimising
from knitstudy.knit.scene.kinds import MODELS
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.yarns.discretisation import fitted_places
from knitstudy.mechanics.rotation import exp, log
from knitstudy.mechanics.spline_yarn.space import Space

# Cells from which beams save more than they cost: a fifth of the time at 10 x 10, a third at 16 x 16, nothing at 6 x 6
LARGE = 64

# The beams: the settings that come nearest to solid yarns; a guess need not be balanced to the last digit
BEAMS = {
    "fidelity": "beam",
    "mesh.beam_size": 5 / 9,
    "mesh.section_law": "curved",
    "beam.section": "hertz",
    "beam.tie": "patch",
    "beam.stiffness": 10.0,
    "solver.residual_tolerance": 1e-3,
    "solver.correction_tolerance": 1e-3,
}

logger = logging.getLogger(__name__)


class BeamGuide:
    """The change of the displacements of spline yarns between two load factors, predicted by beams.

    The first call simulates all increments of the beams, and keeps the motion of their stations.
    """

    def __init__(
        self,
        scene: Scene,  # of the spline yarns
        fabric: Fabric,
        space: Space,
        retained: np.ndarray,  # int (n,), nodes that are unknowns
        report: ReportProgress = silent,
    ) -> None:
        self.scene, self._fabric, self._space, self._retained = scene.vary(BEAMS), fabric, space, retained
        self._report = report
        self._loads: list[float] = []

    def __call__(self, load: float, target: float) -> np.ndarray | None:
        """Return the change (size,) [m] from one load factor to another; None where the beams ended before."""
        if not self._loads:
            self._simulate(load)
        if target > self._loads[-1]:
            return None
        return self._displacement(target) - self._displacement(load)

    def _simulate(self, begun: float) -> None:
        """Follow the load path with beams, as far as possible; spline yarns have reached the load factor `begun`."""
        self._loads, loads, ways = [0.0], [], []
        try:
            problem = MODELS.find("beam").build(self.scene, self._fabric)
            for increment in problem.increments(self._report):
                places = problem.model.contact.places(increment.state)
                moved = places.position - problem.stations.position
                self._report(begun, f"beams predict: load factor {increment.load:.3g}")
                loads.append(increment.load)
                ways.append(np.concatenate([moved, log(places.rotation)], axis=1))
        except KnitstudyError as error:
            # Beyond the range in which beams converge or are verified, spline yarns go on without them.
            logger.info(
                "beams give no guesses beyond load factor %.4g: %s", loads[-1] if loads else 0.0, error
            )
        if loads:
            self.follow(problem.stations, loads, ways)
        logger.info("beams give first guesses up to load factor %.4g", self._loads[-1])

    def follow(self, stations: Stations, loads: list[float], ways: list[np.ndarray]) -> None:
        """Take the ways (S, 6) of stations, displacements [m] and rotation vectors, at rising load factors."""
        self._of_yarn = [np.flatnonzero(stations.yarn == yarn) for yarn in range(len(self._space.yarns))]
        self._arc_length, self._loads, self._ways = stations.arc_length, loads, ways
        # An increment asks for those of the one before again.
        self._displacement = lru_cache(maxsize=3)(self._fitted)

    def _fitted(self, load: float) -> np.ndarray:
        """Return the displacements (size,) [m] of all unknowns at a load factor."""
        way = self._way(load)
        moved = [self._moved(yarn, way[here]) for yarn, here in enumerate(self._of_yarn)]
        return np.concatenate(moved)[self._retained].ravel()

    def _way(self, load: float) -> np.ndarray:
        """Return displacements and rotations (S, 6) at a load factor between two increments of the beams."""
        after = int(np.clip(np.searchsorted(self._loads, load), 1, len(self._loads) - 1))
        low, high = self._loads[after - 1 : after + 1]
        share = (load - low) / (high - low)
        return (1 - share) * self._ways[after - 1] + share * self._ways[after]

    def _moved(self, yarn: int, way: np.ndarray) -> np.ndarray:
        """Return the displacements (m, 3) [m] of the nodes of one yarn, whose sections move by `way` (k, 6)."""
        own, curve = self._space.yarns[yarn], self._fabric.centrelines[yarn]
        s = fitted_places(own)
        shift, turn = np.split(CubicSpline(self._arc_length[self._of_yarn[yarn]], way)(s), 2, axis=1)
        directors = rotation_minimising(curve.position(s), curve.tangent(s))[:, :2]
        turned = directors @ exp(turn).swapaxes(1, 2) - directors
        return own.fitted(s, shift, turned, self._fabric.radius)


def guide_of(
    scene: Scene, fabric: Fabric, space: Space, retained: np.ndarray, report: ReportProgress = silent
) -> BeamGuide | None:
    """Return the guide of a scene; None where beams save no time, or cannot model its yarn or interaction."""
    large = scene.is_knit and scene.pattern.loops * scene.pattern.rows >= LARGE
    if not large or not scene.kind.interaction.touches:
        return None
    try:
        return BeamGuide(scene, fabric, space, retained, report)
    except ConfigurationError as error:
        logger.info("no first guesses by beams: %s", error)
        return None
