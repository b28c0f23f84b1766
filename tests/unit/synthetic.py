"""Results as the stages would write them, made up: small, exact, and without a simulation."""

import numpy as np
import xarray as xr

from knitstudy.geometry.pattern import Knit

TERMS = ("distance", "continuous", "join", "bending", "length", "total")


def history(strain=(0.0, 0.025, 0.05), force=(0.0, 5.0, 10.0), lift=0.0, yarns=2, stations=5, **attributes):
    """History of yarns along x of 10 mm, one above the other, that bulge by `lift` [m] at full load."""
    s = np.linspace(0, 0.01, stations)
    yarn, arc_length = np.repeat(np.arange(yarns), stations), np.tile(s, yarns)
    position = np.column_stack([arc_length, 5e-3 * yarn, 0 * arc_length])
    strain = np.array(strain)
    motion = np.zeros((len(strain), len(yarn), 3))
    motion[-1, :, 2] = lift * np.sin(np.pi * arc_length / 0.01) * (1 + yarn)
    cost = {
        "dof": 600,
        "unknowns": 500,
        "elements": 90,
        "memory_growth": 2e6,
        "memory_peak": 3e8,
        "wall_seconds": 1.5,
    }
    return xr.Dataset(
        {
            "strain": ("increment", strain),
            "displacement": ("increment", 0.01 * strain),
            "force": ("increment", np.array(force, dtype=float)),
            "newton_iterations": ("increment", np.full(len(strain), 3)),
            "yarn": ("station", yarn),
            "arc_length": ("station", arc_length),
            "centreline": (("station", "xyz"), position),
            "centreline_displacement": (("increment", "station", "xyz"), motion),
        },
        attrs=cost | attributes,
    )


def history_of(knit, size=2e-3):
    """History whose stations follow the centrelines of a knit, without any motion."""
    s = [np.linspace(0, c.length, int(c.length / size)) for c in knit.centrelines]
    position = np.concatenate([c.position(at) for c, at in zip(knit.centrelines, s, strict=True)])
    yarn = np.repeat(np.arange(len(s)), [len(at) for at in s])
    return xr.Dataset(
        {
            "yarn": ("station", yarn),
            "arc_length": ("station", np.concatenate(s)),
            "centreline": (("station", "xyz"), position),
        },
        attrs={"scene": "rom3d-a", "scene_hash": "0123"},
    )


def geometry(knit: Knit, flattened=0.5):
    """Geometry of a knit that was optimised from a flatter one."""
    before = knit.loop.control_points * [1.0, 1.0, flattened]
    wanted = (2 + knit.loop.clearance) * knit.loop.radius
    state = {
        "penetration": [4e-4, 0.0],
        "gap": [-4e-4, 1.8e-5],
        "other_gap": [1e-3, 1.1e-3],
        "radius_of_curvature": [2e-3, 2.5e-3],
        "loop_length": [40e-3, 40.2e-3],
        "interlock_angle": [60.0, 66.5],
        "leg_angle": [75.0, 80.0],
    }
    return knit.to_dataset().assign(
        control_points_before=(("point", "xyz"), before),
        cost=(("state", "term"), np.arange(12.0).reshape(2, 6)),
        crossing_distance=(("state", "cell_zone"), [[wanted - 4e-4] * 4, [wanted + 1e-8] * 4]),
        state=["before", "after"],
        term=list(TERMS),
        **{name: ("state", values) for name, values in state.items()},
    )
