"""Calibrate the loop, confirm it by the optimisation and write it as a file of the configuration.

python -m knitstudy.geometry.calibrate --help
"""

import argparse
import sys
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import yaml

from knitstudy.errors import ConfigurationError, KnitstudyError
from knitstudy.files.replacing import replacing
from knitstudy.geometry.calibration import Problem, calibrate, whole_loop
from knitstudy.geometry.loop import Loop
from knitstudy.geometry.optimise import CONTACT_TOLERANCE, optimise
from knitstudy.geometry.survey import check_yarns, survey

DECIMALS = 9
"""Decimals of metres in the file: a nanometre, a millionth of the radius."""

TARGETS = ("interlock_angle", "leg_angle", "length", "diameter", "aspect")
SEARCH = ("points", "curvature", "gap", "flattening", "bending", "starts", "seed")

HEADER = """\
# Made by `python -m knitstudy.geometry.calibrate` from calibration.yaml: change that file, not this one.
# One loop before its optimisation, from sinker centre to sinker centre, SI units. `achieved` is what its
# optimisation makes of it.
"""


def main(arguments=None):
    """Run the calibration from the command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m knitstudy.geometry.calibrate", description=__doc__)
    parser.add_argument(
        "--config", type=Path, default=Path("config"), help="folder of calibration.yaml and defaults.yaml"
    )
    parser.add_argument(
        "--output", type=Path, help="the file to write (default: calibrated_loop.yaml in the folder)"
    )
    options = parser.parse_args(arguments)
    try:
        problem, radius, search = read_problem(options.config)
        candidate, outcomes = calibrate(problem, int(search["starts"]), int(search["seed"]))
        for outcome in outcomes:
            print(f"start {outcome['start']}: residual {outcome['residual']:.4g}")
        record = loop_record(candidate, problem, radius)
        write(record, options.output or options.config / "calibrated_loop.yaml")
    except KnitstudyError as error:
        print(error, file=sys.stderr)
        return 1
    print(yaml.safe_dump(record["achieved"], sort_keys=False), end="")
    return 0


def read_problem(folder):
    """The calibration that a configuration folder describes.

    Parameters
    ----------
    folder : Path
        With calibration.yaml (targets and search) and defaults.yaml (clearance, weights and samples).

    Returns
    -------
    problem : Problem
    radius : float
        Of the yarn. [m]
    search : dict
        The group ``search``.

    Raises
    ------
    ConfigurationError
        When a file or a key is missing, or a value is no number.
    """
    targets, search = _targets_and_search(folder / "calibration.yaml")
    clearance, weights = _clearance_and_weights(folder / "defaults.yaml")
    points, radius = int(search["points"]), 0.5 * targets["diameter"]
    problem = Problem(
        length=targets["length"] / radius,
        interlock_angle=targets["interlock_angle"],
        leg_angle=targets["leg_angle"],
        aspect=targets["aspect"],
        clearance=clearance,
        curvature=search["curvature"],
        gap=search["gap"],
        flattening=search["flattening"],
        bending=search["bending"],
        points=points,
        settings=SimpleNamespace(**weights, free=("z",) * points),
    )
    return problem, radius, search


def _targets_and_search(path):
    document = _load(path)
    with _naming(path):
        targets = {name: float(document["targets"][name]["value"]) for name in TARGETS}
        return targets, {name: float(document["search"][name]) for name in SEARCH}


def _clearance_and_weights(path):
    document = _load(path)
    with _naming(path):
        weights = {name: float(document["geometry"][name]) for name in ("alpha", "beta", "gamma", "beta_0")}
        weights["samples"] = int(document["geometry"]["samples"])
        return float(document["pattern"]["clearance"]), weights


@contextmanager
def _naming(path):
    """Say in which file a key is missing or a value is no number."""
    try:
        yield
    except KeyError as error:
        raise ConfigurationError(f"{path}: the key {error} is missing") from error
    except (TypeError, ValueError) as error:
        raise ConfigurationError(f"{path}: a value is not the number that is needed: {error}") from error


def _load(path):
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError) as error:
        raise ConfigurationError(f"{path}: cannot be read as YAML: {error}") from error


def loop_record(candidate, problem, radius):
    """The initial loop in SI units, and what its optimisation makes of it.

    Parameters
    ----------
    candidate : Candidate
    problem : Problem
    radius : float
        Of the yarn. [m]

    Returns
    -------
    dict

    Raises
    ------
    GeometryError
        When the optimisation does not confirm the loop.
    """
    wale = round(float(candidate.wale_spacing) * radius, DECIMALS)
    course = round(float(candidate.course_spacing) * radius, DECIMALS)
    quarter = candidate.points[: problem.quarter + 1] * [1, 1, problem.flattening] * radius
    quarter = np.round(quarter, DECIMALS)
    quarter[-1, 0] = wale / 4
    loop = Loop(whole_loop(quarter, wale), wale, course, radius, problem.clearance)
    optimised, _ = optimise(loop, problem.settings)
    return {
        "control_points": np.round(loop.control_points, DECIMALS + 3).tolist(),
        "wale_spacing": wale,
        "course_spacing": course,
        "diameter": 2 * radius,
        "free": list(problem.settings.free),
        "achieved": achieved(loop, optimised, problem),
    }


def achieved(initial, optimised, problem):
    """Targets, results and residuals of a calibrated loop: dict of plain numbers.

    Parameters
    ----------
    initial, optimised : Loop
    problem : Problem
    """
    before, after = survey(initial), survey(optimised)
    check_yarns(after, optimised, CONTACT_TOLERANCE)
    radius = optimised.radius
    return {
        name: round(float(value), 6)
        for name, value in {
            "interlock_angle": after.interlock_angle,
            "leg_angle": after.leg_angle,
            "length_over_target": after.length / (problem.length * radius),
            "length_over_initial": after.length / before.length,
            "radius_over_radius_of_curvature": radius / after.radius_of_curvature,
            "contact_error_over_radius": np.abs(after.distance - optimised.target).max() / radius,
            "other_gap_over_radius": after.other_gap / radius,
            "penetration_before_over_radius": before.penetration / radius,
        }.items()
    }


def write(record, path):
    """Write a calibrated loop as YAML, whole or not at all."""
    with replacing(path) as temporary:
        text = yaml.safe_dump(record, sort_keys=False, default_flow_style=None, width=110)
        temporary.write_text(HEADER + text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
