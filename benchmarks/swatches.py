"""Relaxed sizes of 28 swatches of knits and purls from one yarn, beside the twelve whose measured sizes are here.

``python benchmarks/swatches.py`` (`make swatches`) keeps them in resources/swatches.csv and prints how good they are
(docs/notes/swatches.md). Shapes that have been found are in results/swatches: a run that was stopped goes on.

Nothing is set by swatch but its stitches. `Rule` was found on stockinette and garter alone; how much more yarn rows
have that go from knits to purls follows from the masses of the open swatches.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from records import Record, code_of, counted, record
from scipy.optimize import brentq
from scipy.stats import spearmanr

from knitstudy.datasets import read_table
from knitstudy.errors import ConvergenceError
from knitstudy.files import safe_name
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_dataset
from knitstudy.knit.geometry.loop import LoopTarget
from knitstudy.knit.geometry.specimens import knit_of_rows
from knitstudy.knit.geometry.spline import CatmullRom
from knitstudy.knit.geometry.stitch_mesh import BEHIND, Drawing, stitches_of
from knitstudy.knit.geometry.stitches import sides, standard
from knitstudy.knit.models.beam.rest import relax
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.run.behaviour import ENDLESS_BEAMS, behaviour
from knitstudy.run.committed_tables import keep_table
from knitstudy.run.configuration import load_scene

MEASURED = RESOURCES / "measured" / "knitdb.csv"
KEPT = RESOURCES / "swatches.csv"
SHAPES = Path("results/swatches")
SCENE = "fabric-acrylic-stockinette-course-free"  # worsted acrylic, whose laws are scaled to a finer yarn
GRAVITY = 9.81  # m/s2
WORSTED, TEX = 500.0, 2 * 1000 / 30  # tex; 2/30 is taken as two plies of Nm 30

PATTERN, WHOLE = 60, 84  # stitches along a side, without the border and with it
NEEDLES = 25.4e-3 / 15  # distance of needles of a 15-gauge machine [m]
SIZES = {"width": "relaxed width [mm]", "height": "relaxed height [mm]"}
STOCKINETTE = ("K",)
GARTER = ("K", "P")
RULED = (STOCKINETTE, GARTER)  # what the rule was found on


@dataclass(frozen=True)
class Rule:
    """What all swatches have in common. Lengths in m.

    Loops of stockinette are drawn with these rows apart, at the distance of needles. The worsted yarn's diameter of
    0.841 mm, at the same packing, would be 0.31 mm.
    """

    length: float = 6.6e-3  # of yarn in a loop of stockinette
    diameter: float = 0.36e-3
    friction: float = 0.4
    set: float = 0.3  # share of the curvature of the drawn loop that is free of stress
    course: float = 1.9e-3
    plates: float = 0.0  # force of two plates that hold the cell flat, in weights of the cell


RULE = Rule()
STARTS = {"rule": RULE, "long": replace(RULE, course=2.0e-3), "slippery": replace(RULE, friction=0.2)}
"""Friction holds a band of shapes: with drawn rows farther apart, and with less friction, others are found."""

MOST = 4  # stitches of a repeat that is relaxed from all starts
LENGTH, OTHERS = 0.05, 0.04
"""Relative half-widths of intervals: for the yarn in a loop, which sizes are proportional to, more by as much for each
transition a stitch; and for the diameter and beams of a whole radius."""


def repeat_of(text: str) -> tuple[str, ...]:
    """Return the smallest repeat that is the same knit as rows of letters, the bottom row first.

    Examples
    --------
    >>> repeat_of("PK PK"), repeat_of("P")
    (('KP',), ('K',))
    """
    return standard(tuple(text.split()))[0]


def transitions(stitches: Sequence[str]) -> float:
    """Return how often yarn passes between the beds, from knits to purls and back, over the number of stitches.

    Examples
    --------
    >>> transitions(("KP", "KK"))
    0.5
    """
    side = sides(stitches)
    return float((side != np.roll(side, 1, axis=1)).mean())


def more_yarn(measured: pd.DataFrame) -> float:
    """Return by which share a loop is longer, a transition a stitch, by the masses of swatches.

    Swatches are squares of `WHOLE` loops with a border that is taken as stockinette.
    """
    slope, plain = np.polyfit(measured["transitions"], measured["mass [g]"], 1)
    return float(slope / PATTERN**2 / (plain / WHOLE**2))


def drawn_on_needles(stitches: Sequence[str], rule: Rule, radius: float, more: float) -> Fabric:
    """Return a repeat as a machine with two beds holds it: all stitches at the same spacings, purls on the back bed.

    The plain loop is that of stockinette. Beds are as far apart as the mean length of yarn in a stitch says.
    """
    plain = LoopTarget(rule.course, NEEDLES, radius, 0.0).drawn(rule.length)
    along = np.array([NEEDLES, 0.0, 0.0])
    up = np.array([0.0, rule.course, 0.0])
    rows = len(stitches)
    columns = len(stitches[0])
    drawing = Drawing(plain.control_points, NEEDLES, rule.course, 2 * radius, BEHIND * 2 * radius)
    flat = [drawing.row(row) + number * up for number, row in enumerate(stitches_of(stitches))]
    side = sides(stitches).astype(float)
    bed = side - side.mean(
        axis=1, keepdims=True
    )  # rows of one letter stay in the plane: loops are transferred
    count = len(plain.control_points)
    upper = (np.arange(count) > count // 4) & (np.arange(count) < 3 * count // 4)
    depth = np.where(
        upper, np.roll(bed, -1, axis=0)[..., None], bed[..., None]
    )  # heads hang on the row above
    depth[..., 0] = 0.5 * (bed + np.roll(bed, 1, axis=1))
    middle = 0.5 * (bed + np.roll(bed, -1, axis=0))
    depth[..., [count // 4, 3 * count // 4]] = middle[..., None]

    def curves(apart: float) -> list[CatmullRom]:
        moved = [
            points + np.outer(apart * z.ravel(), [0, 0, 1]) for points, z in zip(flat, depth, strict=True)
        ]
        return [CatmullRom(points, columns * along) for points in moved]

    def excess(apart: float) -> float:
        length = sum(curve.segment_lengths().sum() for curve in curves(apart)) / (rows * columns)
        return length / plain.length - 1 - more * transitions(stitches)

    apart = brentq(excess, 0.0, rule.length) if bed.any() else 0.0
    size = {"wale_spacing": NEEDLES, "course_spacing": rule.course, "loops": columns, "rows": rows}
    periods = np.array([columns * along, rows * up])
    return knit_of_rows(
        curves(apart), plain, columns, columns, rows, specimen="cell", made_of=size, periods=periods
    )


def rest_of(stitches: Sequence[str], rule: Rule, more: float) -> dict[str, float]:
    """Return width and height of a stitch at rest [m], mean of the repeat, which is one cell, and the cell's depth.

    Raises ConvergenceError where the relaxation does not converge.
    """
    worsted = load_scene(SCENE)
    share = TEX / WORSTED
    diameter = rule.diameter
    bending = worsted.yarn.bending * share  # fibres of the same kind that slide freely
    pressing = worsted.yarn.pressing * worsted.yarn.diameter**2 / worsted.yarn.bending
    scene = worsted.vary(
        {
            "pattern.stitches": list(stitches),
            "pattern.loops": len(stitches[0]),
            "pattern.rows": len(stitches),
            "pattern.loop_length": rule.length,
            "pattern.wale_spacing": NEEDLES,
            "pattern.course_spacing": rule.course,
            "yarn.diameter": diameter,
            "yarn.bending": bending,
            "yarn.twisting": bending * worsted.yarn.twisting / worsted.yarn.bending,
            "yarn.stretching": worsted.yarn.stretching * share,
            "yarn.pressing": pressing * bending / diameter**2,
            "yarn.set": rule.set,
            "contact.friction": rule.friction,
            "mesh.beam_size": 1.0,
            "solver.residual_tolerance": 1e-4,
            "solver.correction_tolerance": 1e-3,
        }
    )
    radius = 0.5 * diameter * scene.geometry.diameter_share
    fabric = drawn_on_needles(stitches, rule, radius, more)
    weight = 1e-6 * TEX * sum(line.length for line in fabric.centrelines[:-1]) * GRAVITY
    rest = relax(scene, fabric_dataset(fabric), plates=rule.plates * weight)
    return {
        "depth": float(np.ptp(rest["centreline"].to_numpy()[:, 2])) + diameter,
        "width": rest.attrs["cell_width"] / len(stitches[0]),
        "height": rest.attrs["cell_height"] / len(stitches),
    }


def read_measured() -> pd.DataFrame:
    """Return the swatches by name, with their repeats; sizes and masses that are not known are NaN."""
    table = read_table(MEASURED).set_index("swatch")
    table["repeat"] = [repeat_of(text) for text in table["stitches (bottom row first)"]]
    table["transitions"] = [transitions(repeat) for repeat in table["repeat"]]
    numbers = [name for name in table if "[" in name]
    return table.assign(**{name: pd.to_numeric(table[name], errors="coerce") for name in numbers})


def find_shapes(measured: pd.DataFrame) -> pd.DataFrame:
    """Return the shapes at rest of all repeats, the smallest first."""
    more = more_yarn(measured.dropna())
    repeats = sorted(set(measured["repeat"]), key=lambda rows: (len(rows) * len(rows[0]), rows))
    asked = [
        (start, repeat)
        for start, repeat in product(STARTS, repeats)
        if start == "rule" or len(repeat) * len(repeat[0]) <= MOST
    ]
    found = []
    for start, repeat in counted(asked, "shapes"):
        made_by = shape_depends_on(start, repeat, more)
        name = safe_name("-".join([start, *repeat]))
        found.append(record(SHAPES, name, made_by, partial(_shape, start, repeat, more)))
    return pd.DataFrame(found)


def shape_depends_on(start: str, repeat: Sequence[str], more: float) -> list[object]:
    """Return what a shape depends on: what beams do, the yarn's scene, this script, the repeat and its start."""
    of_all = [behaviour([ENDLESS_BEAMS]), load_scene(SCENE).hash, code_of(__file__)]
    return [*of_all, list(repeat), str(STARTS[start]), more]


def _shape(start: str, repeat: Sequence[str], more: float) -> Record:
    """Return the shape at rest of a repeat, or the fault that ended its path."""
    begun = time.perf_counter()
    fault = ""
    try:
        rest = rest_of(repeat, STARTS[start], more)
    except ConvergenceError as error:
        rest = dict.fromkeys([*SIZES, "depth"], np.nan)
        fault = str(error)
    seconds = round(time.perf_counter() - begun, 1)
    return {"repeat": " ".join(repeat), "start": start, **rest, "seconds": seconds, "fault": fault}


def predict(measured: pd.DataFrame, shapes: pd.DataFrame) -> pd.DataFrame:
    """Return width, height and their intervals by swatch [mm].

    The band of shapes at rest of a repeat is the relative range over all starts; repeats larger than `MOST` have the
    mean band of the others. The half-width of an interval is the root of the sum of the squares of the band, of
    `LENGTH` and of `OTHERS`.
    """
    names = [" ".join(repeat) for repeat in measured["repeat"]]
    columns: dict[str, object] = {"stitches": measured["stitches (bottom row first)"]}
    for size in SIZES:
        by = shapes.pivot(index="repeat", columns="start", values=size)
        bands = (by.max(axis=1) - by.min(axis=1)) / by["rule"]
        known = by["rule"].notna() & (by.notna().sum(axis=1) > 1)
        bands = bands.where(known, bands[known].mean())
        value = PATTERN * 1e3 * by["rule"].reindex(names).to_numpy()
        length = LENGTH * (1 + measured["transitions"].to_numpy())
        half = np.sqrt(bands.reindex(names).to_numpy() ** 2 + length**2 + OTHERS**2)
        columns |= {
            f"{size} [mm]": value,
            f"{size} lower": value * (1 - half),
            f"{size} upper": value * (1 + half),
        }
    return pd.DataFrame(columns, index=measured.index).round(
        dict.fromkeys([c for c in columns if c != "stitches"], 1)
    )


def hold_flat(measured: pd.DataFrame, weights: float, repeats: Sequence[str]) -> None:
    """Print the sizes [mm] of repeats between plates that press with so many weights of the cell, and measured ones."""
    more = more_yarn(measured.dropna())
    for text in repeats:
        repeat = repeat_of(text)
        begun = time.perf_counter()
        rest = rest_of(repeat, replace(RULE, plates=weights), more)
        sizes = {size: round(PATTERN * 1e3 * rest[size], 1) for size in SIZES}
        known = measured[measured["repeat"] == repeat][list(SIZES.values())].dropna().to_numpy().tolist()
        print(text, sizes, f"depth {1e3 * rest['depth']:.2f} mm, measured {known},", end=" ")
        print(f"{time.perf_counter() - begun:.0f} s", flush=True)


def judge(measured: pd.DataFrame, predicted: pd.DataFrame) -> pd.DataFrame:
    """Return by size, over the open swatches that the rule was not found on, and over all that are open.

    Rank correlation, median errors of the prediction and of "all are stockinette", and how many lie inside.
    """
    rows = []
    for (name, given), others in ((each, others) for each in SIZES.items() for others in (False, True)):
        of = measured[given].notna() & predicted[f"{name} [mm]"].notna()
        plain = measured[given][measured["repeat"] == STOCKINETTE].mean()
        if others:
            of &= ~measured["repeat"].isin(RULED)
        known = measured[given][of]
        said = predicted[of]
        rows.append(
            {
                "size": name,
                "swatches": f"{'not of the rule' if others else 'open'}: {of.sum()}",
                "Spearman": spearmanr(known, said[f"{name} [mm]"]).statistic,
                "median error": (said[f"{name} [mm]"] / known - 1).abs().median(),
                "all are stockinette": (plain / known - 1).abs().median(),
                "inside": known.between(said[f"{name} lower"], said[f"{name} upper"]).mean(),
            }
        )
    return pd.DataFrame(rows).round(3)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--plates", type=float, metavar="WEIGHTS", help="hold repeats flat, and print their sizes"
    )
    parser.add_argument("repeats", nargs="*", help="rows of letters, such as 'KP PK'")
    asked = parser.parse_args()
    measured = read_measured()
    if asked.plates is not None:
        hold_flat(measured, asked.plates, asked.repeats)
        raise SystemExit
    predicted = predict(measured, find_shapes(measured))
    keep_table(predicted.reset_index(), KEPT, "make swatches", [ENDLESS_BEAMS])
    print(judge(measured, predicted).to_string(index=False))
    print(f"{predicted['width [mm]'].notna().sum()} of {len(predicted)} swatches: {KEPT}")
