"""The geometry stage: the fabric of a scene with its optimised loop.

A drawn loop has one course and one wale spacing. Another course spacing or yarn needs another loop; ``pattern.keep``
says what stays of the drawn one:

- "shape": the points stay where they are drawn; rows only stand closer or wider.
- "wale_spacing": the loop is stretched along the wales with the course spacing, as on a machine: needles give the wale
  spacing, their depth gives the yarn in a loop.
- "length": it is also stretched across the wales, so that it keeps its yarn: a knit that is widened or narrowed.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.columns import GEOMETRY
from knitstudy.knit.geometry.fabric_file import fabric_dataset
from knitstudy.knit.geometry.fit import fitted_loop
from knitstudy.knit.geometry.loop import Loop, LoopTarget
from knitstudy.knit.geometry.loop_metrics import LoopMetrics, check_yarns, loop_metrics
from knitstudy.knit.geometry.optimise import CONTACT_TOLERANCE, Optimum, optimise
from knitstudy.knit.geometry.specimens import KNITS, plain_knit, yarn_pair
from knitstudy.knit.geometry.stitch_mesh import endless_cell_of_stitches
from knitstudy.knit.geometry.stitches import PLAIN, images_of_standard
from knitstudy.knit.scene.alternatives import RELAXED
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.sections import INLAY, Geometry, Pattern, Yarn
from knitstudy.knit.scene.specimens import Crossing, Looped
from knitstudy.knit.scene.stitches import is_plain

log = logging.getLogger(__name__)

LENGTH_TOLERANCE = 1e-4  # relative error of the length that is kept
MOST_OPTIMISATIONS = 6  # in the search of the wale spacing that keeps the length; three are usual
WIDEST = 2.0  # stretch across the wales, and one over the least, among which the drawn length is looked for
FIRST_SLOPE = 0.5  # relative change of length over that of the width: half of a loop runs across the wales


def lay_out(scene: Scene) -> xr.Dataset:
    """Return the fabric of a scene as `fabric_dataset` does; the loop of a knit is optimised first.

    A knit has the initial control points as well and, for both states "before" and "after", the terms of F, length,
    smallest radius of curvature, deepest penetration, gaps and angles.
    A cell that is drawn for a thinner yarn (`geometry.diameter_share`) and whose loops cannot be fitted is drawn as
    cells with tucks are (`stitch_mesh`); it has none of these.
    Raises GeometryError when no valid knit comes out.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> knit = lay_out(load_scene("yarns-tie-course"))
    >>> knit.sizes["fabric_yarn"], knit.sizes["crossing"]
    (9, 36)
    """
    if isinstance(scene, Crossing):
        pair = scene.pair
        return fabric_dataset(yarn_pair(scene.yarn.radius, pair.angle, pair.length, pair.clearance))
    pattern: Pattern = scene.value("pattern")
    radius = drawn_radius(scene.yarn, scene.value("geometry.diameter_share"))
    order = scene.value("yarn_b.rows") or ()
    if INLAY in order:
        inlay = radius * (scene.value("yarn_b.diameter") or scene.yarn.diameter) / scene.yarn.diameter
        inlaid = [after == INLAY for row, after in pairwise([*order, ""]) if row != INLAY]
        return _drawn_stitches(pattern, radius, inlaid, inlay)
    if not is_plain(pattern.stitches):
        return _drawn_stitches(pattern, radius)
    # Cells of beams take loops that were not fitted: for those of a rib, nearest spacings would be looked for in vain.
    finds_its_shape = scene.specimen == "cell" and scene.fidelity == "beam"
    nearest = not (finds_its_shape and len(set("".join(pattern.stitches))) > 1)
    try:
        initial, loop, optimum = loop_of(pattern, radius, scene.value("geometry"), nearest)
        metrics = (loop_metrics(initial), loop_metrics(loop))
        check_yarns(metrics[1], loop, CONTACT_TOLERANCE)
    except GeometryError as error:
        if scene.value("geometry.diameter_share") != 1 and pattern.control_points is None:
            # Cells of beams that start from rest alone may be drawn for a thinner yarn: they find their shape.
            log.info("scene %r: stitches are drawn, since no loop was fitted: %s", scene.name, error)
            return _drawn_stitches(pattern, radius)
        remedy = ""
        if pattern.control_points is not None:
            remedy = (
                "; or a pattern.course_ratio nearer to 1, or a smaller pattern.clearance (docs/notes/geometry.md lists "
                "the loops that exist); or pattern.control_points null: a loop is drawn for the spacings"
            )
        if finds_its_shape:
            remedy += f"; or {RELAXED} true: loops are drawn for a thinner yarn, and find their shape at rest"
        described = _described(pattern, scene.yarn.diameter)
        raise GeometryError(f"scene {scene.name!r}: {described}: {error}{remedy}") from error
    knit = KNITS.get(scene.specimen, plain_knit)(loop, pattern.loops, pattern.rows)
    return fabric_dataset(knit).merge(_report(initial, optimum, metrics))


def initial_loop(scene: Looped) -> Loop:
    """Return the loop of a scene as it is drawn, before its optimisation."""
    return _drawn(scene.pattern, drawn_radius(scene.yarn, scene.value("geometry.diameter_share")))


def _drawn(pattern: Pattern, radius: float) -> Loop:
    """Return the loop of a pattern as it is drawn, of yarns of a radius [m]."""
    if pattern.control_points is None:
        return _target(pattern, radius).drawn()
    spacings = pattern.wale_spacing, pattern.course_spacing
    return Loop(np.array(pattern.control_points), *spacings, radius, pattern.clearance)


def drawn_radius(yarn: Yarn, share: float | None) -> float:
    """Return the radius that loops are drawn for [m]: a share of the yarn's, by default all of it."""
    return 0.5 * yarn.diameter * (share or 1.0)


def _target(pattern: Pattern, radius: float) -> LoopTarget:
    """Return the target of the loop of a pattern that has no control points."""
    spacings = pattern.course_spacing, pattern.wale_spacing
    return LoopTarget(*spacings, radius, pattern.clearance, pattern.loop_length, pattern.stitches)


def _drawn_stitches(pattern: Pattern, radius: float, *inlay: Any) -> xr.Dataset:
    """Return a cell of any stitches as it is drawn, with inlays as of `endless_cell_of_stitches`."""
    target = _target(pattern, radius)
    return fabric_dataset(endless_cell_of_stitches(target, pattern.loops, pattern.rows, *inlay))


def loop_of(
    pattern: Pattern, radius: float, settings: Geometry, look_for_nearest: bool = True
) -> tuple[Loop, Loop, Optimum]:
    """Return the loop of a pattern as it is drawn, the optimised loop, and the outcome of the optimisation.

    Errors as of `fitted_loop`.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> scene = load_scene("yarns-tie-course")
    >>> drawn, optimised, _ = loop_of(scene.pattern, scene.yarn.radius, scene.geometry)
    >>> round(1e3 * drawn.length, 1), round(1e3 * optimised.length, 1)  # of yarn [mm]
    (54.9, 55.5)
    """
    if pattern.control_points is None:
        return fitted_loop(_target(pattern, radius), settings, look_for_nearest)
    initial, loop, optimum = _redrawn(_drawn(pattern, radius), pattern, settings)
    return all_of_repeat(initial, pattern.stitches), all_of_repeat(loop, pattern.stitches), optimum


def all_of_repeat(loop: Loop, stitches: tuple[str, ...]) -> Loop:
    """Return the loops of a repeat of stitches that are images of the loop of a plain knit."""
    points = images_of_standard(loop.control_points, loop.wale_spacing, loop.course_spacing, stitches)
    return replace(loop, control_points=points, stitches=stitches)


def _described(pattern: Pattern, diameter: float) -> str:
    """Return the keys of the loop of a pattern in words."""
    lengths = {
        "pattern.course_spacing": pattern.course_spacing,
        "pattern.wale_spacing": pattern.wale_spacing,
        "yarn.diameter": diameter,
        "pattern.loop_length": pattern.loop_length,
    }
    words = [f"{name} {1e3 * length:.4g} mm" for name, length in lengths.items() if length is not None]
    if pattern.stitches != PLAIN:
        words.insert(0, f"pattern.stitches {list(pattern.stitches)}")
    words.append(f"pattern.clearance {pattern.clearance:g} radii")
    if pattern.control_points is not None:
        words.append(f"pattern.course_ratio {pattern.course_ratio:g}, pattern.keep {pattern.keep!r}")
    return ", ".join(words)


def _report(initial: Loop, optimum: Optimum, metrics: Sequence[LoopMetrics]) -> xr.Dataset:
    """Return the changes by the optimisation, over the states "before" and "after"."""
    terms = list(optimum.after)
    measured = "radius_of_curvature penetration gap other_gap interlock_angle leg_angle".split()
    values = {
        "control_points_before": initial.control_points,
        "cost": [[state[term] for term in terms] for state in (optimum.before, optimum.after)],
        "loop_length": [state.length for state in metrics],
        "crossing_distance": [state.distance for state in metrics],
        "iterations": optimum.iterations,
        "gradient": optimum.gradient,
        **{name: [getattr(state, name) for state in metrics] for name in measured},
    }
    return xr.Dataset(GEOMETRY.variables(values), {"state": ["before", "after"], "term": terms})


# ---- Loops at another course spacing


def _redrawn(drawn: Loop, pattern: Pattern, settings: Geometry) -> tuple[Loop, Loop, Optimum]:
    """Return the loop at the course spacing of a pattern, before and after its optimisation, and the outcome."""
    ratio = pattern.course_ratio
    if pattern.keep == "length":
        return _at_length(drawn, ratio, settings)
    rows_apart = replace(drawn, course_spacing=ratio * drawn.course_spacing)
    initial = _stretched(drawn, 1.0, ratio) if pattern.keep == "wale_spacing" else rows_apart
    return initial, *optimise(initial, settings)


def _stretched(loop: Loop, across: float, along: float) -> Loop:
    """Return the loop with points and spacings stretched across and along the wales; heights stay."""
    return replace(
        loop,
        control_points=loop.control_points * [across, along, 1.0],
        wale_spacing=across * loop.wale_spacing,
        course_spacing=along * loop.course_spacing,
    )


def _at_length(drawn: Loop, ratio: float, settings: Geometry) -> tuple[Loop, Loop, Optimum]:
    """Return as `_redrawn` does the loop whose optimisation has the drawn length, by secants on the width."""
    length = drawn.length

    def excess(across: float) -> float:
        return _stretched(drawn, across, ratio).length / length - 1

    bounds = 1 / WIDEST, WIDEST
    if excess(bounds[0]) * excess(bounds[1]) >= 0:
        raise GeometryError(
            f"no wale spacing within a factor of {WIDEST:g} of the drawn one keeps the drawn length of "
            f"{length:.4e} m: take a pattern.course_ratio nearer to 1"
        )
    across = brentq(excess, *bounds, xtol=1e-6)
    slope = FIRST_SLOPE
    before = step = 0.0
    for _ in range(MOST_OPTIMISATIONS):
        initial = _stretched(drawn, across, ratio)
        loop, optimum = optimise(initial, settings)
        error = loop.length / length - 1
        if abs(error) <= LENGTH_TOLERANCE:
            return initial, loop, optimum
        if step:
            slope = (error - before) / step or FIRST_SLOPE
        step = -error / slope
        before = error
        across += step
    raise GeometryError(
        f"the yarn in a loop misses the drawn length of {length:.4e} m by {error:.1e} of it, allowed is "
        f"{LENGTH_TOLERANCE:g}: take a pattern.course_ratio nearer to 1 or a smaller yarn.diameter"
    )
