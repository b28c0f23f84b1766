"""Checks of a history that has ended: energy ledger, shares of artificial energies, penetration, balance of forces.

They are computed from the history alone, not by the gates that watch a running simulation.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.loading.gates import FIRST, UNLOADED
from knitstudy.study.scene import Scene

OF_FINAL = 0.01  # Energies are compared where the internal energy is this share of its final value or more

# Variables that every history has and that must be finite.
FINITE = ("load", "strain", "force", "reaction", "energy", "centreline_displacement", "residual")

# Penetration of beams over the yarn radius at which their contact has failed; no key of theirs bounds it.
DEEPEST = 0.5


def ledger_gap(history: xr.Dataset) -> float:
    """Return the largest difference of external work and all stored energies over the largest external work."""
    energy = history["energy"]
    external = energy.sel(form="external")
    return float(np.abs(2 * external - energy.sum("form")).max() / np.abs(external).max())


def ledger_gap_at_end(history: xr.Dataset) -> float:
    """Return the same difference at full load."""
    energy = history["energy"]
    external = energy.sel(form="external")
    gap = float(2 * external[-1] - energy[-1].sum("form"))
    return abs(gap) / float(np.abs(external).max())


def hourglass_share(history: xr.Dataset) -> float:
    """Return the largest hourglass over internal energy where the latter is 1% of its final value or more."""
    return _largest_share(history, "hourglass")


def stabilisation_share(history: xr.Dataset) -> float:
    """Return the same ratio of the energy that stabilisation has dissipated."""
    return _largest_share(history, "stabilisation")


def _largest_share(history: xr.Dataset, form: str) -> float:
    internal, other = (history["energy"].sel(form=each) for each in ("internal", form))
    return float((other / internal.where(internal >= OF_FINAL * internal[-1])).max())


def hourglass_share_when_loaded(history: xr.Dataset) -> float:
    """Return the largest hourglass over internal energy from a tenth of the load on."""
    late = history["energy"].isel(increment=history["load"].to_numpy() >= FIRST)
    return float((late.sel(form="hourglass") / late.sel(form="internal")).max())


def penetration(history: xr.Dataset) -> float:
    """Return the deepest penetration, 0 where yarns never touch [m]."""
    return -float(np.fmin.reduce(history["smallest_gap"].to_numpy(), initial=0.0))  # nan: no yarns are near


def allowed_penetration(history: xr.Dataset) -> float:
    """Return the penetration limit of contact: of the penalty method, or of the law of local indentation [m]."""
    law = "indentation_deepest" if "indentation_deepest" in history.attrs else "penetration_limit"
    return float(history.attrs[law])


def penetration_limit(history: xr.Dataset, scene: Scene) -> float:
    """Return the penetration limit of a history: `allowed_penetration`, of beams `DEEPEST` [m]."""
    known = "penetration_limit" in history.attrs
    return allowed_penetration(history) if known else DEEPEST * scene.yarn.radius


def is_unloaded(history: xr.Dataset, scene: Scene) -> bool:
    """Whether the energies of a history are rounding errors, so that their ledger says nothing."""
    energy = float(np.abs(history["energy"]).max())
    return energy <= UNLOADED * scene.yarn.youngs_modulus * scene.yarn.diameter**3


def largest_residual(history: xr.Dataset) -> float:
    """Return the largest residual over the mean internal force of all increments."""
    return float(history["residual"].max())


def unbalanced_contact(history: xr.Dataset) -> float:
    """Return the sum of the contact forces on all yarns at full load over the sum of their magnitudes."""
    force = history["yarn_force"].isel(increment=-1).to_numpy()
    magnitudes = np.linalg.norm(force, axis=-1).sum()
    return float(np.linalg.norm(force.sum(axis=0)) / magnitudes) if magnitudes > 0 else 0.0


def faults(history: xr.Dataset, scene: Scene) -> list[str]:
    """Return what is wrong with a history that ended, one phrase each, by the limits of the scene's gates."""
    values = {name: history[name].to_numpy() for name in FINITE}
    found = [
        f"{name} holds what is no number" for name, value in values.items() if not np.isfinite(value).all()
    ]
    if found:
        return found
    if (load := values["load"][-1]) != 1.0:
        found.append(f"ends at load factor {load:.6g}")
    if (left := largest_residual(history)) > scene.solver.residual_tolerance:
        found.append(f"residual {left:.2e}")
    if not is_unloaded(history, scene):
        if (gap := ledger_gap_at_end(history)) > scene.gates.ledger:
            found.append(f"ledger open by {gap:.1%}")
        limit = scene.value("gates.hourglass")
        if limit is not None and (share := hourglass_share_when_loaded(history)) > limit:
            found.append(f"hourglass energy {share:.1%}")
    if "smallest_gap" in history:
        deep, allowed = penetration(history), penetration_limit(history, scene)
        if deep > allowed:
            found.append(f"penetration {deep:.2e} m, allowed {allowed:.2e} m")
    return found
