"""Every simulation of a knit: its response and cost, and what the direct ones stand on."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.cost import MEGABYTE, element_length
from knitstudy.measures.history_checks import (
    allowed_penetration,
    hourglass_share,
    ledger_gap,
    penetration,
    stabilisation_share,
)
from knitstudy.measures.response import (
    at_strain,
    largest_out_of_plane,
    poisson_ratio,
    secant_stiffness,
    tangent_stiffness,
)
from knitstudy.measures.selection import ISOTROPIC_COURSE, ISOTROPIC_WALE, TIED_COURSE, TIED_WALE
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

# ---- One row for every simulation of a knit: what it is, how it responds, and what it cost


STRAINS = (0.01, 0.03, 0.05)
"""Strains at which forces are listed."""

DISSIPATED = ("friction", "stabilisation")


@TABLES.add(
    "responses",
    "Every simulation of a knit",
    needs=("every", "scenes"),
    order=9,
)
def tabulate_responses(every: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return one row a simulation; what a model has no key or no result for is empty.

    Stiffnesses are those of a cloth: force per width over strain at the largest strain, secant and tangent. The width
    is that across the load, the height of the knit (rows times course spacing) in course tension and its width (loops
    times wale spacing) in wale tension; energies are over the product of the two. `poisson_ratio` says what contracts.

    Parameters
    ----------
    every : mapping of str to Dataset
        Histories of knits by scene (see docs/files.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    return pd.DataFrame([_row(scenes[name], history) for name, history in every.items()])


def _row(scene: Scene, history: xr.Dataset) -> dict:
    return {"scene": scene.name} | _keys(scene, history) | _response(scene, history) | _cost(history)


def _keys(scene: Scene, history: xr.Dataset) -> dict:
    """Return what the simulation is: only keys that scenes of its kind have."""
    size = scene.value("mesh.size") or scene.value("mesh.beam_size") or element_length(history)
    return {
        "specimen": f"{scene.pattern.loops} x {scene.pattern.rows} knit",
        "fidelity": scene.fidelity,
        "interaction": scene.interaction,
        "direction": scene.load.direction,
        "tied edges": scene.value("contact.tied_edges"),
        "friction coefficient [1]": scene.value("contact.friction"),
        "contact stiffness over E / h [1]": scene.value("contact.normal_stiffness"),
        "augmentations allowed [1]": scene.value("contact.augmentations"),
        "contacts from": scene.value("rom.contacts_from"),
        "joint": scene.value("rom.joint"),
        "springs": _springs(scene),
        "springs from": _springs_from(scene),
        "axes of springs": scene.value("rom.axes"),
        "displacement of springs": scene.value("rom.displacement"),
        "section law": scene.value("mesh.section_law"),
        "segment of two yarns": scene.value("rom.section"),
        "honeycomb": scene.value("rom.honeycomb"),
        "principal stress from": scene.value("rom.stress_from"),
        "beam section": scene.value("beam.section"),
        "beam ties": scene.value("beam.tie"),
        "mesh size [m]": size,
    }


def _springs(scene: Scene) -> str | None:
    """Return whether springs are averaged or of each crossing's own, or their given stiffnesses."""
    given = " ".join(f"{each:g}" for each in scene.value("rom.stiffness") or ())
    return f"{given} N/m" if given else scene.value("rom.springs")


def _springs_from(scene: Scene) -> str | None:
    """Return the simulation that springs are measured in."""
    if scene.value("rom.springs") is None or scene.rom.stiffness:
        return None
    return scene.rom.springs_from or scene.rom.contacts_from


def _response(scene: Scene, history: xr.Dataset) -> dict:
    reached, force = float(history["strain"][-1]), history["force"].to_numpy()
    pattern, direction = scene.pattern, scene.load.direction
    height, width = _size(scene, history)
    along, across = (width, height) if direction == "course" else (height, width)
    energy = history["energy"].isel(increment=-1)
    forces = {
        f"force at {strain:.0%} strain [N]": at_strain(history, strain, force)
        if strain <= 1.001 * reached
        else np.nan
        for strain in STRAINS
    }
    return {
        "strain reached [1]": reached,
        **forces,
        "width across the load [m]": across,
        "force per width [N/m]": force[-1] / across,
        "secant stiffness, force per width [N/m]": secant_stiffness(history) * along / across,
        "tangent stiffness, force per width [N/m]": tangent_stiffness(history) * along / across,
        "Poisson's ratio [1]": poisson_ratio(history, direction, pattern.loops),
        "largest |u_z| [m]": largest_out_of_plane(history),
        "internal energy per area [J/m2]": float(energy.sel(form="internal")) / (width * height),
        "dissipated energy per area [J/m2]": float(energy.sel(form=list(DISSIPATED)).sum())
        / (width * height),
    }


def _size(scene: Scene, history: xr.Dataset) -> tuple[float, float]:
    """Return height and width of a knit [m]; a wale spacing that follows from the yarn's length shows in the strain."""
    pattern = scene.pattern
    height = pattern.rows * pattern.course_ratio * pattern.course_spacing
    if pattern.keep != "length":
        return height, pattern.loops * pattern.wale_spacing
    in_course = scene.load.direction == "course"
    return height, float(history["displacement"][-1] / history["strain"][-1]) if in_course else np.nan


def _cost(history: xr.Dataset) -> dict:
    cost = history.attrs
    return {
        "degrees of freedom [1]": int(cost["dof"]),
        "unknowns [1]": int(cost["unknowns"]),
        "time [s]": cost["wall_seconds"],
        "memory growth [MB]": cost["memory_growth"] / MEGABYTE,
        "increments [1]": history.sizes["increment"] - 1,
        "Newton iterations [1]": int(history["newton_iterations"].sum()),
    }


# ---- What a direct simulation stands on: ties, contact, convergence and its ledger of energies, with bars


Row = tuple[str, str, float, float]
"""Quantity, unit, value and bar."""


LEDGER = 0.01
"""Largest gap of the ledger over the largest external work."""

HOURGLASS = 0.05
"""Largest share of hourglass energy in the internal energy."""


STABILISATION, STABILISATION_AT_END = 0.05, 0.01
"""Largest share of what stabilisation dissipates in internal energy, on the way and at full load."""


@TABLES.add(
    "simulation",
    "What the direct simulations stand on: ties, course tension",
    needs=("dns", "scenes"),
    of=TIED_COURSE,
    order=10,
)
@TABLES.add(
    "simulation_contact",
    "What they stand on: friction, course tension",
    needs=("dns", "scenes"),
    of=ISOTROPIC_COURSE,
    order=11,
)
@TABLES.add(
    "simulation_wale",
    "What they stand on: ties, wale tension",
    needs=("dns", "scenes"),
    of=TIED_WALE,
    order=12,
)
@TABLES.add(
    "simulation_contact_wale",
    "What they stand on: friction, wale tension",
    needs=("dns", "scenes"),
    of=ISOTROPIC_WALE,
    order=13,
)
def tabulate_checks(dns: xr.Dataset, scenes: dict[str, Scene]) -> pd.DataFrame:
    """Return one quantity a row, with its unit and its bar where it has one.

    Parameters
    ----------
    dns : Dataset
        History of a direct simulation (see docs/files.md).
    scenes : dict of str to Scene
        By fidelity; "dns" is read.
    """
    scene = scenes["dns"]
    rows = [*_ties(dns), *_solution(dns, scene), *(_contact(dns) if "smallest_gap" in dns else ())]
    return pd.DataFrame(
        [(name, unit, float(value), bar) for name, unit, value, bar in rows],
        columns=["quantity", "unit", "value", "bar"],
    )


def _ties(dns: xr.Dataset) -> list[Row]:
    area = dns["tied_area"]
    said = (  # by the rule of the ties, one or the other
        ("radius of the ties", "m", "tie_radius"),
        ("least stiffness of a tie", "N/m", "tie_least_stiffness"),
        ("tied nodes", "1", "tie_nodes"),
    )
    return [
        *((name, unit, dns.attrs[key], np.nan) for name, unit, key in said if key in dns.attrs),
        ("tied area of a crossing, smallest", "m2", area.min(), np.nan),
        ("tied area of a crossing, largest", "m2", area.max(), np.nan),
    ]


def _solution(dns: xr.Dataset, scene: Scene) -> list[Row]:
    residual, correction = scene.solver.residual_tolerance, scene.solver.correction_tolerance
    return [
        ("largest residual over mean internal force", "1", dns["residual"].max(), residual),
        ("largest last correction over element size", "1", dns["correction"].max(), correction),
        ("Newton iterations", "1", dns["newton_iterations"].sum(), np.nan),
        ("Krylov iterations", "1", dns["krylov_iterations"].sum(), np.nan),
        ("set-ups of the preconditioner", "1", dns.attrs["linear_setups"], np.nan),
        ("largest gap of the energy ledger over external work", "1", ledger_gap(dns), LEDGER),
        ("largest hourglass over internal energy", "1", hourglass_share(dns), HOURGLASS),
    ]


def _contact(dns: xr.Dataset) -> list[Row]:
    energy = dns["energy"].isel(increment=-1)
    friction = energy.sel(form="friction") / energy.sel(form="external")
    viscous = energy.sel(form="stabilisation") / energy.sel(form="internal")
    return [
        _deepest(dns),
        ("augmentations", "1", dns["augmentations"].sum(), np.nan),
        ("friction over external work at full load", "1", friction, np.nan),
        ("largest stabilisation over internal energy", "1", stabilisation_share(dns), STABILISATION),
        ("stabilisation over internal energy at full load", "1", viscous, STABILISATION_AT_END),
    ]


def _deepest(dns: xr.Dataset) -> Row:
    """Return how deep yarns are in each other, with what contact allows: by penalties, or as a local indentation."""
    what = "local indentation" if "indentation_deepest" in dns.attrs else "penetration"
    return f"deepest {what}", "m", penetration(dns), allowed_penetration(dns)
