"""Summary of a result file: a few quantities with their units, its required layout, and what differs between two."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from knitstudy.datasets import STRAINS, VERSIONS
from knitstudy.errors import DataFileError
from knitstudy.knit.geometry.columns import CONTACTS, GEOMETRY, HISTORY, MESH, REST, STRESSES
from knitstudy.knit.loading.history import FORMS
from knitstudy.knit.models.beam.cell import hidden_wave
from knitstudy.knit.scene.kinds import word_of
from knitstudy.measures.centre_cell import SEGMENT, stress_angles
from knitstudy.measures.response import largest_out_of_plane, secant_stiffness

# Attributes of the origin of a result.
PROVENANCE = dict.fromkeys(("scene", "digest", *VERSIONS), "")
# Attributes of a history with their units.
ATTRIBUTES = {
    "fidelity": "",
    "interaction": "",
    "incomplete": "",
    "relaxed_limits": "",
    "slack": "",
    "unstable": "",
    "dof": "1",
    "unknowns": "1",
    "elements": "1",
}
COST = {"wall_seconds": "s", "memory_growth": "bytes"}  # Attributes with their units
# Variables of an optimised geometry.
SURVEYED = ("loop_length", "radius_of_curvature", "gap", "other_gap", "interlock_angle", "leg_angle")

NOTHING = "nothing touched: forces at crossings in contact are zero or rounding"
LEAN = 0.01  # Shear strain of a cell that is pulled straight
LEANS = "the cell leans: if its stitches are mirror symmetric, the opposite shear is as likely"
NEAR_NOTHING = "nothing came near anything"


class Quantity(NamedTuple):
    """A value with its unit, "" for a text."""

    name: str
    value: float | int | str
    unit: str = ""


def kind_of(dataset: xr.Dataset) -> str:
    """Return the kind of a dataset, one of `KINDS`; DataFileError when it has the variables of none of them."""
    for kind, (variables, _) in KINDS.items():
        if all(name in dataset.variables for name in variables):
            return kind
    raise DataFileError(
        f"not a result of this study: it must have the variables of one of {', '.join(KINDS)}, and has"
        f" {', '.join(map(str, dataset.variables)) or 'none'}"
    )


def summarise(dataset: xr.Dataset) -> list[Quantity]:
    """Return kind, origin and quantities of a result; DataFileError when it is not a result of this study."""
    kind = kind_of(dataset)
    require_layout(dataset, kind)
    _, quantities = KINDS[kind]
    return [Quantity("kind", kind), *_attributes(dataset, PROVENANCE), *quantities(dataset)]


def require_layout(dataset: xr.Dataset, kind: str) -> None:
    """Check that the variables of a dataset have the dimensions of its kind.

    Raises DataFileError naming the variable, its layout and the required one.
    """
    columns, names = LAYOUT[kind]
    for name in names.split():
        dims = tuple(str(columns.table["dims"][name]).split())
        if name not in dataset.variables:
            raise DataFileError(f"{kind}: there is no variable {name!r}; make it again")
        variable = dataset[name]
        if variable.dims != dims:
            has, must = (f"({', '.join(names)})" for names in (map(str, variable.dims), dims))
            raise DataFileError(f"{kind}: variable {name!r} has the dimensions {has} but must have {must}")
        if variable.dtype.kind not in "iufb":
            raise DataFileError(f"{kind}: variable {name!r} holds {variable.dtype} but must hold numbers")
        if 0 in variable.shape:
            empty = dims[variable.shape.index(0)]
            raise DataFileError(
                f"{kind}: there is no {empty} in it, nothing had been computed; make it again"
            )
    if kind == "history" and set(dataset["energy"].indexes.get("form", ())) != set(FORMS):
        raise DataFileError(
            f"history: its energy must have the forms {', '.join(FORMS)}, named by a coordinate 'form'"
        )


def _geometry(dataset: xr.Dataset) -> list[Quantity]:
    diameter = Quantity("yarn diameter", 2 * dataset["radius"].item(), "m")
    crossings = Quantity("crossings", dataset.sizes["crossing"], "1")
    if "loops" not in dataset:
        return [_variable(dataset, "angle"), _variable(dataset, "length"), diameter, crossings]
    after = dataset.isel(state=-1) if "state" in dataset.dims else dataset
    names = ("loops", "rows", "course_spacing", "wale_spacing", *(name for name in SURVEYED if name in after))
    known = [*(_variable(after, name) for name in names), diameter, crossings]
    if "radius_of_curvature" in after:
        bend = dataset["radius"].item() / after["radius_of_curvature"].item()
        known.append(Quantity("R over the smallest radius of curvature", bend, "1"))
    return known


def _mesh(dataset: xr.Dataset) -> list[Quantity]:
    return [
        Quantity("nodes", dataset.sizes["node"], "1"),
        Quantity("hexahedra", dataset.sizes["element"], "1"),
        Quantity("yarns", dataset.sizes["yarn_bound"] - 1, "1"),
        Quantity("yarn diameter", 2 * dataset["radius"].item(), "m"),
    ]


def _rest(dataset: xr.Dataset) -> list[Quantity]:
    strains = zip(STRAINS, dataset.attrs["strain_from_drawn"], strict=True)
    return [
        *(Quantity(name, dataset.attrs[name], "m") for name in ("cell_width", "cell_height")),
        *(Quantity(f"{name} strain from the drawn loops", float(strain), "1") for name, strain in strains),
        *stability_of_rest(dataset),
        Quantity("pairs of nodes that rub", dataset.sizes["pair"], "1"),
    ]


def stability_of_rest(dataset: xr.Dataset) -> list[Quantity]:
    """Return how stable a shape at rest is, and what it has left on the way there; nothing of drawn loops."""
    known = dataset.attrs
    if "lowest_stiffness" not in known:
        return []
    numbers = [Quantity("lowest stiffness of the shape at rest", float(known["lowest_stiffness"]), "N/m")]
    if known["saddles"]:
        numbers.append(Quantity("saddles left during relaxation", int(known["saddles"]), "1"))
        numbers += [
            Quantity(f"change of {size} from the first saddle", 100 * float(change), "%")
            for size, change in zip(
                ("width", "height", "thickness"), known["change_from_saddle"], strict=True
            )
        ]
    if "lowest_wave" in known:
        loops, rows = known["lowest_wave"]
        stiffness = float(known["lowest_wave_stiffness"])
        numbers.append(Quantity("lowest stiffness against waves over several cells", stiffness, "N/m"))
        numbers.append(Quantity("length of that wave", f"{loops} loops, {rows} rows"))
    if hides := hidden_wave(known):
        numbers.append(Quantity("hidden by the cell", hides))
    return numbers


def _contacts(dataset: xr.Dataset) -> list[Quantity]:
    force = np.linalg.norm(dataset["force"].to_numpy()[-1], axis=-1)
    area = dataset["area"].to_numpy()
    free = dataset["tied"].to_numpy() == 0
    open_all_the_way = free.any() and not (dataset["contact_area"].to_numpy()[:, free] > 0).any()
    return [
        *_attributes(dataset, {"interaction": ""}),
        Quantity("crossings", dataset.sizes["crossing"], "1"),
        Quantity("crossings that are tied", int(dataset["tied"].sum()), "1"),
        Quantity("crossings with a contact area at the end", int((area > 0).sum()), "1"),
        Quantity("contact area at the end", float(area.sum()), "m2"),
        *([Quantity("contact", NOTHING)] if open_all_the_way else []),
        Quantity("largest force of a crossing at the end", float(force.max()), "N"),
        Quantity("strain at the end", float(dataset["strain"][-1]), "1"),
    ]


def _stresses(dataset: xr.Dataset) -> list[Quantity]:
    angles_of = {kind: stress_angles(dataset, kind) for kind in SEGMENT}
    return [
        Quantity("tension", dataset.attrs["direction"]),
        Quantity("strain", _plain(dataset.attrs["strain"]), "1"),
        Quantity("force of the grips", _plain(dataset.attrs["force"]), "N"),
        *(
            Quantity(f"angle of the maximum principal stress to x, {kind}", float(angles[:, 0].mean()), "deg")
            for kind, angles in angles_of.items()
            if len(angles)
        ),
        Quantity("largest mean stress of a segment", float(dataset["segment_principal"].max()), "Pa"),
    ]


def _history(dataset: xr.Dataset) -> list[Quantity]:
    last = dataset.isel(increment=-1)
    loaded = last["displacement"].item() != 0
    return [
        *_attributes(dataset, ATTRIBUTES),
        *stability_of_rest(dataset),
        Quantity("increments", dataset.sizes["increment"] - 1, "1"),
        Quantity("strain at the end", last["strain"].item(), "1"),
        Quantity("displacement along the load at the end", last["displacement"].item(), "m"),
        Quantity("force along the load at the end", last["force"].item(), "N"),
        *([Quantity("secant stiffness", secant_stiffness(dataset), "N/m")] if loaded else []),
        *_widths(dataset),
        *_contact(dataset),
        Quantity("largest out-of-plane displacement of centrelines", largest_out_of_plane(dataset), "m"),
        *(Quantity(f"{form} energy at the end", last["energy"].sel(form=form).item(), "J") for form in FORMS),
        Quantity("Newton iterations", int(dataset["newton_iterations"].sum()), "1"),
        *_attributes(dataset, COST),
    ]


def _widths(dataset: xr.Dataset) -> list[Quantity]:
    """Return the strains and forces per width of a cell."""
    if "force_per_width" not in dataset:
        return []
    names = {"cell_strain": ("strain", "1"), "force_per_width": ("force over width", "N/m")}
    last = dataset.isel(increment=-1)
    rows = [
        Quantity(f"{way} {quantity} at the end", last[name].sel(plane=way).item(), unit)
        for name, (quantity, unit) in names.items()
        for way in STRAINS
    ]
    plates = {"thickness": "m", "pressure": "Pa"}.items()
    rows += [Quantity(f"{name} at the end", last[name].item(), unit) for name, unit in plates if name in last]
    course, wale, shear = np.abs(last["cell_strain"].to_numpy())
    return [*rows, Quantity("shear", LEANS)] if LEAN < shear < max(course, wale) else rows


def _contact(dataset: xr.Dataset) -> list[Quantity]:
    """Return the largest overlap of yarns; where they touch the ties, the smallest gap and a note where none did."""
    rows = []
    if "largest_overlap" in dataset:
        rows.append(
            Quantity("largest overlap of yarns", dataset["largest_overlap"].max().item(), "yarn radii")
        )
    if "smallest_gap" not in dataset:
        return rows
    if "crossing_tied" in dataset:
        tied = dataset["crossing_tied"]
        rows.append(Quantity(f"tied crossings of {tied.size} (contact.tied_edges)", int(tied.sum()), "1"))
    near = float(np.fmin.reduce(dataset["smallest_gap"].to_numpy()))
    gap = Quantity("smallest gap", near, "m") if np.isfinite(near) else Quantity("smallest gap", NEAR_NOTHING)
    return [*rows, gap] if touched(dataset) else [*rows, gap, Quantity("contact", NOTHING)]


def touched(history: xr.Dataset) -> bool:
    """Whether any yarns pressed on each other."""
    return bool((history["energy"].sel(form="penalty") > 0).any())


def _variable(dataset: xr.Dataset, name: str) -> Quantity:
    """Return a variable that is one number."""
    if dataset[name].size != 1:
        raise DataFileError(f"the variable {name!r} holds {dataset[name].size} values but must hold one")
    return Quantity(name.replace("_", " "), dataset[name].item(), dataset[name].attrs.get("units", "1"))


def _attributes(dataset: xr.Dataset, units: Mapping[str, str]) -> list[Quantity]:
    """Return those attributes that a dataset has."""
    return [
        Quantity(name.replace("_", " "), word_of(_plain(dataset.attrs[name])), unit)
        for name, unit in units.items()
        if name in dataset.attrs
    ]


def _plain(value: Any) -> float | int | str:
    """Return an attribute as a number or a text."""
    array = np.asarray(value)
    return array.item() if array.size == 1 else str(array.tolist())


# Kinds of results: the variables by which a kind is recognised, and the function of its quantities.
KINDS: dict[str, tuple[tuple[str, ...], Callable[[xr.Dataset], list[Quantity]]]] = {
    "history": (("force", "displacement", "strain", "energy", "centreline_displacement"), _history),
    "contacts": (("force", "area", "tied", "relative_displacement"), _contacts),
    "stresses": (("segment_principal", "segment_axis", "cell_stress"), _stresses),
    "mesh": (("nodes", "hexahedra", "radius"), _mesh),
    "shape at rest": (("lattice_vectors", "touching"), _rest),
    "geometry": (("point_of_contact", "arc_length", "radius"), _geometry),
}

# Variables that are shown and drawn, and the tables that have their dimensions.
LAYOUT = {
    "history": (HISTORY, "force displacement strain newton_iterations energy centreline_displacement"),
    "contacts": (CONTACTS, "strain zone tied area force contact_area"),
    "stresses": (
        STRESSES,
        "cell_place cell_stress segment_kind segment_central segment_axis segment_principal segment_rotation",
    ),
    "mesh": (MESH, "nodes hexahedra radius first_slice centres"),
    "shape at rest": (REST, "centreline lattice_vectors"),
    "geometry": (GEOMETRY, "radius arc_length point_of_contact"),
}


# ---- Differences between two results

MISSING = "-"  # stands for a key or a quantity that only the other result has


def pairs(first: Mapping[Any, Any], second: Mapping[Any, Any]) -> Iterator[tuple[Any, Any, Any]]:
    """Yield the keys of two mappings with both values."""
    for key in {**first, **second}:
        yield key, first.get(key, MISSING), second.get(key, MISSING)


def side_by_side(first: Sequence[Quantity], second: Sequence[Quantity]) -> Iterator[tuple[Any, ...]]:
    """Yield name, both values, second over first, and unit of all numbers of two results, and of texts that differ.

    Both begin with their kind (`summarise`); DataFileError when these differ.
    """
    if (kind := first[0].value) != (other := second[0].value):
        raise DataFileError(f"is a {other} and cannot be compared with a {kind}")
    quantities = ({(row.name, row.unit): row.value for row in rows} for rows in (first, second))
    for (name, unit), a, b in pairs(*quantities):
        numbers = isinstance(a, Real) and isinstance(b, Real)
        if numbers or a != b:
            yield name, a, b, float(b) / float(a) if numbers and a else "", unit


def differing_variables(first: xr.Dataset, second: xr.Dataset) -> list[str]:
    """Return the variables, but for times, that are not the same to the last bit or that one result has alone."""

    def same(a: Any, b: Any) -> bool:
        if not isinstance(a, xr.Variable) or not isinstance(b, xr.Variable):
            return False
        values = np.asarray(a), np.asarray(b)
        return a.dims == b.dims and len({(v.shape, v.dtype.kind, v.tobytes()) for v in values}) == 1

    both = pairs(dict(first.variables), dict(second.variables))
    return [name for name, a, b in both if getattr(a, "attrs", {}).get("units") != "s" and not same(a, b)]
