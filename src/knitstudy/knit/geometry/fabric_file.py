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
from knitstudy.knit.geometry.columns import GEOMETRY
from knitstudy.knit.geometry.crossings import Crossings
from knitstudy.knit.geometry.fabric import Arcs, Fabric, Grip
from knitstudy.knit.geometry.loop import Loop
from knitstudy.knit.geometry.specimens import sample_of
from knitstudy.knit.geometry.spline import CatmullRom, Centreline
from knitstudy.knit.geometry.stitches import PLAIN
from knitstudy.mechanics.core.arrays import Floats, Ints

RECIPE = tuple("control_points wale_spacing course_spacing radius clearance loops rows angle length".split())
"""Variables of the recipe."""

NEEDED = tuple("radius clearance size copy_of curve_points curve_yarn curve_length yarn grip_arc".split())


def fabric_dataset(fabric: Fabric) -> xr.Dataset:
    """Return a fabric as a dataset in SI units, but for angles.

    Returns
    -------
    Dataset
        Control points of the curves of all yarns, one after the other, where a yarn begins and ends on its curve,
        crossings, grips, periods, and the recipe; docs/reference/files.md lists the variables.
    """
    lines = fabric.centrelines
    made_of = dict(fabric.made_of)
    stitches = made_of.pop("stitches", PLAIN)
    curves = [line.curve.points(np.arange(line.curve.period)) for line in lines]
    values = {
        "radius": fabric.radius,
        "clearance": fabric.clearance,
        "angle": fabric.angle,
        **made_of,
        **fabric.crossings.variables(),
        "curve_points": np.concatenate(curves),
        "curve_yarn": np.repeat(np.arange(len(lines)), list(map(len, curves))),
        "curve_advance": [line.curve.advance for line in lines],
        "curve_periods": [line.loops for line in lines],
        "curve_start": [line.start for line in lines],
        "curve_length": [line.length for line in lines],
        "copy_of": fabric.copy_of,
        "shift": fabric.shift,
        "size": fabric.size,
        "period": fabric.periods,
        "cell": fabric.cell,
        "repeats": fabric.repeats,
        **_grips(fabric),
    }
    if (arcs := fabric.arcs) is not None:
        values |= {"arc_crossing": arcs.crossing, "arc_yarn": arcs.yarn, "arc": arcs.arc}
    attributes = {} if stitches == PLAIN else {"stitches": " ".join(stitches)}
    coordinates = {"xyz": ["x", "y", "z"], "xy": ["x", "y"], "ends": ["begin", "end"]}
    return xr.Dataset(GEOMETRY.variables(values), coordinates, {"specimen": fabric.specimen} | attributes)


def _grips(fabric: Fabric) -> dict[str, Any]:
    """Return the grips of all loads, one after the other."""
    every = [(load, driven, pair[driven]) for load, pair in fabric.grips.items() for driven in (0, 1)]
    counts = [len(grip.yarn) for *_, grip in every]
    sides = [np.full(3, np.nan) if grip.side is None else grip.side for *_, grip in every]
    return {
        "grip_load": np.repeat(np.array([load for load, *_ in every], dtype=str), counts),
        "grip_driven": np.repeat(np.array([driven for _, driven, _ in every], dtype=np.int8), counts),
        "grip_yarn": np.concatenate([np.empty(0, int), *(grip.yarn for *_, grip in every)]),
        "grip_arc": np.concatenate([np.empty((0, 2)), *(grip.arc for *_, grip in every)]),
        "grip_side": np.repeat(np.reshape(sides, (-1, 3)), counts, axis=0),
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
    names = ("wale_spacing", "course_spacing", "radius", "clearance")
    lengths = {name: float(data[name]) for name in names}
    loop = Loop(data["control_points"], **lengths, stitches=stitches)
    return loop, sample_of(loop, int(data["loops"]), int(data["rows"]), dataset.attrs["specimen"])


def _centrelines(data: Mapping[str, Floats], copy_of: Ints) -> tuple[Centreline, ...]:
    """Return the centrelines; a copy shares the arc lengths of the yarn that it is a copy of."""
    points = np.split(data["curve_points"], np.flatnonzero(np.diff(data["curve_yarn"])) + 1)
    lines: list[Centreline] = []
    for yarn in range(len(copy_of)):
        curve = CatmullRom(points[yarn], data["curve_advance"][yarn])
        like = lines[copy_of[yarn]] if copy_of[yarn] < yarn else None
        whole = Centreline(curve, int(data["curve_periods"][yarn]), like)
        start, length = float(data["curve_start"][yarn]), float(data["curve_length"][yarn])
        lines.append(whole if (start, length) == (0.0, whole.length) else whole.part(start, start + length))
    return tuple(lines)


def _read_grips(data: Mapping[str, Floats]) -> dict[str, tuple[Grip, Grip]]:
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
