"""Where solids and beams meet there is no jump in force: what either side resists adds up to zero."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from knitstudy.errors import ConvergenceError

if TYPE_CHECKING:
    from knitstudy.loading.history import Recorder
    from knitstudy.mechanics.increment import Increment


def require_no_jump(scene: Any, increment: Increment, recorder: Recorder) -> None:
    """Refuse an increment after which solid and beam disagree on the force between them.

    Raises
    ------
    ConvergenceError
        If the jump is larger than the scene allows of the largest force at a seam.
    """
    jump, limit = recorder.columns["seam_jump"][-1], scene.gates.jump
    largest = float(np.linalg.norm(recorder.columns["seam_force"][-1], axis=-1).max(initial=0.0))
    if jump > limit * largest:
        raise ConvergenceError(
            f"increment {increment.index}: force jumps by {jump:.3g} N where solid yarns and beams meet; the "
            f"largest force there is {largest:.3g} N; gates.jump allows {limit:.0e} of it: use a smaller "
            "solver.residual_tolerance"
        )
