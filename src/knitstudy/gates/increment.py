"""All gates that every converged increment has to pass."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from knitstudy.gates.hourglass import require_small_hourglass
from knitstudy.gates.ledger import UNLOADED, require_closed_ledger
from knitstudy.gates.stabilisation import require_small_stabilisation

if TYPE_CHECKING:
    from knitstudy.loading.history import Recorder
    from knitstudy.mechanics.increment import Increment
    from knitstudy.mechanics.model import Response


def require_sound(
    scene: Any, loaded: Callable[[Response], bool] | None, increment: Increment, recorder: Recorder
) -> None:
    """Refuse an increment that has converged to something else than what was asked for.

    Parameters
    ----------
    scene : Scene
    loaded : callable or None
        Whether forces are more than rounding, of solids; until then only the ledger is looked at.
    increment : Increment
    recorder : Recorder
        With the increment as its last one.

    Raises
    ------
    ConvergenceError
        Naming the increment, what is wrong and by how much, and the key that raises its limit.
    """
    allowed, energy, index = scene.gates, increment.response.energy, increment.index
    judged = loaded is not None and loaded(increment.response)
    if judged and energy.get("hourglass"):
        require_small_hourglass(energy, increment.load, index, scene.solver.hourglass, allowed.hourglass)
    if judged and scene.solver.stabilisation > 0:
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
    unloaded = UNLOADED * scene.yarn.youngs_modulus * scene.yarn.diameter**3
    require_closed_ledger(recorder, index, allowed.ledger, unloaded)
