"""Checks of a history that has ended: energy balance, artificial energies, penetration, balance of forces.

They are computed from the history alone, not by the gates that watch a running simulation.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.knit.loading.gates import FIRST, UNLOADED
from knitstudy.knit.scene.scene import Scene
from knitstudy.measures.response import allowed_penetration, energy_gaps, penetration

# Variables that every history has and that must be finite.
FINITE = ("load", "strain", "force", "reaction", "energy", "centreline_displacement", "residual")
DEEPEST = 0.5  # Penetration over the yarn radius at which the contact of beams has failed


def hourglass_share_when_loaded(history: xr.Dataset) -> float:
    """Return the largest hourglass over internal energy from a tenth of the load on."""
    late = history["energy"].isel(increment=history["load"].to_numpy() >= FIRST)
    return float((late.sel(form="hourglass") / late.sel(form="internal")).max())


def is_unloaded(history: xr.Dataset, scene: Scene) -> bool:
    """Whether the energies of a history are rounding errors, so that their balance has no meaning."""
    energy = float(np.abs(history["energy"]).max())
    return energy <= UNLOADED * scene.yarn.youngs_modulus * scene.yarn.diameter**3


def unbalanced_contact(history: xr.Dataset) -> float:
    """Return the sum of the contact forces on all yarns at full load over the sum of their magnitudes."""
    force = history["yarn_force"].isel(increment=-1).to_numpy()
    magnitudes = np.linalg.norm(force, axis=-1).sum()
    return float(np.linalg.norm(force.sum(axis=0)) / magnitudes) if magnitudes > 0 else 0.0


def faults(history: xr.Dataset, scene: Scene) -> list[str]:
    """Return the errors of a history that ended, a phrase for each, by the limits of the scene's gates."""
    values = {name: history[name].to_numpy() for name in FINITE}
    phrases = [
        f"{name} holds a value that is not a number"
        for name, value in values.items()
        if not np.isfinite(value).all()
    ]
    if phrases:
        return phrases
    if (load := values["load"][-1]) != history.attrs.get("full_load", 1.0):
        phrases.append(f"ends at load factor {load:.6g}")
    if (left := float(history["residual"].max())) > scene.solver.residual_tolerance:
        phrases.append(f"residual {left:.2e}")
    if not is_unloaded(history, scene):
        if (gap := energy_gaps(history)[-1]) > scene.gates.ledger:
            phrases.append(f"energy balance misses {gap:.1%}")
        limit = scene.value("gates.hourglass")
        if limit is not None and (share := hourglass_share_when_loaded(history)) > limit:
            phrases.append(f"hourglass energy {share:.1%}")
    if "smallest_gap" in history:
        known = "penetration_limit" in history.attrs
        deep = penetration(history)
        allowed = allowed_penetration(history) if known else DEEPEST * scene.yarn.radius
        if deep > allowed:
            phrases.append(f"penetration {deep:.2e} m, allowed {allowed:.2e} m")
    return phrases
