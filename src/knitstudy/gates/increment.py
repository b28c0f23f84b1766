"""All gates that every converged increment has to pass."""

from __future__ import annotations

from typing import Any

import numpy as np

from knitstudy.gates.hourglass import require_small_hourglass
from knitstudy.gates.ledger import require_closed_ledger
from knitstudy.gates.stabilisation import require_small_stabilisation
from knitstudy.history import Recorder
from knitstudy.mechanics.increment import Increment


def require_sound(scene: Any, recorder: Recorder, increment: Increment, loaded: bool = True) -> None:
    """Refuse an increment that has converged to something else than what was asked for.

    Parameters
    ----------
    scene : Scene
    recorder : Recorder
        With the increment as its last one.
    increment : Increment
    loaded : bool
        Whether forces are more than rounding; until then only the ledger is looked at.

    Raises
    ------
    ConvergenceError
        Naming the increment, what is wrong and by how much, and the key that raises its limit.
    """
    allowed, energy, index = scene.gates, increment.response.energy, increment.index
    if loaded and "hourglass" in energy:
        require_small_hourglass(energy, increment.load, index, scene.solver.hourglass, allowed.hourglass)
    if loaded and getattr(scene.solver, "stabilisation", 0) > 0:
        require_small_stabilisation(
            energy,
            increment.response.viscous_force,
            float(np.linalg.norm(recorder.columns["reaction"][-1])),
            increment.load,
            index,
            scene.solver.stabilisation,
            allowed.stabilisation,
            allowed.viscous_force,
        )
    require_closed_ledger(recorder, index, allowed.ledger)
