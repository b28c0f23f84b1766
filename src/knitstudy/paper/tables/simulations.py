"""Every simulation of a knit with its response and cost, and the checks of the direct simulations of the four cases."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.knit.scene.scene import Scene
from knitstudy.measures import response
from knitstudy.measures.cost import MEGABYTE, effort, element_length
from knitstudy.measures.response import (
    allowed_penetration,
    hourglass_share,
    ledger_gap,
    penetration,
)
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several, solid

STRAINS = (0.01, 0.03, 0.05)  # Strains at which forces are listed

# Keys of a scene by column; a column without a key is filled by `_keys`.
KEYS = {
    "fidelity": "fidelity",
    "interaction": "interaction",
    "direction": "load.direction",
    "tied edges": "contact.tied_edges",
    "friction coefficient [1]": "contact.friction",
    "contact stiffness over E / h [1]": "contact.normal_stiffness",
    "augmentations allowed [1]": "contact.augmentations",
    "contacts from": "rom.contacts_from",
    "joint": "rom.joint",
    "normal": "rom.normal",
    "springs": "",
    "springs from": "",
    "axes of springs": "rom.axes",
    "displacement of springs": "rom.displacement",
    "section law": "mesh.section_law",
    "segment of two yarns": "rom.section",
    "honeycomb": "rom.honeycomb",
    "principal stress from": "rom.stress_from",
    "beam section": "beam.section",
    "beam ties": "beam.tie",
}

LEDGER = 0.01  # Largest gap of the ledger over the largest external work
HOURGLASS = 0.05  # Largest share of hourglass energy in the internal energy
# Largest share of the dissipation of stabilisation in internal energy, on the way and at full load.
STABILISATION, STABILISATION_AT_END = 0.05, 0.01


@TABLES.add(
    "responses",
    "Every simulation of a knit",
    results={"every": several("simulation", "*", where=lambda scene: scene.is_knit)},
    order=9,
)
def tabulate_responses(every: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row a simulation; cells are empty where a model has no such key or result.

    Stiffness is force per width over strain, as for a cloth: secant and tangent at the largest strain. The width across
    the load is the height of the knit (rows times course spacing) in course tension, its width (loops times wale
    spacing) in wale tension. Energies are over the product of the two.
    """
    return pd.DataFrame(
        [
            {"scene": name} | _keys(scenes[name], history) | _response(scenes[name], history) | _cost(history)
            for name, history in every.items()
        ]
    )


def _keys(scene: Scene, history: xr.Dataset) -> dict:
    given = " ".join(f"{stiffness:g}" for stiffness in scene.value("rom.stiffness") or ())
    measured = scene.value("rom.axes") is not None and not given
    return {
        "specimen": f"{scene.pattern.loops} x {scene.pattern.rows} knit",
        **{column: scene.value(key) if key else None for column, key in KEYS.items()},
        "springs": f"{given} N/m" if given else "averaged" if measured else None,
        "springs from": (scene.rom.springs_from or scene.rom.contacts_from) if measured else None,
        "mesh size [m]": scene.metres("mesh.size")
        or scene.metres("mesh.beam_size")
        or element_length(history),
    }


def _response(scene: Scene, history: xr.Dataset) -> dict:
    reached, force = float(history["strain"][-1]), history["force"].to_numpy()
    direction = scene.load.direction
    height, width = _size(scene, history)
    along, across = (width, height) if direction == "course" else (height, width)
    energy = history["energy"].isel(increment=-1)
    forces = {
        f"force at {strain:.0%} strain [N]": response.at_strain(history, strain, force)
        if strain <= 1.001 * reached
        else np.nan
        for strain in STRAINS
    }
    dissipated = float(energy.sel(form=["friction", "stabilisation"]).sum())
    return {
        "strain reached [1]": reached,
        **forces,
        "width across the load [m]": across,
        "force per width [N/m]": force[-1] / across,
        "secant stiffness, force per width [N/m]": response.secant_stiffness(history) * along / across,
        "tangent stiffness, force per width [N/m]": response.tangent_stiffness(history) * along / across,
        "largest |u_z| [m]": response.largest_out_of_plane(history),
        "internal energy per area [J/m2]": float(energy.sel(form="internal")) / (width * height),
        "dissipated energy per area [J/m2]": dissipated / (width * height),
    }


def _size(scene: Scene, history: xr.Dataset) -> tuple[float, float]:
    """Return height and width of a knit [m]; a wale spacing from the yarn's length follows from the strain."""
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
        **effort(history),
    }


Row = tuple[str, str, float, float]  # Quantity, unit, value and bar

# Title and case of the tables of checks by name.
CHECKED = {
    "simulation": ("Checks of direct simulations: ties, course tension", "tie-course"),
    "simulation_contact": ("Checks of direct simulations: friction, course tension", "isotropic-course"),
    "simulation_wale": ("Checks of direct simulations: ties, wale tension", "tie-wale"),
    "simulation_contact_wale": ("Checks of direct simulations: friction, wale tension", "isotropic-wale"),
}


def tabulate_checks(dns: xr.Dataset, scenes: Scenes) -> pd.DataFrame:
    """Return one quantity of a direct simulation a row, with its unit and its bar where it has one."""
    rows = [*_ties(dns), *_solution(dns, scenes["dns"]), *(_contact(dns) if "smallest_gap" in dns else ())]
    return pd.DataFrame(
        [(name, unit, float(value), bar) for name, unit, value, bar in rows],
        columns=["quantity", "unit", "value", "bar"],
    )


for order, (name, (title, case)) in enumerate(CHECKED.items(), start=10):
    results = {"dns": solid("simulation", case)}
    TABLES.add(name, title, results=results, scenes=True, order=order)(tabulate_checks)


def _ties(dns: xr.Dataset) -> list[Row]:
    area = dns["tied_area"]
    rows = (
        ("tolerance of the ties beyond the clearance", "m", "tie_tolerance"),
        ("radius of the ties", "m", "tie_radius"),
        ("least stiffness of a tie", "N/m", "tie_least_stiffness"),
        ("tied nodes", "1", "tie_nodes"),
        ("largest adjustment of a tied node", "m", "tie_largest_adjustment"),
    )
    return [
        *((name, unit, dns.attrs[key], np.nan) for name, unit, key in rows if key in dns.attrs),
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
    largest = hourglass_share(dns, "stabilisation")
    what = "local indentation" if "indentation_deepest" in dns.attrs else "penetration"
    return [
        (f"deepest {what}", "m", penetration(dns), allowed_penetration(dns)),
        ("augmentations", "1", dns["augmentations"].sum(), np.nan),
        ("friction over external work at full load", "1", friction, np.nan),
        ("largest stabilisation over internal energy", "1", largest, STABILISATION),
        ("stabilisation over internal energy at full load", "1", viscous, STABILISATION_AT_END),
    ]
