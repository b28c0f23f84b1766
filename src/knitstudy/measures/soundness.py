"""Whether a history that has ended is what was asked for, judged from its numbers and not by the gates of its run."""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.gates.hourglass import FIRST
from knitstudy.gates.ledger import UNLOADED
from knitstudy.measures.penetration import allowed_penetration, penetration
from knitstudy.study.scene import Scene

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
