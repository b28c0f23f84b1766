"""Newton's method under dead loads at nodes, which only the closed forms of beam theory need."""

import numpy as np
import scipy.sparse.linalg as spla


def balance(model, load, fixed, steps=1, tolerance=1e-8):
    """Return the state in which a beam model carries the loads (size,), brought up in equal steps.

    Also returns the residual measure of every iteration of the last step. The unknowns `fixed` are held.
    """
    state = model.start()
    for step in range(1, steps + 1):
        state, measures = _newton(model, state, load * step / steps, fixed, tolerance)
    return state, measures


def _newton(model, state, load, fixed, tolerance):
    free = np.setdiff1d(np.arange(model.size), fixed)
    measures = []
    for _ in range(25):
        response = model.respond(state, stiffness=True)
        unbalanced = (load - response.force)[free]
        measures.append(np.max(np.abs(unbalanced / model.scale[free])) / np.max(np.abs(load / model.scale)))
        if measures[-1] <= tolerance:
            return state, measures
        step = np.zeros(model.size)
        step[free] = spla.spsolve(response.stiffness.tocsc()[free][:, free], unbalanced)
        state = model.advance(state, step)
    raise AssertionError(f"no equilibrium: residuals {measures[-3:]}")
