"""Table 2 by every recipe that section 2.6 leaves open: which force is divided by which displacement.

Section 2.6 divides "the net interfacial forces" by "the relative displacement between yarn interfaces". It names
neither the interaction, the strain, the points whose displacement counts, the crossings, the axes nor the average.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.knit.yarns.joints import MAIN, MEASURES, contact_normals, spring_axes
from knitstudy.measures.centre_cell import centre_cell
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.paper.cases import number
from knitstudy.paper.claims import COMPARABLE
from knitstudy.paper.columns import Simulation, rows_of
from knitstudy.paper.scene_names import of_cases
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several

WAYS = ("course", "wale")
RUNS = of_cases(
    map("-".join, product(("tie", "rough", "isotropic"), WAYS)), ("yarns-{case}", "dns-{case}-penalty10")
)
STRAINS = (0.0025, 0.005, 0.01, 0.02, 0.03, 0.04, 0.05)
FRAMES = [(normal, axes) for normal in (MAIN, "closest_points") for axes in ("local", "local, turned 90")]
FRAMES.append((MAIN, "global"))
# Whose slip and depth: of points in contact against the other surface, as a penalty code reports them for the nodes of
# its slave surface; of both sides, or of one
SLIP = "slip and depth of points in contact, {}"
SIDES = {
    SLIP.format(name): sides for name, sides in (("both sides", (0, 1)), ("lower", (0,)), ("upper", (1,)))
}
POINTS = (
    *("increment", "crossing", "side", "area", "pressure", "position", "reference"),
    *("traction", "normal", "gap", "slip"),
)
FACING = {"facing points": MEASURES["interface"], "centrelines": MEASURES["centreline"]}
TOUCHING = "points in contact, one side against the other"
AVERAGES: dict[str, Callable[[Floats, Floats], Any]] = {
    "nearest": lambda force, moved: np.nansum(force * moved, 0) / np.nansum(moved**2, 0),
    "sums of magnitudes": lambda force, moved: np.nansum(np.abs(force), 0) / np.nansum(np.abs(moved), 0),
    "median of magnitudes": lambda force, moved: pd.DataFrame(np.abs(force / moved)).median().to_numpy(),
}


def displacements(row: Simulation) -> Iterator[tuple[str, Floats]]:
    """Yield displacements (I, K, 3) [m] of the upper row's side against the lower row's, nan where unknown."""
    contacts = row.results["contacts"]
    history = row.history
    zones = contacts["zones"].to_numpy() > 0
    first = np.argmax(zones, axis=0)
    crossings = np.arange(zones.shape[1])
    later = (np.arange(len(zones))[:, None] > first)[..., None]

    def since_contact(moved: Floats) -> Floats:
        return np.where(later, moved - np.nan_to_num(moved[first, crossings]), np.nan)

    for between, variable in ((name, variable) for name, variable in FACING.items() if variable in contacts):
        yield between, since_contact(contacts[variable].to_numpy())
    if "contact_pressure" not in history:  # all crossings are tied
        return
    here = (history["contact_crossing"].to_numpy() >= 0) & (history["contact_pressure"].to_numpy() > 0)
    points = {name: history[f"contact_{name}"].to_numpy()[here] for name in POINTS}
    at = points["increment"] * len(crossings) + points["crossing"]
    side = points["side"]

    def mean(values: Floats, weight: Floats) -> Floats:
        total = np.bincount(at, weight, zones.size)
        total[total == 0] = np.nan
        columns = [np.bincount(at, weight * column, zones.size) / total for column in values.T]
        return np.stack(columns, axis=-1).reshape(*zones.shape, 3)

    carried = points["position"] - points["reference"]
    lower, upper = (mean(carried, points["area"] * points["pressure"] * (side == s)) for s in (0, 1))
    yield TOUCHING, since_contact(upper - lower)
    size = np.linalg.norm(points["traction"], axis=1, keepdims=True)
    moved = np.abs(points["slip"])[:, None] * points["traction"] / np.where(size > 0, size, np.inf)
    moved -= np.minimum(points["gap"], 0.0)[:, None] * points["normal"]
    for between, sides in SIDES.items():
        yield (
            between,
            mean(np.where(side == 0, 1.0, -1.0)[:, None] * moved, points["area"] * np.isin(side, sides)),
        )


def recipes(row: Simulation) -> Iterator[tuple[tuple[Any, ...], Floats]]:
    """Yield displacement, strain, crossings, normal, axes and average of every recipe, and its springs (3,) [N/m]."""
    contacts = row.results["contacts"]
    strain = row.history["strain"].to_numpy()
    zones = contacts["zones"].to_numpy() > 0
    frames = {frame: spring_axes(contact_normals(contacts, frame[0]), frame[1]) for frame in FRAMES}
    for (between, moved), wanted, (which, chosen) in product(
        displacements(row), STRAINS, crossings_of(contacts).items()
    ):
        i = int(np.argmin(np.abs(strain - wanted)))
        used = chosen[zones[i][chosen]]
        if abs(strain[i] - wanted) > 0.5 * wanted or not len(used):
            continue
        for frame, axes in frames.items():
            vectors = (contacts["force"].to_numpy()[i, used], moved[i, used])
            force, displacement = (np.einsum("kai,ki->ka", axes[used], vector) for vector in vectors)
            force = np.where(np.isnan(displacement), np.nan, force)
            for average, function in AVERAGES.items():
                yield (between, wanted, which, *frame, average), function(force, displacement)


def crossings_of(contacts: xr.Dataset) -> dict[str, Ints]:
    """Return the crossings that are not tied, all where all are, and those of the centre cell among them."""
    free = np.flatnonzero(~contacts["tied"].to_numpy().astype(bool))
    free = free if len(free) else np.arange(contacts.sizes["crossing"])
    return {"free": free, "centre cell": np.intersect1d(free, centre_cell(contacts))}


@TABLES.add(
    "springs",
    "Table 2 at a glance: recipes of springs nearest to the paper's",
    results={"contacts": several("contacts", *RUNS), "histories": several("simulation", *RUNS)},
    order=4,
)
def tabulate(contacts: Datasets, histories: Datasets, paper: pd.DataFrame, scenes: Scenes) -> pd.DataFrame:
    """Return, of every run and displacement, the recipe nearest to the six numbers of Table 2, and how many were tried.

    The nearest has the smallest worst factor of the six: the larger one of ours over the paper's and its inverse,
    without bound where ours is not positive.
    """
    printed = {way: [number(paper, "2", way, f"spring stiffness k{axis}") for axis in "xyz"] for way in WAYS}
    found: dict[tuple[Any, ...], dict[str, Floats]] = {}
    with np.errstate(invalid="ignore", divide="ignore"):
        for row in rows_of(scenes, histories, contacts=contacts).values():
            way = row.scene.value("load.direction")
            run = str(row.scene.name).replace(f"-{way}", "")
            for recipe, stiffness in recipes(row):
                found.setdefault((run, *recipe), {})[way] = stiffness / printed[way]
    rows = []
    for recipe, by_way in found.items():
        if len(by_way) == len(WAYS):
            ratios = np.concatenate([by_way[way] for way in WAYS])
            positive = np.where(ratios > 0, ratios, np.nan)
            factors = np.nan_to_num(np.maximum(positive, 1 / positive), nan=np.inf)
            rows.append((*recipe, *ratios, factors.max(), int((factors <= COMPARABLE).sum())))
    names = [f"k{axis}, {way}, over the paper's [1]" for way in WAYS for axis in "xyz"]
    head = ["run", "displacement of", "strain [1]", "crossings", "normal", "axes", "average", *names]
    table = pd.DataFrame(rows, columns=[*head, "worst factor [1]", f"within {COMPARABLE:g} [1]"])
    kinds = table.groupby(["run", "displacement of"])["worst factor [1]"]
    table = table.assign(**{"recipes tried [1]": kinds.transform("size")})
    return table.loc[kinds.idxmin()].sort_values("worst factor [1]", ignore_index=True)
