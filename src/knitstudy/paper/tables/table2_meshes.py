"""Table 2 in the paper's own contact: springs against strain, force of a crossing and mesh, and rules for all six.

Section 2.6 divides "the net interfacial forces" by "the relative displacement between yarn interfaces". It names
neither the strain, the points whose displacement counts, the crossings, the axes nor the average. Two displacements
are compared: the slip and the depth of the points in contact, which a penalty code reports for its surfaces, and the
motion of the points that face each other where the undeformed yarns come closest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.knit.contacts.contacts import indented
from knitstudy.knit.contacts.kinematics import CrossingAxes
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.yarns.joints import MEASURES, contact_normals, spring_axes
from knitstudy.measures.centre_cell import area_of_cell, centre_cell, pressed_area_of_cell, zones_of_cell
from knitstudy.mechanics.contact.indentation import CylinderContact
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.paper.cases import number
from knitstudy.paper.claims import COMPARABLE
from knitstudy.paper.columns import Simulation, rows_of
from knitstudy.paper.scene_names import INTERACTIONS, of_cases
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, one, several

WAYS = ("course", "wale")
# Penalty of Table 1 alone, on three meshes, and the contact of the base
MESHES = ("as-printed-coarse-yarns-{case}", "reading-as-printed-yarns-{case}", "as-printed-fine-yarns-{case}")
NAMES = (*MESHES, "yarns-{case}")
SLIDING = of_cases(map("-".join, product(("isotropic",), WAYS)), NAMES)
ALL = of_cases(map("-".join, product(INTERACTIONS, WAYS)), NAMES)
GEOMETRY = one("geometry", *of_cases(("isotropic-course",), reversed(NAMES)))
RESOLVED = "resolved contact"


def run_of(row: Simulation) -> str:
    """Return the contact of a simulation in words: the mesh of hexahedra, or the resolved contact of spline yarns."""
    size = row.scene.metres("mesh.size") if row.scene.value("mesh.element") else None
    return RESOLVED if size is None else f"{1e3 * size:.2f} mm"


# ---- Displacements of the two sides of a contact

SLIP, FACING = "slip and depth", "facing points"
POINTS = ("increment", "crossing", "side", "area", "traction", "normal", "gap", "slip")


def displacements(row: Simulation) -> dict[str, Floats]:
    """Return displacements (I, K, 3) [m] of the upper row's side against the lower row's, nan where unknown.

    Facing points move from first contact on. Slip counts along the traction and depth along the normal; both are means
    over the points under pressure on both sides, by their areas. The increment in which a crossing first touches is
    left out: its slip began somewhere within the increment.
    """
    contacts = row.results["contacts"]
    moved = contacts[MEASURES["interface"]].to_numpy()
    touching: Bools = contacts["zones"].to_numpy() > 0
    first = np.argmax(touching, axis=0)
    since = moved - moved[first, np.arange(len(first))]
    known = {FACING: since}
    if "contact_pressure" in row.history:
        known[SLIP] = _slip_and_depth(row.history, touching.shape)
    later = np.arange(len(touching))[:, None] > first
    return {name: np.where(later[..., None], each, np.nan) for name, each in known.items()}


def _slip_and_depth(history: xr.Dataset, shape: tuple[int, ...]) -> Floats:
    """Return the mean slip and depth (I, K, 3) [m] of the points under pressure; nan where nothing touches."""
    here = (history["contact_crossing"].to_numpy() >= 0) & (history["contact_pressure"].to_numpy() > 0)
    points = {name: history[f"contact_{name}"].to_numpy()[here] for name in POINTS}
    size = np.linalg.norm(points["traction"], axis=1, keepdims=True)
    along = points["traction"] / np.where(size > 0, size, np.inf)
    moved = (
        np.abs(points["slip"])[:, None] * along - np.minimum(points["gap"], 0.0)[:, None] * points["normal"]
    )
    moved *= np.where(points["side"] == 0, 1.0, -1.0)[:, None]
    at = points["increment"] * shape[1] + points["crossing"]
    count = int(np.prod(shape))
    area = np.bincount(at, points["area"], count)
    area[area == 0] = np.nan
    mean = [np.bincount(at, points["area"] * column, count) / area for column in moved.T]
    return np.stack(mean, axis=-1).reshape(*shape, 3)


# ---- Springs of all increments by one recipe

NORMAL = "normal_resultant"  # Section 2.5: along the resultant contact force, here that of the pressure
AXES = {"x along the course": "local", "x along the wale": "local, turned 90"}
ALL_FREE, CELL = "all that are free", "centre cell"
CROSSINGS = (ALL_FREE, CELL)
SECANT, TANGENT = "force over displacement", "change of force over change of displacement"
AVERAGES: dict[str, Callable[[Floats, Floats], Any]] = {
    "nearest": lambda force, moved: np.nansum(force * moved, 1) / np.nansum(moved**2, 1),
    "sums of magnitudes": lambda force, moved: np.nansum(np.abs(force), 1) / np.nansum(np.abs(moved), 1),
    "median": lambda force, moved: _median(np.abs(force / moved)),
}


def _median(values: Floats) -> Floats:
    """Return medians (I, 3) over crossings (I, K, 3), nan where there is no value."""
    known = np.asarray(np.isfinite(values).any(axis=1))
    return np.where(known, np.nanmedian(np.where(known[:, None], values, 0.0), axis=1), np.nan)


@dataclass(frozen=True)
class Recipe:
    """How springs follow from the forces and motions of crossings. The default is that of the figure.

    Of all recipes on the mesh, with the penalty and without the augmentation of the paper it is the nearest to Table 2
    in course tension at the paper's strain.
    """

    displacement: str = SLIP
    form: str = SECANT
    crossings: str = ALL_FREE
    axes: str = "x along the wale"
    average: str = "sums of magnitudes"

    def springs(self, row: Simulation, moved: Mapping[str, Floats]) -> Floats:
        """Return k_x, k_y, k_z (I, 3) [N/m] of every increment; `moved` are the `displacements` of the row."""
        contacts = row.results["contacts"]
        used = crossings_of(contacts)[self.crossings]
        axes = spring_axes(contact_normals(contacts, NORMAL), AXES[self.axes])[used]
        vectors = (contacts["force"].to_numpy()[:, used], moved[self.displacement][:, used])
        force, displacement = (np.einsum("kai,tki->tka", axes, vector) for vector in vectors)
        if self.form == TANGENT:
            force, displacement = (
                np.diff(each, axis=0, prepend=np.full_like(each[:1], np.nan))
                for each in (force, displacement)
            )
        touching = contacts["zones"].to_numpy()[:, used] > 0
        known = touching[..., None] & np.isfinite(displacement) & (displacement != 0)
        with np.errstate(invalid="ignore", divide="ignore"):
            return AVERAGES[self.average](
                np.where(known, force, np.nan), np.where(known, displacement, np.nan)
            )


def crossings_of(contacts: xr.Dataset) -> dict[str, Ints]:
    """Return the crossings that are not tied, and those of the centre cell among them."""
    free = np.flatnonzero(~contacts["tied"].to_numpy().astype(bool))
    return {ALL_FREE: free, CELL: np.intersect1d(free, centre_cell(contacts))}


def force_of_crossing(contacts: xr.Dataset) -> Floats:
    """Return the mean net force (I,) [N] of the free crossings in contact; 0 where none is."""
    free = crossings_of(contacts)[ALL_FREE]
    force = np.linalg.norm(contacts["force"].to_numpy()[:, free], axis=-1)
    touching = contacts["zones"].to_numpy()[:, free] > 0
    return np.sum(force * touching, axis=1) / np.maximum(touching.sum(axis=1), 1)


def hertz_stiffness(force: Floats, fabric: Fabric, modulus: float) -> Floats:
    """Return force over approach [N/m] of two cylinders that cross at the mean angle of a fabric's crossings.

    `force` (I,) is in N, `modulus` is E* = E / (2 (1 - nu^2)) in Pa. Johnson, Contact Mechanics (1985), section 4.2.
    """
    cosine = np.abs(np.einsum("ki,ki->k", *CrossingAxes.of(fabric).tangent.swapaxes(0, 1)))
    contact = CylinderContact.at(float(np.arccos(np.clip(cosine, 0.0, 1.0)).mean()))
    radius = fabric.radius
    load = np.asarray(force) / (modulus * radius**2)
    approach = contact.approach * radius * load ** (2 / 3)
    return np.divide(force, approach, out=np.full(len(load), np.nan), where=approach > 0)


def hertz_modulus(row: Simulation) -> float:
    """Return E* = E / (2 (1 - nu^2)) [Pa] of two yarns alike."""
    return 0.5 * row.scene.value("yarn.youngs_modulus") / (1 - row.scene.value("yarn.poisson_ratio") ** 2)


# ---- Tables

STRAIN, FORCE, HERTZ = "strain [1]", "force of a crossing [N]", "k_z of Hertz [N/m]"
SPRINGS = {name: tuple(f"k_{axis} by {name} [N/m]" for axis in "xyz") for name in (SLIP, FACING)}
PAPER = tuple(f"k_{axis} of the paper [N/m]" for axis in "xyz")


@TABLES.add(
    "springs",
    "Table 2: springs against strain and force of a crossing, by mesh",
    results={
        "geometry": GEOMETRY,
        "contacts": several("contacts", *SLIDING),
        "histories": several("simulation", *SLIDING),
    },
    order=4.6,
)
def tabulate_springs(
    geometry: xr.Dataset, contacts: Datasets, histories: Datasets, paper: pd.DataFrame, scenes: Scenes
) -> pd.DataFrame:
    """Return one row an increment of every simulation with friction: its springs by the default `Recipe`."""
    fabric = fabric_of(geometry)
    recipe = Recipe()
    parts = []
    for row in rows_of(scenes, histories, contacts=contacts).values():
        way = row.scene.value("load.direction")
        force = force_of_crossing(row.results["contacts"])
        part: dict[str, Any] = {
            "scene": str(row.scene.name),
            "contact": run_of(row),
            "tension": way,
            STRAIN: row.history["strain"].to_numpy(),
            FORCE: force,
            HERTZ: hertz_stiffness(force, fabric, hertz_modulus(row)),
        }
        moved = displacements(row)
        for name in moved:
            springs = replace(recipe, displacement=name).springs(row, moved)
            part |= dict(zip(SPRINGS[name], springs.T, strict=True))
        part |= dict(zip(PAPER, printed_springs(paper, way), strict=True))
        parts.append(pd.DataFrame(part)[force > 0])
    return pd.concat(parts, ignore_index=True)


def printed_springs(paper: pd.DataFrame, way: str) -> Floats:
    """Return k_x, k_y and k_z of Table 2 (3,) [N/m] in course or wale tension."""
    return np.array([number(paper, "2", way, f"spring stiffness k{axis}") for axis in "xyz"])


@dataclass(frozen=True)
class Rule:
    """What is the same for the springs of some tensions: a strain or a force of a crossing."""

    name: str
    form: str  # `SECANT` or `TANGENT`
    control: str  # STRAIN or FORCE
    ways: tuple[str, ...] = WAYS


RULES = (
    Rule("one strain", SECANT, STRAIN),
    Rule("one force of a crossing", SECANT, FORCE),
    Rule("one strain, over the last increment", TANGENT, STRAIN),
    Rule("one force of a crossing, over the last increment", TANGENT, FORCE),
    *(Rule(f"{way} tension by itself", SECANT, STRAIN, (way,)) for way in WAYS),
)
WORST, WITHIN, IN_WORDS = "worst factor [1]", f"springs within {COMPARABLE:g} [1]", "in words"
NEAREST = "nearest of all"
SHARES = [f"k_{axis}, {way}, over the paper's [1]" for way in WAYS for axis in "xyz"]
GRID = 80  # Strains and forces of a crossing that are tried


@TABLES.add(
    "table2_rules",
    "Table 2: the best rule of each kind, and how far it misses the six springs",
    results={
        "contacts": several("contacts", *SLIDING),
        "histories": several("simulation", *SLIDING),
    },
    order=4.3,
)
def tabulate_rules(
    contacts: Datasets, histories: Datasets, paper: pd.DataFrame, scenes: Scenes
) -> pd.DataFrame:
    """Return, of every kind of rule and contact with friction, the rule nearest to the springs of Table 2.

    A rule is a recipe with a strain or a force of a crossing that is the same in both tensions; a tension by itself has
    three springs to meet. The nearest rule has the smallest worst factor: the larger one of ours over the paper's and
    the inverse, without bound where ours is not positive. The first row is the nearest rule for all six springs.
    """
    printed = {way: printed_springs(paper, way) for way in WAYS}
    by_run: dict[str, dict[str, Simulation]] = {}
    for row in rows_of(scenes, histories, contacts=contacts).values():
        by_run.setdefault(run_of(row), {})[row.scene.value("load.direction")] = row
    parts = []
    for run, rows in by_run.items():
        tried = pd.DataFrame(_tried(rows, printed))
        kinds = tried.groupby("rule")[WORST]
        best = tried.assign(**{"rules tried [1]": kinds.transform("size")}).loc[kinds.idxmin()]
        best.insert(0, "contact", run)
        parts.append(best)
    table = pd.concat(parts).sort_values(WORST, ignore_index=True)
    table.insert(0, "name", table["rule"] + "; " + table["contact"])
    for_both = {rule.name for rule in RULES if rule.ways == WAYS}
    first = table[table["rule"].isin(for_both)].iloc[:1].assign(name=NEAREST)
    return pd.concat([first, table], ignore_index=True).assign(**{IN_WORDS: _in_words})


def _in_words(table: pd.DataFrame) -> list[str]:
    """Return what every row of the table of rules says."""
    words = []
    for each in table.to_dict("records"):
        count = sum(np.isfinite(each[share]) for share in SHARES)
        near = "all" if each[WITHIN] == count else each[WITHIN]
        worst = f"the worst is off by a factor of {each[WORST]:.2f}"
        words.append(f"{near} of {count} springs are within {COMPARABLE:g}, {worst}")
    return words


def _tried(rows: Mapping[str, Simulation], printed: Mapping[str, Floats]) -> Iterator[dict[str, Any]]:
    """Yield all rules of a contact, whose simulations are by tension, with their springs over the paper's."""
    moved = {way: displacements(row) for way, row in rows.items()}
    strain = {way: row.history["strain"].to_numpy() for way, row in rows.items()}
    force = {way: force_of_crossing(row.results["contacts"]) for way, row in rows.items()}
    known = set.intersection(*map(set, moved.values()))
    for rule, name, which, axes, average in product(RULES, sorted(known), CROSSINGS, AXES, AVERAGES):
        if not set(rule.ways) <= set(rows):
            continue
        recipe = Recipe(name, rule.form, which, axes, average)
        shares = {way: recipe.springs(rows[way], moved[way]) / printed[way] for way in rule.ways}
        control = strain if rule.control == STRAIN else force
        head = {
            "rule": rule.name,
            "displacement": name,
            "spring": rule.form,
            "crossings": which,
            "axes": axes,
            "average": average,
        }
        for value, found in at_the_same({way: control[way] for way in rule.ways}, shares):
            at = f"{value:.2%}" if rule.control == STRAIN else f"{value:.2f} N"
            yield {**head, "at": at, **_judged(found)}


def at_the_same(
    along: Mapping[str, Floats], shares: Mapping[str, Floats]
) -> Iterator[tuple[float, dict[str, Floats]]]:
    """Yield values of a control that all tensions reach, evenly on a logarithmic scale, and the springs there.

    `along` is the control (I,) and `shares` are the springs (I, 3) of every tension; between increments they follow
    straight lines.
    """
    used = {way: _increasing(along[way], shares[way]) for way in along}
    if not all(each.any() for each in used.values()):
        return
    controls = {way: along[way][used[way]] for way in along}
    low = max(control[0] for control in controls.values())
    high = min(control[-1] for control in controls.values())
    for value in np.geomspace(low, high, GRID) if low <= high else ():
        yield (
            float(value),
            {
                way: np.array(
                    [np.interp(value, controls[way], column) for column in shares[way][used[way]].T]
                )
                for way in along
            },
        )


def _increasing(control: Floats, springs: Floats) -> Bools:
    """Return the increments with springs whose control is larger than that of all before."""
    known = np.isfinite(springs).all(axis=1)
    highest = np.maximum.accumulate(np.where(known, control, -np.inf))
    return known & (control > np.concatenate([[-np.inf], highest[:-1]]))


def _judged(shares: Mapping[str, Floats]) -> dict[str, Any]:
    """Return shares (3,) of the paper's springs by tension, the worst factor, and how many are near enough, by column.

    Factors have no bound where a share is not positive.
    """
    found = np.concatenate(list(shares.values()))
    positive = np.where(found > 0, found, np.nan)
    factors = np.nan_to_num(np.maximum(positive, 1 / positive), nan=np.inf)
    six = np.concatenate([shares.get(way, np.full(3, np.nan)) for way in WAYS])
    near = int((factors <= COMPARABLE).sum())
    return {**dict(zip(SHARES, six, strict=True)), WORST: factors.max(), WITHIN: near}


AREA = "area of the centre cell under pressure or tied [m2]"
HERTZ_AREA = "area of the centre cell by Hertz [m2]"


@TABLES.add(
    "table2_meshes",
    "Table 2: contact and springs at full strain, by mesh",
    results={
        "geometry": GEOMETRY,
        "contacts": several("contacts", *ALL),
        "histories": several("simulation", *ALL),
    },
    order=4.0,
)
def tabulate_meshes(
    geometry: xr.Dataset, contacts: Datasets, histories: Datasets, scenes: Scenes
) -> pd.DataFrame:
    """Return one row a simulation at full strain: contact of the centre cell beside Hertz, forces, and springs."""
    fabric = fabric_of(geometry)
    rows = []
    for row in rows_of(scenes, histories, contacts=contacts).values():
        found = row.results["contacts"]
        here = centre_cell(found)
        force = np.linalg.norm(found["force"].to_numpy()[-1], axis=-1)
        cells = {
            "scene": str(row.scene.name),
            "contact": run_of(row),
            "interaction": row.scene.interaction,
            "tension": row.scene.value("load.direction"),
            STRAIN: float(row.history["strain"][-1]),
            "force of the knit [N]": float(row.history["force"][-1]),
            "largest force of a crossing [N]": force.max(),
            "mean force of a crossing of the centre cell [N]": force[here].mean(),
            "contact zones of the centre cell [1]": int(zones_of_cell(found)[-1]),
            AREA: float(area_of_cell(found)[-1]),
        }
        if row.scene.interaction != "tie":
            cells |= _touched(row, fabric)
            springs = Recipe().springs(row, displacements(row))[-1]
            if row.scene.interaction == "rough":  # it does not slip: only its depth is a displacement
                springs[:2] = np.nan
            cells |= dict(zip(SPRINGS[SLIP], springs, strict=True))
        rows.append(cells)
    return pd.DataFrame(rows)


def _touched(row: Simulation, fabric: Fabric) -> dict[str, float]:
    """Return area under pressure, Hertz's under the same forces, facets and mean depth of the centre cell's contacts.

    The contacts of spline yarns have Hertz's area for their area; here it is that of the points under pressure, the
    mean of both sides, as with hexahedra. Only hexahedra have facets.
    """
    found, history = row.results["contacts"], row.history
    here = centre_cell(found)
    pressed = found["normal_resultant"].to_numpy()
    chosen = history["contact_increment"].to_numpy() == len(pressed) - 1
    chosen &= np.isin(history["contact_crossing"].to_numpy(), here)
    chosen &= history["contact_pressure"].to_numpy() > 0
    area = history["contact_area"].to_numpy()[chosen]
    gap = history["contact_gap"].to_numpy()[chosen]
    names = ("contact_crossing", "contact_side", "contact_cell")
    facets = np.column_stack([history[name].to_numpy()[chosen] for name in names])
    hertz = indented(fabric, pressed, hertz_modulus(row))["contact_area"][-1, here]
    count = 0.5 * len(np.unique(facets, axis=0)) / len(here)
    return {
        AREA: float(pressed_area_of_cell(history, found)[-1]),
        HERTZ_AREA: float(hertz.sum()),
        "facets of a contact under pressure [1]": np.nan if run_of(row) == RESOLVED else count,
        "mean depth of points under pressure [m]": float(-np.sum(area * gap) / area.sum())
        if len(area)
        else 0.0,
    }
