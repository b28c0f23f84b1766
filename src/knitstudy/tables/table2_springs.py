"""Table 2: springs that stand for contact, from direct simulations, beside the paper's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.measures.paper_values import number
from knitstudy.models.springs import AXES, MEASURES, Springs, springs
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

STATISTICS = {
    "averaged, sum(F d) / sum(d d)": lambda found: found.averaged,
    "averaged, mean of F / d": lambda found: _over_crossings(np.mean, found),
    "standard deviation of F / d": lambda found: _over_crossings(np.std, found),
    "smallest F / d": lambda found: _over_crossings(np.min, found),
    "largest F / d": lambda found: _over_crossings(np.max, found),
}
"""What is made of the secants of the crossings; reduced models use the first."""

AVERAGES = tuple(STATISTICS)[:2]
"""What the paper's numbers may be."""


@TABLES.add(
    "table2_springs",
    "Table 2: all springs that stand for contact",
    needs=("sprung_contacts", "paper", "scenes"),
    order=5,
)
def tabulate(
    sprung_contacts: Mapping[str, xr.Dataset], paper: pd.DataFrame, scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return one row a scene, displacement measure, statistic and axis.

    A measure that a simulation has not recorded is left out.

    Parameters
    ----------
    sprung_contacts : mapping of str to Dataset
        Contacts of direct simulations with contact, by any names (see docs/files.md).
    paper : DataFrame
        ``resources/reference/paper_tables.csv``.
    scenes : mapping of str to Scene
        Their scenes, by the same names.

    Raises
    ------
    DataFileError
        If a simulation is one of ties, or its scene is not given.
    """
    rows = [row for name, found in sprung_contacts.items() for row in _rows(name, found, paper, scenes)]
    return pd.DataFrame(rows)


def _rows(
    name: str, contacts: xr.Dataset, paper: pd.DataFrame, scenes: Mapping[str, Scene]
) -> Iterator[dict]:
    if name not in scenes:
        raise DataFileError(f"table2_springs has contacts of {name!r} but not its scene: both are needed")
    scene = scenes[name]
    if contacts["tied"].all():
        raise DataFileError(
            f"the contacts of {name!r} are all tied: springs come from a dns scene with contact"
        )
    measures = [measure for measure, variable in MEASURES.items() if variable in contacts]
    for measure, axes in product(measures, AXES):
        found = springs(contacts, measure, axes)
        for statistic, of in STATISTICS.items():
            comparable = axes == "global" and statistic in AVERAGES and scene.interaction == "isotropic"
            for axis, value in enumerate(of(found)):
                theirs = _reported(paper, scene, found.axes[axis]) if comparable else np.nan
                yield {
                    "scene": scene.name,
                    "load": scene.load.direction,
                    "interaction": scene.interaction,
                    "contact stiffness over E / h [1]": scene.contact.normal_stiffness,
                    "displacement": measure,
                    "statistic": statistic,
                    "axis": found.axes[axis],
                    "stiffness [N/m]": value,
                    "paper [N/m]": theirs,
                    "over paper's [1]": value / theirs,
                    "crossings [1]": found.used[axis],
                    "negative [1]": found.negative[axis],
                    "undefined [1]": found.undefined[axis],
                    "open [1]": int(found.open.sum()),
                }


def _over_crossings(statistic, found: Springs) -> list[float]:
    """A statistic (a,) of the crossings that have a secant; nan where none has."""
    columns = (column[np.isfinite(column)] for column in found.stiffness.T)
    return [float(statistic(column)) if len(column) else np.nan for column in columns]


def _reported(paper: pd.DataFrame, scene: Scene, axis: str) -> float:
    return number(paper, "2", scene.load.direction, f"spring stiffness k{axis}")


# ---- Table 2 at a glance: the averaged springs of interfaces, one row a direct simulation


DISPLACEMENT, STATISTIC = "interface", next(iter(STATISTICS))
"""What is shown: what the main reduced models use."""

NAMES = {"x": "kx", "y": "ky", "z": "kz", "normal": "normal to contact", "tangential": "along contact"}
"""Columns by axis."""


@TABLES.add(
    "springs",
    "Table 2 at a glance: springs",
    needs=("sprung_contacts", "paper", "scenes"),
    order=4,
)
def tabulate_averages(
    sprung_contacts: Mapping[str, xr.Dataset], paper: pd.DataFrame, scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return stiffnesses along all axes beside the paper's, and how many of the crossings are negative.

    Parameters
    ----------
    sprung_contacts, paper, scenes
        As of `table2_springs`.
    """
    springs = tabulate(sprung_contacts, paper, scenes)
    shown = springs[(springs["displacement"] == DISPLACEMENT) & (springs["statistic"] == STATISTIC)]
    return pd.DataFrame(
        [
            _row_of_averages(name, of.set_index("axis"), scenes)
            for name, of in shown.groupby("scene", sort=False)
        ]
    )


def _row_of_averages(name: str, of: pd.DataFrame, scenes: Mapping[str, Scene]) -> dict:
    scene, first = scenes[name], of.iloc[0]
    row = {
        "scene": name,
        "load": first["load"],
        "interaction": first["interaction"],
        "mesh size [m]": scene.value("mesh.size"),
        "contact stiffness over E / h [1]": scene.contact.normal_stiffness,
        "penalty alone": scene.contact.augmentations == 0,
    }
    for axis, column in NAMES.items():
        row[f"{column} [N/m]"] = of.loc[axis, "stiffness [N/m]"]
    for axis in "xyz":
        row[f"k{axis}, paper [N/m]"] = of.loc[axis, "paper [N/m]"]
    for axis in "xyz":
        row[f"k{axis} negative at crossings [1]"] = int(of.loc[axis, "negative [1]"])
    return row | {"crossings [1]": int(first["crossings [1]"])}
