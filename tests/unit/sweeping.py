"""Sweeps of course spacing and yarn diameter, made up: the scenes of the study, and their made-up results."""

import pandas as pd
import study

from knitstudy.measures.reference import NEEDED, problem_of
from knitstudy.measures.response import LARGEST_U_Z
from knitstudy.paper.sweeps import DRAWN
from knitstudy.run.configuration import load_scenes, load_study

LIFT, SURE = 4e-4, 0.01
"""Of the loop as it is drawn [m], of which the largest |u_z| is twice, and the reference's relative uncertainty."""


def scenes():
    """Return the scenes of all sweeps of the study by name."""
    known = load_scenes()
    drawn = [name.format(kind) for name in DRAWN for kind in ("tie", "isotropic")]
    return {name: known[name] for name in load_study("full") if name in drawn or name.startswith("sweep-")}


def reference(scenes):
    """Return a reference that the loop as it is drawn meets."""
    problem = problem_of(scenes["yarns-isotropic-course"])
    return pd.DataFrame([(problem, LARGEST_U_Z, 0.05, 2 * LIFT, SURE * 2 * LIFT)], columns=NEEDED)


def histories(scenes, slopes):
    """Return histories whose u_z depends on the spacing's ratio, and on the diameter over the drawn one, by a slope."""

    def lift(scene):
        ratio, thick = scene.pattern.course_ratio, scene.yarn.diameter / 1.8e-3
        slope = slopes.get(scene.pattern.keep, slopes["shape"])
        return LIFT * (1 + slope * (ratio - 1) - slope * (thick - 1))

    return {name: study.history(lift=lift(scene), scene=name) for name, scene in scenes.items()}
