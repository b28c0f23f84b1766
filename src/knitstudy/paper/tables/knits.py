"""Every simulation of a knit, the models of the four cases, the unit cell, and sweeps of it (Fig. 11)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.shared_sections import Newton
from knitstudy.measures import response
from knitstudy.measures.centre_cell import crossing_error
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import made_of
from knitstudy.paper.cases import COMPARED, MODELS, Case, cases_of, comparison, plain
from knitstudy.paper.columns import (
    CONTRACTION,
    DOF,
    EFFORT,
    FORCE,
    FRICTION_SHARE,
    INCREMENTS,
    KRYLOV,
    MEMORY,
    NEWTON,
    SCENE,
    SECANT,
    STABILISED,
    STRAIN,
    TIME,
    U_Z,
    Column,
    Simulation,
    beam_length,
    cells_of,
    key,
    rows_of,
    tabulated,
)
from knitstudy.paper.scene_names import INTERACTIONS, solid
from knitstudy.paper.sweeps import ALONG, DIAMETER, HELD, RESULTS, SPACING, sweeps_of
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several

# ---- Every simulation of a knit


def _springs(rom: Any) -> tuple[str | None, str | None]:
    """Return where the stiffness of springs of a section ``rom`` is from, and their contacts; None without springs."""
    if given := getattr(rom, "stiffness", None):
        return f"{' '.join(f'{stiffness:g}' for stiffness in given)} N/m", None
    if getattr(rom, "axes", None) is None:
        return None, None
    return "averaged", rom.springs_from or rom.contacts_from


def _element(row: Simulation) -> float:
    sizes = (row.scene.metres(path) for path in ("mesh.size", "mesh.beam_size"))
    return next(filter(None, sizes), None) or beam_length(row.history)


def _force_at(strain: float) -> Column:
    """Return the column of the force at a strain; nan where a history ends before."""

    def force(history: xr.Dataset) -> float:
        reached = strain <= 1.001 * float(history["strain"][-1])
        return response.at_strain(history, strain, history["force"].to_numpy()) if reached else np.nan

    return Column(f"force at {strain:.0%} strain", "N", force)


RESPONSES = (
    SCENE,
    Column("specimen", "", lambda scene: f"{cells_of(scene.value('pattern'))} knit", of="scene"),
    key("fidelity", "", "fidelity"),
    key("interaction", "", "interaction"),
    key("direction", "", "load.direction"),
    key("tied edges", "", "contact.tied_edges"),
    key("friction coefficient", "1", "contact.friction"),
    key("contact stiffness over E / h", "1", "contact.normal_stiffness"),
    key("augmentations allowed", "1", "contact.augmentations"),
    key("contacts from", "", "rom.contacts_from"),
    key("joint", "", "rom.joint"),
    key("normal", "", "rom.normal"),
    Column("springs", "", lambda scene: _springs(scene.value("rom"))[0], of="scene"),
    Column("springs from", "", lambda scene: _springs(scene.value("rom"))[1], of="scene"),
    key("axes of springs", "", "rom.axes"),
    key("displacement of springs", "", "rom.displacement"),
    key("section law", "", "mesh.section_law"),
    key("segment of two yarns", "", "rom.section"),
    key("honeycomb", "", "rom.honeycomb"),
    key("principal stress from", "", "rom.stress_from"),
    key("beam section", "", "beam.section"),
    key("beam ties", "", "beam.tie"),
    Column("mesh size", "m", _element, of=""),
    Column("strain reached", "1", lambda row: row[STRAIN], of=""),
    *(_force_at(strain) for strain in (0.01, 0.03, 0.05)),
    SECANT,
    U_Z,
    DOF,
    Column("unknowns", "1", lambda history: int(history.attrs["unknowns"])),
    TIME,
    MEMORY,
    INCREMENTS,
    NEWTON,
    KRYLOV,
)


@TABLES.add(
    "responses",
    "Every simulation of a knit",
    results={"every": several("simulation", "*", where=lambda scene: scene.is_knit)},
    order=9,
)
def tabulate_responses(every: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row a simulation; cells are empty where a model has no such key or result."""
    return tabulated(rows_of(scenes, every).values(), RESPONSES)


# ---- Checks of the direct simulations of the four cases

BALANCE = 0.01  # Largest gap of the energy balance over the largest external work
HOURGLASS = 0.05  # Largest share of hourglass energy in the internal energy
# Largest share of the dissipation of stabilisation in internal energy, on the way and at full load.
STABILISATION, STABILISATION_AT_END = 0.05, 0.01

# Title and case of the tables of checks by name.
CHECKED = {
    "simulation": ("Checks of direct simulations: ties, course tension", "tie-course"),
    "simulation_contact": ("Checks of direct simulations: friction, course tension", "isotropic-course"),
    "simulation_wale": ("Checks of direct simulations: ties, wale tension", "tie-wale"),
    "simulation_contact_wale": ("Checks of direct simulations: friction, wale tension", "isotropic-wale"),
}


TIES = (
    ("tolerance of the ties beyond the clearance", "m", "tie_tolerance"),
    ("radius of the ties", "m", "tie_radius"),
    ("least stiffness of a tie", "N/m", "tie_least_stiffness"),
    ("tied nodes", "1", "tie_nodes"),
    ("largest adjustment of a tied node", "m", "tie_largest_adjustment"),
)  # attributes that some histories have


def tabulate_checks(dns: xr.Dataset, scenes: Scenes) -> pd.DataFrame:
    """Return one quantity of a direct simulation a row, with its unit and its bar where it has one."""
    rows = [
        (name, unit, float(value), *(bar or [np.nan]))
        for name, unit, value, *bar in _checks(dns, scenes["dns"].solver)
    ]
    return pd.DataFrame(rows, columns=["quantity", "unit", "value", "bar"])


for order, (name, (title, case)) in enumerate(CHECKED.items(), start=10):
    TABLES.add(name, title, results={"dns": solid("simulation", case)}, order=order)(tabulate_checks)


def _checks(dns: xr.Dataset, bars: Newton) -> Iterator[tuple[Any, ...]]:
    """Yield quantity, unit and value, and a bar of some: of the ties, of the solution, of contact."""
    yield from ((name, unit, dns.attrs[each]) for name, unit, each in TIES if each in dns.attrs)
    yield "tied area of a crossing, smallest", "m2", dns["tied_area"].min()
    yield "tied area of a crossing, largest", "m2", dns["tied_area"].max()
    yield "largest residual over mean internal force", "1", dns["residual"].max(), bars.residual_tolerance
    yield "largest last correction over element size", "1", dns["correction"].max(), bars.correction_tolerance
    yield NEWTON.name, NEWTON.unit, NEWTON.function(dns)
    yield KRYLOV.name, KRYLOV.unit, KRYLOV.function(dns)
    yield "set-ups of the preconditioner", "1", dns.attrs["linear_setups"]
    yield "largest gap of the energy balance over external work", "1", response.energy_gap(dns), BALANCE
    yield "largest hourglass over internal energy", "1", response.hourglass_share(dns), HOURGLASS
    if "smallest_gap" not in dns:
        return
    what = "local indentation" if "indentation_deepest" in dns.attrs else "penetration"
    yield f"deepest {what}", "m", response.penetration(dns), response.allowed_penetration(dns)
    yield "augmentations", "1", dns["augmentations"].sum()
    yield FRICTION_SHARE.name, FRICTION_SHARE.unit, FRICTION_SHARE.function(dns)
    largest = response.hourglass_share(dns, "stabilisation")
    yield "largest stabilisation over internal energy", "1", largest, STABILISATION
    yield STABILISED.name, STABILISED.unit, STABILISED.function(dns), STABILISATION_AT_END


# ---- Models and the reference, and interactions

OVER_FIRST = "stiffness over that of the first beams [1]"
OF_MODELS = {"models": several("simulation", *MODELS)}


@TABLES.add("rom_distance", "Models and the reference", results=OF_MODELS, order=1)
def tabulate_models(models: Datasets, scenes: Scenes, reference: pd.DataFrame) -> pd.DataFrame:
    """Return one row a model of each of the four cases: direct simulations and reduced models."""
    rows = [
        {
            "model": f"{case.name_of(model)}; {case.label}",
            "scene": model.scene.name,
            "discretisation": made_of(model.scene) if model.scene.kind.direct else "beams",
            **comparison(model, case),
        }
        for case in cases_of(rows_of(scenes, models), reference)
        for model in (case.dns, *case.others, *case.reduced)
    ]
    return pd.DataFrame(rows, columns=["model", "scene", "discretisation", *COMPARED])


@TABLES.add("beams", "Beams in contact and solid yarns", results=OF_MODELS, order=8)
def tabulate_beams(models: Datasets, scenes: Scenes, reference: pd.DataFrame) -> pd.DataFrame:
    """Return one row a model: direct simulation, main 3D reduced model and beams in contact, by direction (Fig. 12b).

    Beams show what each ingredient of their contact changes.
    """
    cases = [case for case in cases_of(rows_of(scenes, models), reference) if case.beams]
    columns = ["model", "scene", *COMPARED, OVER_FIRST, INCREMENTS.head, NEWTON.head, TIME.head]
    return pd.DataFrame([row for case in cases for row in _rows_of_beams(case)], columns=columns)


def _rows_of_beams(case: Case) -> Iterator[dict[str, Any]]:
    base = next((model[SECANT] for model in plain(case.beams)), np.nan)
    beside = [case.main["rom3d"]] if "rom3d" in case.main else []
    for model in (case.dns, *beside, *case.beams):
        yield {
            "model": f"{case.name_of(model)}; {case.direction}",
            "scene": model.scene.name,
            **comparison(model, case),
            OVER_FIRST: model[SECANT] / base if model in case.beams else np.nan,
            **model.cells(EFFORT),
        }


@TABLES.add(
    "interactions",
    "Ties, rough contact and isotropic friction",
    results={kind: solid("simulation", f"{kind}-course") for kind in INTERACTIONS}
    | {"geometry": solid("geometry", "isotropic-course")},
    order=2,
)
def tabulate_interactions(geometry: xr.Dataset, **histories: xr.Dataset) -> pd.DataFrame:
    """Return one row an interaction (Figs. 8 and 9), at the largest strain that all have reached."""
    strain = response.common_strain(histories.values())
    diameter = 2 * float(geometry["radius"])
    rows = []
    for name, interaction in INTERACTIONS.items():
        history = histories[name]
        u_z = response.at_strain(history, strain, response.out_of_plane(history))
        stiffness, of_ties = (response.stiffness_at(each, strain) for each in (history, histories["tie"]))
        row = {
            "interaction": interaction,
            "scene": history.attrs.get("scene", ""),
            "strain [1]": strain,
            "force [N]": response.at_strain(history, strain, history["force"].to_numpy()),
            "secant stiffness [N/m]": stiffness,
            "stiffness over tie's [1]": stiffness / of_ties,
            "largest |u_z| [m]": u_z,
            "largest |u_z| over diameter [1]": u_z / diameter,
        }
        rows.append(row | {column.head: column.function(history) for column in (CONTRACTION, *EFFORT)})
    return pd.DataFrame(rows)


# ---- The unit cell before and after its optimisation, and sweeps (Fig. 11)

# Variable of the geometry dataset, unit, and key of the target, by name in the table.
MEASURES = {
    "deepest penetration": ("penetration", "m", None),
    "smallest gap": ("gap", "m", None),
    "smallest gap away from crossings": ("other_gap", "m", None),
    "smallest radius of curvature": ("radius_of_curvature", "m", None),
    "yarn in a loop": ("loop_length", "m", "length"),
    "angle of interlock segments to x": ("interlock_angle", "deg", "interlock_angle"),
    "angle of legs to x": ("leg_angle", "deg", "leg_angle"),
}
SWEEPS = {SPACING: "course spacing", ALONG: "wale spacing", DIAMETER: "yarn diameter"}


@TABLES.add(
    "geometry",
    "Unit cell before and after optimisation",
    results={"geometry": solid("geometry", "tie-course")},
    order=14,
)
def tabulate_unit_cell(geometry: xr.Dataset, targets: dict[str, Any]) -> pd.DataFrame:
    """Return measures and terms of F before and after, with targets and residuals where there are any.

    Raises ConfigurationError when a target is missing.
    """
    rows = [("largest |D - 2R - c0| of a crossing", "m", *crossing_error(geometry).to_numpy(), None)]
    for name, (variable, unit, target) in MEASURES.items():
        rows.append((name, unit, *geometry[variable].to_numpy(), target))
    for term, cost in zip(
        geometry["term"].to_numpy(), geometry["cost"].transpose("term", "state"), strict=True
    ):
        rows.append((f"F, {'' if term == 'total' else 'term '}{term}", "1", *cost.to_numpy(), None))
    diameter = 2 * float(geometry["radius"])
    rows.append(("yarn diameter", "m", diameter, diameter, "diameter"))
    table = pd.DataFrame(rows, columns=["quantity", "unit", "before", "after", "target"])
    table["target"] = [_target(targets, name) for *_, name in rows]
    return table.assign(residual=table["after"] - table["target"])


def _target(targets: dict[str, Any], name: str | None) -> float:
    if name is None:
        return np.nan
    try:
        return float(targets["targets"][name]["value"])
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigurationError(
            f"calibration: targets.{name}.value must be there and be a number"
        ) from error


@TABLES.add("sweeps", "Other course spacings and yarn diameters", results=RESULTS, order=13)
def tabulate_sweeps(
    drawn: Datasets, sweeps: Datasets, scenes: Scenes, reference: pd.DataFrame
) -> pd.DataFrame:
    """Return one row a simulation of each sweep; the uncertainty is empty where no error is known."""
    rows = rows_of(scenes, {**drawn, **sweeps})
    table = []
    for path, swept in SWEEPS.items():
        for sweep in sweeps_of(path, rows, reference):
            kind = {
                "swept": swept,
                "held fixed": HELD[sweep.keep],
                "interaction": INTERACTIONS[sweep.interaction],
                "made of": sweep.made_of,
            }
            table += [kind | _point(rows[point.scene.name], point.u_z) for point in sweep.points]
    return pd.DataFrame(table)


def _point(row: Simulation, u_z: Estimate) -> dict[str, object]:
    pattern = row.scene.value("pattern")
    diameter = row.scene.yarn.diameter
    return {
        "scene": row.scene.name,
        "course spacing [m]": pattern.course_ratio * pattern.course_spacing,
        "course spacing over drawn [1]": pattern.course_ratio,
        "yarn diameter [m]": diameter,
        "width of the knit [m]": float(row.history["displacement"][-1]) / row[STRAIN],
        STRAIN.head: row[STRAIN],
        "largest |u_z| [m]": u_z.value,
        "uncertainty of that [m]": u_z.uncertainty,
        "largest |u_z| over diameter [1]": u_z.value / diameter,
        FORCE.head: row[FORCE],
    }
