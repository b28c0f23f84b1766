"""The file of a fabric: curves, crossings, grips, periods and labels of all yarns, and the recipe that it was made by.

The file comes back whole, whatever made the fabric. The recipe (a loop and its numbers) is there as well, for what
needs the loop itself: tables of loops, and meshes that are alike in all loops.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.knit.geometry.crossings import Crossings, metre
from knitstudy.knit.geometry.fabric import Arcs, Fabric, Grip
from knitstudy.knit.geometry.loop import Loop
from knitstudy.knit.geometry.specimens import sample_of
from knitstudy.knit.geometry.spline import CatmullRom, Centreline
from knitstudy.knit.geometry.stitches import PLAIN

ONE, YARN, GRIP = {"units": "1"}, "fabric_yarn", "grip"

RECIPE: dict[str, tuple[tuple[str, ...], dict[str, str]]] = {
    "control_points": (("point", "xyz"), metre("control points of the loops of one repeat")),
    "wale_spacing": ((), metre("distance of neighbouring loops along x")),
    "course_spacing": ((), metre("distance of neighbouring yarns along y")),
    "radius": ((), metre("radius of the yarn")),
    "clearance": ((), ONE | {"long_name": "gap aimed at where yarns cross, over the radius"}),
    "loops": ((), ONE),
    "rows": ((), ONE | {"long_name": "interlock rows; one yarn more"}),
    "angle": ((), {"units": "degree", "long_name": "between crossing yarns"}),
    "length": ((), metre("of each yarn")),
}
"""Variables of the recipe: dimensions and attributes."""

NEEDED = (
    "radius",
    "clearance",
    "size",
    "copy_of",
    "curve_points",
    "curve_yarn",
    "curve_length",
    "yarn",
    "grip_arc",
)


def fabric_dataset(fabric: Fabric) -> xr.Dataset:
    """Return a fabric as a dataset in SI units, but for angles.

    Returns
    -------
    Dataset
        Control points of the curves of all yarns, one after the other, where a yarn begins and ends on its curve,
        crossings, grips, periods, and the recipe; docs/reference/files.md lists the variables.
    """
    lines, recipe = (
        fabric.centrelines,
        {"radius": fabric.radius, "clearance": fabric.clearance, "angle": fabric.angle},
    )
    recipe |= {name: value for name, value in fabric.made_of.items() if name != "stitches"}
    curves = [line.curve.points(np.arange(line.curve.period)) for line in lines]
    data: dict[str, tuple] = {
        name: (RECIPE[name][0], value, RECIPE[name][1]) for name, value in recipe.items()
    }
    data |= fabric.crossings.variables()
    data |= {
        "curve_points": (
            ("curve_point", "xyz"),
            np.concatenate(curves),
            metre("control points of the yarns' curves"),
        ),
        "curve_yarn": (("curve_point",), np.repeat(np.arange(len(lines)), list(map(len, curves))), ONE),
        "curve_advance": (
            (YARN, "xyz"),
            [line.curve.advance for line in lines],
            metre("of a curve in a period"),
        ),
        "curve_periods": ((YARN,), [line.loops for line in lines], ONE | {"long_name": "of the whole curve"}),
        "curve_start": (
            (YARN,),
            [line.start for line in lines],
            metre("where the yarn begins along its curve"),
        ),
        "curve_length": ((YARN,), [line.length for line in lines], metre("of the yarn")),
        "copy_of": ((YARN,), fabric.copy_of, ONE | {"long_name": "yarn that a yarn is a moved copy of"}),
        "shift": ((YARN, "xyz"), fabric.shift, metre("from that yarn to the copy")),
        "size": (("xyz",), fabric.size, metre("lengths that strains refer to")),
        "period": (
            ("period_number", "xyz"),
            fabric.periods,
            metre("vectors by which the fabric repeats itself"),
        ),
        "cell": (("xy",), fabric.cell, metre("distances after which the pattern repeats itself")),
        "repeats": ((), fabric.repeats, ONE | {"long_name": "equal parts that every yarn consists of"}),
    }
    data |= _grips(fabric)
    if fabric.arcs is not None:
        arcs = fabric.arcs
        data |= {
            "arc_crossing": (("crossing",), arcs.crossing, ONE | {"long_name": "number in the whole fabric"}),
            "arc_yarn": (
                (YARN,),
                arcs.yarn,
                ONE | {"long_name": "yarn of the whole fabric that a piece is of"},
            ),
            "arc": ((YARN, "ends"), arcs.arc, metre("where the piece begins and ends along that yarn")),
        }
    stitches = fabric.made_of.get("stitches", PLAIN)
    attributes = {} if stitches == PLAIN else {"stitches": " ".join(stitches)}
    coordinates = {"xyz": ["x", "y", "z"], "xy": ["x", "y"], "ends": ["begin", "end"]}
    return xr.Dataset(data, coords=coordinates, attrs={"specimen": fabric.specimen} | attributes)


def _grips(fabric: Fabric) -> dict[str, tuple]:
    """Return the grips of all loads, one after the other."""
    every = [(load, driven, pair[driven]) for load, pair in fabric.grips.items() for driven in (0, 1)]
    counts = [len(grip.yarn) for _, _, grip in every]
    sides = [np.full(3, np.nan) if grip.side is None else grip.side for _, _, grip in every]
    none = {"yarn": np.empty(0, int), "arc": np.empty((0, 2))}
    joined = {
        name: np.concatenate([none[name], *(getattr(grip, name) for *_, grip in every)]) for name in none
    }
    side = np.repeat(np.reshape(sides, (-1, 3)), counts, axis=0)
    return {
        "grip_load": ((GRIP,), np.repeat(np.array([load for load, *_ in every], dtype=str), counts)),
        "grip_driven": (
            (GRIP,),
            np.repeat(np.array([driven for _, driven, _ in every], dtype=np.int8), counts),
            ONE,
        ),
        "grip_yarn": ((GRIP,), joined["yarn"], ONE),
        "grip_arc": ((GRIP, "ends"), joined["arc"], metre("between which a yarn is gripped")),
        "grip_side": (
            (GRIP, "xyz"),
            side,
            ONE | {"long_name": "only the half of the surface that looks there; nan: all"},
        ),
    }


def fabric_of(dataset: xr.Dataset) -> Fabric:
    """Return the fabric that `fabric_dataset` wrote; raises DataFileError where a variable is missing."""
    missing = [name for name in NEEDED if name not in dataset]
    if missing:
        raise DataFileError(
            f"fabric: variables {missing} are missing; allowed is what `fabric_dataset` makes"
        )
    data = {str(name): variable.to_numpy() for name, variable in dataset.variables.items()}
    copy_of = data["copy_of"].astype(int)
    loop, sample = _recipe(dataset, data)
    return Fabric(
        radius=float(data["radius"]),
        clearance=float(data["clearance"]),
        centrelines=_centrelines(data, copy_of),
        crossings=Crossings.of_variables(data),
        size=data["size"],
        copy_of=copy_of,
        shift=data["shift"],
        specimen=dataset.attrs["specimen"],
        made_of={name: data[name] for name in RECIPE if name in data} | ({} if loop is None else vars(loop)),
        grips=_read_grips(data),
        repeats=int(data["repeats"]),
        cell=data["cell"],
        angle=float(data["angle"]),
        arcs=Arcs(data["arc_crossing"], data["arc_yarn"], data["arc"]) if "arc" in data else None,
        periods=data["period"],
        loop=loop,
        sample=sample,
    )


def _recipe(dataset: xr.Dataset, data: Mapping[str, Any]) -> tuple[Loop | None, Fabric | None]:
    """Return the loop of a knit, and a smaller fabric in which yarns bend and meet alike."""
    if "control_points" not in data:
        return None, None
    stitches = tuple(dataset.attrs["stitches"].split()) if "stitches" in dataset.attrs else PLAIN
    lengths = (float(data[name]) for name in ("wale_spacing", "course_spacing", "radius", "clearance"))
    loop = Loop(data["control_points"], *lengths, stitches)
    return loop, sample_of(loop, int(data["loops"]), int(data["rows"]), dataset.attrs["specimen"])


def _centrelines(data: Mapping[str, np.ndarray], copy_of: np.ndarray) -> tuple[Centreline, ...]:
    """Return the centrelines; a copy shares the arc lengths of the yarn that it is a copy of."""
    count = len(copy_of)
    points = np.split(data["curve_points"], np.flatnonzero(np.diff(data["curve_yarn"])) + 1)
    lines: list[Centreline] = []
    for yarn in range(count):
        curve, periods = (
            CatmullRom(points[yarn], data["curve_advance"][yarn]),
            int(data["curve_periods"][yarn]),
        )
        like = lines[copy_of[yarn]] if copy_of[yarn] < yarn else None
        whole = Centreline(curve, periods, like)
        start, length = float(data["curve_start"][yarn]), float(data["curve_length"][yarn])
        lines.append(whole if (start, length) == (0.0, whole.length) else whole.part(start, start + length))
    return tuple(lines)


def _read_grips(data: Mapping[str, np.ndarray]) -> dict[str, tuple[Grip, Grip]]:
    grips = {}
    for load in dict.fromkeys(data["grip_load"].tolist()):
        pair = []
        for driven in (0, 1):
            here = (data["grip_load"] == load) & (data["grip_driven"] == driven)
            side = data["grip_side"][here]
            known = side[0] if len(side) and np.isfinite(side[0]).all() else None
            pair.append(Grip(data["grip_yarn"][here].astype(int), data["grip_arc"][here], known))
        grips[load] = (pair[0], pair[1])
    return grips
