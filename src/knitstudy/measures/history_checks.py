"""Checks of a history: energy ledger, penetration, balance of forces."""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.loading.gates import FIRST, UNLOADED
from knitstudy.study.scene import Scene

# ---- The ledger of energies of a history, and shares of what is no energy of the yarns


OF_FINAL = 0.01
"""Energies are compared wherever the internal energy is this share of its final value or more."""


def ledger_gap(history: xr.Dataset) -> float:
    """Return the largest difference of external work and all stored energies, over the largest external work."""
    energy = history["energy"]
    external = energy.sel(form="external")
    return float(np.abs(2 * external - energy.sum("form")).max() / np.abs(external).max())


def hourglass_share(history: xr.Dataset) -> float:
    """Return the largest share of hourglass energy wherever internal energy is 1% of its final value or more."""
    return _largest_share(history, "hourglass")


def stabilisation_share(history: xr.Dataset) -> float:
    """Return the same of what stabilisation has dissipated so far."""
    return _largest_share(history, "stabilisation")


def _largest_share(history: xr.Dataset, form: str) -> float:
    internal, other = (history["energy"].sel(form=each) for each in ("internal", form))
    return float((other / internal.where(internal >= OF_FINAL * internal[-1])).max())


# ---- How deep yarns are in each other


def penetration(history: xr.Dataset) -> float:
    """Return the deepest penetration of a history, 0 where yarns only ever approach [m]."""
    return -float(np.fmin.reduce(history["smallest_gap"].to_numpy(), initial=0.0))  # nan: nothing is near


def allowed_penetration(history: xr.Dataset) -> float:
    """Return how deep contact lets yarns be in each other: by a penalty, or where its law of indentation ends [m]."""
    law = "indentation_deepest" if "indentation_deepest" in history.attrs else "penetration_limit"
    return float(history.attrs[law])


# ---- Whether a history that has ended is what was asked for, judged from its numbers and not by the gates of its run


FINITE = ("load", "strain", "force", "reaction", "energy", "centreline_displacement", "residual")
"""Variables that are numbers in every history, whatever happens."""

DEEPEST = 0.5
"""Penetration of beams over the yarn radius at which their contact has failed: no key of theirs bounds it."""


def is_unloaded(history: xr.Dataset, scene: Scene) -> bool:
    """Whether the energies of a history are rounding: nothing is said of their ledger then."""
    energy = float(np.abs(history["energy"]).max())
    return energy <= UNLOADED * scene.yarn.youngs_modulus * scene.yarn.diameter**3


def left_open(history: xr.Dataset) -> float:
    """Return by how much the ledger is open at full load, over the largest external work; see `gates.ledger`."""
    energy = history["energy"]
    external = energy.sel(form="external")
    gap = float(2 * external[-1] - energy[-1].sum("form"))
    return abs(gap) / float(np.abs(external).max())


def unbalanced(history: xr.Dataset) -> float:
    """Return the largest force that no other balances, over the mean internal force, of all increments."""
    return float(history["residual"].max())


def unbalanced_contact(history: xr.Dataset) -> float:
    """Return what the forces of contact on all yarns add up to at full load, over the sum of their magnitudes."""
    force = history["yarn_force"].isel(increment=-1).to_numpy()
    magnitudes = np.linalg.norm(force, axis=-1).sum()
    return float(np.linalg.norm(force.sum(axis=0)) / magnitudes) if magnitudes > 0 else 0.0


def faults(history: xr.Dataset, scene: Scene) -> list[str]:
    """Return what is wrong with a history that ended, one phrase each; nothing where it is sound.

    Parameters
    ----------
    history : Dataset
        In the format of docs/architecture.md.
    scene : Scene
        That it is of, with the limits of its gates.
    """
    values = {name: history[name].to_numpy() for name in FINITE}
    found = [
        f"{name} holds what is no number" for name, value in values.items() if not np.isfinite(value).all()
    ]
    if found:
        return found
    if (load := values["load"][-1]) != 1.0:
        found.append(f"ends at load factor {load:.6g}")
    if (left := unbalanced(history)) > scene.solver.residual_tolerance:
        found.append(f"residual {left:.2e}")
    if not is_unloaded(history, scene):
        if (gap := left_open(history)) > scene.gates.ledger:
            found.append(f"ledger open by {gap:.1%}")
        limit = scene.value("gates.hourglass")
        if limit is not None and (share := hourglass(history)) > limit:
            found.append(f"hourglass energy {share:.1%}")
    if "smallest_gap" in history and (deep := penetration(history)) > (limit := allowed(history, scene)):
        found.append(f"penetration {deep:.2e} m, allowed {limit:.2e} m")
    return found


def allowed(history: xr.Dataset, scene: Scene) -> float:
    """Return how deep yarns may be in each other: as contact allows, beams by `DEEPEST` [m]."""
    known = "penetration_limit" in history.attrs
    return allowed_penetration(history) if known else DEEPEST * scene.yarn.radius


def hourglass(history: xr.Dataset) -> float:
    """Return the largest share of hourglass energy from a tenth of the load on."""
    late = history["energy"].isel(increment=history["load"].to_numpy() >= FIRST)
    return float((late.sel(form="hourglass") / late.sel(form="internal")).max())
