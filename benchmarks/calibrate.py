"""Calibration: the loop and the spacings whose optimised knit has the angles and the length of the paper's.

Unknowns are the spacings w and c and the control points of a quarter of the loop; mirror and half turn give the rest.
The optimisation moves z components only, so its result is known by its conditions: the z components of the gradient of
F vanish, with the contact force 2 alpha (D - 2 - c0) as one more unknown. They are solved together with the targets by
least squares; in the end the optimisation itself must confirm the result. The loop that the targets leave open has the
least bending energy; curvature and gaps are bounded by penalties. All lengths are in yarn radii.
``python benchmarks/calibrate.py`` makes config/calibrated_loop.yaml from config/calibration.yaml.
"""

import argparse
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import yaml
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from knitstudy.errors import ConfigurationError, GeometryError, KnitstudyError
from knitstudy.files import replacing
from knitstudy.knit.geometry.loop import Loop, whole_loop
from knitstudy.knit.geometry.loop_metrics import (
    approaches,
    away_from_crossings,
    check_yarns,
    honeycomb_angles,
    loop_metrics,
)
from knitstudy.knit.geometry.optimise import CONTACT_TOLERANCE, CostFunction, optimise
from knitstudy.knit.geometry.symmetry import symmetric_motions, symmetries
from knitstudy.knit.scene.documents import read_yaml

CURVATURE_SAMPLES = 12  # a Bezier segment, where curvature is bounded and bending energy summed
NEAREST = 8  # approaches away from crossings whose gap is bounded: more than come near in a quarter
UNUSABLE = 1e3  # residual of control points that make no plain knit
SPREAD = 0.25  # standard deviation, in radii, of the random starts about the first one
SHARPENING = (1e-2, 1e-4)  # shares of the bending weight that follow: in the end it no longer pulls the loop
MOST_EVALUATIONS = 60  # Jacobians a start and weight may cost
DECIMALS = 9  # of metres in the file: a nanometre, a millionth of the radius

HEADER = """\
# Made by `python benchmarks/calibrate.py` from calibration.yaml: change that file, not this one.
# One loop before its optimisation, from sinker centre to sinker centre, SI units. `achieved` is what its
# optimisation makes of it.
"""


@dataclass(frozen=True)
class Problem:
    """What the optimised loop must be like, and how it is searched for; lengths in radii, angles in degrees."""

    # Targets; aspect is the wale over the course spacing.
    length: float
    interlock_angle: float
    leg_angle: float
    aspect: float
    clearance: float
    # Search.
    curvature: float  # largest R over radius of curvature that is free of penalty
    gap: float  # smallest gap away from the crossings that is free of penalty
    flattening: float  # z of the initial loop over z of the optimised one: initial yarns interpenetrate
    bending: float  # weight of the bending energy, small against everything else
    points: int  # control points of a loop, a multiple of 4
    starts: int  # number of starts, all but the first one random
    seed: int
    settings: object  # weights and samples of the optimisation, see `optimise`

    @property
    def quarter(self):
        """Bezier segments of a quarter of the loop."""
        return self.points // 4


@dataclass(frozen=True)
class Candidate:
    """One vector of unknowns, taken apart."""

    wale_spacing: float
    course_spacing: float
    points: np.ndarray  # control points of the optimised loop
    force: float  # contact force 2 alpha (D - 2 - c0) / beta at a crossing

    @classmethod
    def from_unknowns(cls, unknowns, quarter):
        """From w, c, y_0, (x, y) of the points 1 .. quarter - 1, z of 0 .. quarter, and the force."""
        wale, course, y_sinker, *_ = unknowns
        plane, z, force = np.split(unknowns[3:], [2 * (quarter - 1), 3 * quarter - 1])
        xy = np.vstack([[0.0, y_sinker], plane.reshape(-1, 2), [wale / 4, 0.0]])
        return cls(wale, course, whole_loop(np.column_stack([xy, z]), wale), float(force[0]))

    def loop(self, problem, flattening=1.0):
        """The loop of these points, its z components times a factor: Loop, in radii."""
        points = self.points * [1, 1, flattening]
        return Loop(points, self.wale_spacing, self.course_spacing, 1.0, problem.clearance)


def first_guess(problem):
    """Unknowns of a loop of Munden's proportions, c = l/5.3 and w = l/4.1, with an omega shape.

    Munden 1959, "The geometry and dimensional properties of plain-knit fabrics".
    """
    wale, course = problem.length / 4.1, problem.length / 5.3
    x = np.array([0, 0.14, 0.33, 0.29, 0.25]) * wale
    y = np.array([-0.79, -0.77, -0.57, -0.30, 0]) * course
    z = np.array([-1, -1, -0.6, 0.9, 0.9])
    share = np.linspace(0, 4, problem.quarter + 1)
    points = CubicSpline(np.arange(5), np.column_stack([x, y, z]))(share)
    return np.concatenate([[wale, course, points[0, 1]], points[1:-1, :2].ravel(), points[:, 2], [0.0]])


def residuals(unknowns, problem):
    """Everything that must vanish or be small, (r,): targets, conditions of the optimum, bounds, bending.

    Parameters
    ----------
    unknowns : ndarray (3 quarter + 3,)
    """
    try:
        return _residuals(Candidate.from_unknowns(unknowns, problem.quarter), problem)
    except GeometryError:
        count = 5 + problem.quarter + 2 + NEAREST + 2 * problem.quarter * CURVATURE_SAMPLES
        return np.full(count, UNUSABLE)


def _residuals(candidate, problem):
    loop = candidate.loop(problem)
    weights = problem.settings
    curve, points = loop.curve, loop.control_points
    cost = CostFunction(candidate.loop(problem, problem.flattening), weights)
    found = cost.approach(points)
    # Targets, and the distance that balances the contact force.
    interlock, leg = honeycomb_angles(found.point.mean(axis=1), loop.course_spacing)
    opening = candidate.force * weights.beta / (2 * weights.alpha)
    targets = [
        interlock - problem.interlock_angle,
        leg - problem.leg_angle,
        loop.length - problem.length,
        10 * (loop.wale_spacing / loop.course_spacing - problem.aspect),
        30 * (found.distance[0] - cost.target - opening),
    ]
    # Gradient of F with respect to the z components, over beta.
    slope = cost.continuous(points)[1] + weights.beta_0 * cost.join(points)[1]
    slope += weights.gamma / weights.beta * cost.length(points)[1]
    slope += candidate.force * cost.distance_slope(points, found).sum(axis=0)
    free = np.tile([False, False, True], (problem.points, 1))
    motions = symmetric_motions(free, symmetries(loop))
    gradient = np.einsum("pia,pi->a", motions, slope) / motions.sum(axis=(0, 1))
    # Curvature and gaps beyond their bounds, and the bending energy of a quarter of the loop.
    share = np.linspace(0, 1 - 1e-9, CURVATURE_SAMPLES)
    u = (np.arange(problem.quarter)[:, None] + share).ravel()
    curvature = curve.curvature(u)
    size = np.linalg.norm(curve.d1(u), axis=1) / CURVATURE_SAMPLES
    near = approaches(loop, reach=2 * problem.gap + 2, samples=8)
    others = away_from_crossings(near, cost.row, found.parameter)["distance"].to_numpy()[:NEAREST]
    gap = np.pad(others - 2, (0, NEAREST - others.size), constant_values=np.inf)
    return np.concatenate(
        [
            targets,
            gradient,
            [points[:, 2].mean()],  # F does not change when the whole knit moves along z
            10 * np.maximum(problem.gap - gap, 0),
            10 * np.maximum(curvature - problem.curvature, 0),
            np.sqrt(problem.bending * size) * curvature,
        ]
    )


def calibrate(problem):
    """Search from the first guess and random starts: the Candidate with the smallest residuals, all starts' norms.

    Raises GeometryError when no start leads to a plain knit.
    """
    first = first_guess(problem)
    spread = SPREAD * np.random.default_rng(problem.seed).normal(size=(problem.starts, first.size))
    spread[0] = 0.0
    found = [solve(first + each, problem) for each in spread]
    best = min(found, key=lambda each: each.cost)
    if best.cost >= UNUSABLE:
        raise GeometryError(
            f"calibration: none of {problem.starts} starts leads to a plain knit; allow more starts"
        )
    for share in SHARPENING:
        best = solve(best.x, replace(problem, bending=share * problem.bending))
    return Candidate.from_unknowns(best.x, problem.quarter), [float(np.sqrt(2 * each.cost)) for each in found]


def solve(start, problem):
    """Least squares from one vector of unknowns: scipy's OptimizeResult."""
    return least_squares(residuals, start, args=(problem,), x_scale="jac", max_nfev=MOST_EVALUATIONS)


# ---- Files


def main(arguments=None):
    """Calibrate the loop, confirm it by the optimisation and write its file; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python benchmarks/calibrate.py", description=__doc__)
    parser.add_argument(
        "--config", type=Path, default=Path("config"), help="folder of calibration.yaml and defaults.yaml"
    )
    parser.add_argument(
        "--output", type=Path, help="the file to write (default: calibrated_loop.yaml in the folder)"
    )
    options = parser.parse_args(arguments)
    try:
        problem, radius = read_problem(options.config)
        candidate, norms = calibrate(problem)
        for number, norm in enumerate(norms):
            print(f"start {number}: residual {norm:.4g}")
        record = loop_record(candidate, problem, radius)
        with replacing(options.output or options.config / "calibrated_loop.yaml") as temporary:
            text = yaml.safe_dump(record, sort_keys=False, default_flow_style=None, width=110)
            temporary.write_text(HEADER + text, encoding="utf-8")
    except KnitstudyError as error:
        print(error, file=sys.stderr)
        return 1
    print(yaml.safe_dump(record["achieved"], sort_keys=False), end="")
    return 0


def read_problem(folder):
    """The calibration that calibration.yaml and defaults.yaml of a folder describe: Problem, radius of the yarn [m].

    Raises ConfigurationError when a file or a key is missing, or a value is not a number.
    """
    path = folder / "calibration.yaml"
    document = read_yaml(path)
    defaults = read_yaml(folder / "defaults.yaml")
    try:
        wanted = {name: float(target["value"]) for name, target in document["targets"].items()}
        search = {name: float(value) for name, value in document["search"].items()}
        search |= {name: int(search[name]) for name in ("points", "starts", "seed")}
        weights = {name: float(defaults["geometry"][name]) for name in ("alpha", "beta", "gamma", "beta_0")}
        samples = int(defaults["geometry"]["samples"])
        free = ("z",) * search["points"]
        radius = 0.5 * wanted.pop("diameter")
        wanted["length"] /= radius
        settings = SimpleNamespace(**weights, samples=samples, free=free)
        clearance = float(defaults["pattern"]["clearance"])
        return Problem(**wanted, **search, clearance=clearance, settings=settings), radius
    except KeyError as error:
        raise ConfigurationError(f"{path}: the key {error} is missing") from error
    except (AttributeError, TypeError, ValueError) as error:
        raise ConfigurationError(f"{path}: a key or number is missing or not allowed: {error}") from error


def loop_record(candidate, problem, radius):
    """The initial loop in SI units, and what its optimisation makes of it: dict of plain numbers.

    Raises GeometryError when the optimisation does not confirm the loop.
    """
    wale = round(float(candidate.wale_spacing) * radius, DECIMALS)
    course = round(float(candidate.course_spacing) * radius, DECIMALS)
    quarter = candidate.points[: problem.quarter + 1] * [1, 1, problem.flattening] * radius
    quarter = np.round(quarter, DECIMALS)
    quarter[-1, 0] = wale / 4
    loop = Loop(whole_loop(quarter, wale), wale, course, radius, problem.clearance)
    optimised, _ = optimise(loop, problem.settings)
    before, after = loop_metrics(loop), loop_metrics(optimised)
    check_yarns(after, optimised, CONTACT_TOLERANCE)
    achieved = {
        "interlock_angle": after.interlock_angle,
        "leg_angle": after.leg_angle,
        "length_over_target": after.length / (problem.length * radius),
        "length_over_initial": after.length / before.length,
        "radius_over_radius_of_curvature": radius / after.radius_of_curvature,
        "contact_error_over_radius": np.abs(after.distance - optimised.target).max() / radius,
        "other_gap_over_radius": after.other_gap / radius,
        "penetration_before_over_radius": before.penetration / radius,
    }
    return {
        "control_points": np.round(loop.control_points, DECIMALS + 3).tolist(),
        "wale_spacing": wale,
        "course_spacing": course,
        "diameter": 2 * radius,
        "free": list(problem.settings.free),
        "achieved": {name: round(float(value), 6) for name, value in achieved.items()},
    }


if __name__ == "__main__":
    sys.exit(main())
