"""Table 2: springs that stand for contact, from direct simulations, and the paper's."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.yarns.joints import AXES, MAIN, MEASURES, NORMALS, springs
from knitstudy.paper.paper_values import number
from knitstudy.run.catalogue import OTHER_SOLIDS, SOLIDS, TABLES, Datasets, Scenes, of_cases, several

# Names of the direct simulations with rough contact or friction.
TOUCHING = of_cases(
    ("rough-course", "rough-wale", "isotropic-course", "isotropic-wale"),
    (*SOLIDS, *OTHER_SOLIDS, "dns-{case}-penalty*"),
)

# Springs of reduced models: crossings count by their displacements
AVERAGED = "averaged, sum(F d) / sum(d d) [N/m]"
SECANTS = {  # Statistics of the secants of the crossings
    "mean of F / d [N/m]": "mean",
    "standard deviation of F / d [N/m]": "std",
    "smallest F / d [N/m]": "min",
    "largest F / d [N/m]": "max",
}

DISPLACEMENT = "interface"  # Of the main reduced models
# Normals and axes of the springs: main normal along all axes, other normals along local axes.
SHOWN = ("local", "global")  # of the table at a glance
READINGS = [(MAIN, axes) for axes in AXES] + [(normal, "local") for normal in NORMALS if normal != MAIN]


@TABLES.add(
    "table2_springs",
    "Table 2: all springs that stand for contact",
    results={"contacts": several("contacts", *TOUCHING)},
    order=5,
)
def tabulate(contacts: Datasets, paper: pd.DataFrame, scenes: Scenes) -> pd.DataFrame:
    """Return one row a scene, displacement measure that it has recorded, normal, axes and axis.

    The paper does not say how it averages: its numbers may be the weighted average or the mean. Raises
    DataFileError if all crossings of a simulation are tied.
    """
    return pd.DataFrame(
        [row for name, dataset in contacts.items() for row in _rows(scenes[name], dataset, paper)]
    )


def _rows(scene: Scene, contacts: xr.Dataset, paper: pd.DataFrame) -> Iterator[dict]:
    if contacts["tied"].all():
        raise DataFileError(
            f"the contacts of {scene.name!r} are all tied: springs come from a scene of solid yarns with contact"
        )
    direction = scene.load.direction
    measures = [measure for measure, variable in MEASURES.items() if variable in contacts]
    for measure, (normal, axes) in product(measures, READINGS):
        measured = springs(contacts, measure, axes, normal)
        secants = np.ma.masked_invalid(measured.stiffness)
        over = {name: np.ma.filled(getattr(secants, of)(axis=0), np.nan) for name, of in SECANTS.items()}
        for place, axis in enumerate("xyz"):
            printed = (paper, "2", direction, f"spring stiffness k{axis}")
            theirs = number(*printed) if scene.interaction == "isotropic" else np.nan
            yield {
                "scene": scene.name,
                "load": direction,
                "interaction": scene.interaction,
                "contact stiffness over E / h [1]": scene.value("contact.normal_stiffness"),
                "displacement": measure,
                "normal": normal,
                "axes": axes,
                "axis": axis,
                AVERAGED: measured.averaged[place],
                "paper [N/m]": theirs,
                "averaged, over the paper's [1]": measured.averaged[place] / theirs,
                **{name: values[place] for name, values in over.items()},
                "crossings [1]": measured.used[place],
                "negative [1]": measured.negative[place],
                "undefined [1]": measured.undefined[place],
                "open [1]": int(measured.open.sum()),
            }


@TABLES.add(
    "springs", "Table 2 at a glance: springs", results={"contacts": several("contacts", *TOUCHING)}, order=4
)
def tabulate_averages(contacts: Datasets, paper: pd.DataFrame, scenes: Scenes) -> pd.DataFrame:
    """Return one row a simulation and axes: the averaged springs of interfaces and the paper's."""
    found = tabulate(contacts, paper, scenes)
    shown = found[
        (found["displacement"] == DISPLACEMENT) & (found["normal"] == MAIN) & found["axes"].isin(SHOWN)
    ]
    rows = []
    for (name, axes), of in shown.groupby(["scene", "axes"], sort=False):
        scene, by_axis = scenes[name], of.set_index("axis")
        measured, theirs = (by_axis[column] for column in (AVERAGED, "paper [N/m]"))
        row = {
            "scene": name,
            "load": scene.load.direction,
            "interaction": scene.interaction,
            "mesh size [m]": scene.metres("mesh.size"),
            "contact stiffness over E / h [1]": scene.value("contact.normal_stiffness"),
            "penalty alone": scene.value("contact.augmentations") == 0,
            "axes": axes,
        }
        row |= {f"k{axis} [N/m]": measured[axis] for axis in "xyz"}
        row |= {f"k{axis}, paper [N/m]": theirs[axis] for axis in "xyz"}
        for above, below in ("zx", "xy"):
            row[f"k{above} / k{below} [1]"] = measured[above] / measured[below]
            row[f"k{above} / k{below}, paper [1]"] = theirs[above] / theirs[below]
        row |= {
            f"k{axis} negative at crossings [1]": int(by_axis.loc[axis, "negative [1]"]) for axis in "xyz"
        }
        row["x and y alike [N/m]"] = springs(contacts[name], DISPLACEMENT, axes).tangential
        rows.append(row | {"crossings [1]": int(of.iloc[0]["crossings [1]"])})
    return pd.DataFrame(rows)
