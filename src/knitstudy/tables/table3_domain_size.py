"""Cost and response of square knits of rising size."""

from __future__ import annotations

from collections.abc import Callable
from math import nan

import numpy as np
import pandas as pd
import xarray as xr
from numpy.polynomial import Polynomial

from knitstudy.geometry.fabric import Fabric, cut_cells
from knitstudy.geometry.loop import Loop
from knitstudy.measures.catalogue import SQUARES, Datasets, Scenes, one, several
from knitstudy.measures.cost import (
    MEGABYTE,
    Series,
    domain_response,
    effort,
    memory_growth,
    series_of,
)
from knitstudy.measures.paper_values import number, number_if_printed
from knitstudy.mesh.mesher import slices_of
from knitstudy.mesh.section import Section
from knitstudy.models.joints import contacts_of_crossings, joint_points
from knitstudy.models.network_2d import planar_network
from knitstudy.models.network_3d import spatial_network
from knitstudy.tables.catalogue import TABLES

KILOBYTE = 1e3

COLUMNS = [
    *("model", "interaction", "cells in a row [1]", "scene", "degrees of freedom [1]"),
    *("memory growth [MB]", "memory over its law [1]", "memory of an unknown [kB]"),
    *("time of a Newton iteration [s]", "time of a path [s]", "Newton iterations [1]", "increments [1]"),
]

LARGEST = 30  # Cells in a row of the paper's largest knit
KNITS = several("simulation", *SQUARES, fewest=12)  # Fewer are not all of Table 3


@TABLES.add("table3_domain_size", "Cost of square knits of rising size", results={"domain": KNITS}, order=5)
def tabulate(domain: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every size of every series."""
    rows = []
    for series in series_of(scenes[name] for name in domain):
        dof, memory, seconds = _costs(series, domain)
        over_law = memory / series.memory(dof, memory)(dof)
        for place, scene in enumerate(series.scenes):
            work = effort(domain[scene.name])
            row = {
                "model": series.model,
                "interaction": series.interaction,
                "cells in a row [1]": int(series.cells[place]),
                "scene": scene.name,
                "degrees of freedom [1]": int(dof[place]),
                "memory growth [MB]": memory[place],
                "memory over its law [1]": over_law[place],
                "memory of an unknown [kB]": memory[place] * MEGABYTE / KILOBYTE / dof[place],
                "time of a Newton iteration [s]": seconds[place],
                "time of a path [s]": work["time [s]"],
            }
            rows.append(row | work)
    return pd.DataFrame(rows, columns=COLUMNS)


def _costs(series: Series, domain: Datasets) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return degrees of freedom (k,), memory growth (k,) [MB] and seconds (k,) of a Newton iteration."""
    histories = [domain[scene.name] for scene in series.scenes]
    iterations = [max(int(history["newton_iterations"].sum()), 1) for history in histories]
    seconds = [float(history["seconds"].sum()) for history in histories]
    return (
        np.array([float(history.attrs["dof"]) for history in histories]),
        np.array([memory_growth(history) for history in histories]) / MEGABYTE,
        np.divide(seconds, iterations),
    )


@TABLES.add(
    "domain_growth", "Growth of cost with the size of the domain", results={"domain": KNITS}, order=5.5
)
def tabulate_growth(domain: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every series: how unknowns, memory and time grow."""
    rows = []
    for series in series_of(scenes[name] for name in domain):
        dof, memory, seconds = _costs(series, domain)
        paths = [float(domain[scene.name].attrs["wall_seconds"]) for scene in series.scenes]
        largest = series.memory(dof, memory)(series.unknowns(dof)(LARGEST))
        rows.append(
            {
                "model": series.model,
                "interaction": series.interaction,
                "cells in a row [1]": ", ".join(map(str, series.cells)),
                "exponent of degrees of freedom [1]": series.growth(dof),
                "exponent of memory growth [1]": series.growth(memory),
                "exponent of the time of a Newton iteration [1]": series.growth(seconds),
                "exponent of the time of a path [1]": series.growth(paths),
                "memory growth of 30 x 30 cells, by its law [MB]": largest,
            }
        )
    return pd.DataFrame(rows)


@TABLES.add(
    "domain_response",
    "Response of square knits of rising size",
    results={"domain": KNITS, "domain_contacts": several("contacts", *SQUARES)},
    order=5.7,
)
def tabulate_response(domain: Datasets, domain_contacts: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every size of every series; contacts are those of the direct simulations."""
    rows = []
    for series in series_of(scenes[name] for name in domain):
        found = [domain_response(scene, domain, domain_contacts) for scene in series.scenes]
        largest = found[-1]
        rows += [
            {
                "model": series.model,
                "interaction": series.interaction,
                "cells in a row [1]": int(cells),
                "scene": scene.name,
                "strain [1]": float(domain[scene.name]["strain"][-1]),
                "force over width [N/m]": response.force,
                "the same, over that of the largest knit [1]": response.force / largest.force,
                "largest |u_z| [m]": response.out_of_plane,
                "mean normal force in the centre cell [N]": response.normal,
                "the same, over that of the largest knit's [1]": response.normal / largest.normal,
            }
            for cells, scene, response in zip(series.cells, series.scenes, found, strict=True)
        ]
    return pd.DataFrame(rows)


# ---- Counts without a solution, beside Tables 3 and 5

SIZES = (3, 6, 8, 20, 30)  # cells in a row of Table 3


def law_of(count: Callable[[Fabric], int], loop: Loop) -> Polynomial:
    """Return the law a n^2 + b n of what is counted in n x n cut cells, from one cell and from 2 x 2."""
    single, four = (count(cut_cells(loop, n, n)) for n in (1, 2))
    return Polynomial([0.0, 2 * single - four / 2, four / 2 - single])


@TABLES.add(
    "counted_unknowns",
    "Tables 3 and 5: degrees of freedom of square knits",
    results={
        "geometry": one("geometry", "dns-tie-course"),
        "squares": several("simulation", *SQUARES, optional=True),
    },
    order=4.9,
)
def tabulate_unknowns(
    geometry: xr.Dataset, scenes: Scenes, paper: pd.DataFrame, squares: Datasets | None = None
) -> pd.DataFrame:
    """Return one row for every model and size of knits of cut cells, counted without a solution.

    Counts are a n^2 + b n: n x n cells have n^2 times the yarn of a cell, in 3 n pieces. The paper's solver adds
    c n (n - 2) unknowns for the rows in contact; penalties add none. Beside these counts stands what three multipliers
    at every surface node of one yarn of each pair would add. Memory follows from its linear law in the unknowns where
    knits of several sizes were simulated; its uncertainty is the largest distance of these from the law.
    """
    loop, scene = Fabric.from_dataset(geometry).loop, scenes["dns-tie-course"]
    section, beam = (
        Section.for_size(scene.yarn.diameter, scene.mesh.size),
        number(paper, "5", "rom3d 3x3", "mesh size"),
    )
    slices = law_of(lambda fabric: slices_of(fabric, scene.mesh.size, scene.mesh.growth), loop)
    touching, none, solid = Polynomial([0, -2, 1]), Polynomial([nan]), 3 * section.size * slices
    multiplied = solid + 3 * len(section.ring) * slices.coef[2] * touching
    tied = number(paper, "5", "dns-tie 3x3", "degrees of freedom") / 9 * Polynomial([0, 0, 1])
    contact = (number(paper, "3", "c3w3", "degrees of freedom") - tied(3)) / 3 * touching
    at = contacts_of_crossings
    spatial = law_of(lambda knit: spatial_network(knit, joint_points(knit, at(knit)), beam).beam_nodes, loop)
    planar = law_of(lambda knit: planar_network(knit, at(knit)).beam_nodes, loop)
    # Model, middle of its scenes' names, counts without and with multipliers, case of printed numbers and their law
    models = (
        ("hexahedra, ties", "hexahedra-tie", solid, none, "dns-tie {n}x{n}", tied),
        ("hexahedra, contact", "hexahedra-isotropic", solid, multiplied, "c{n}w{n}", tied + contact),
        ("3D network, ties", "rom3d-tie", 6 * spatial, none, "rom3d {n}x{n}", none),
        ("2D network, ties", "rom2d-tie", 6 * planar, none, "rom2d {n}x{n}", none),
    )
    series = {each.stem: each for each in series_of(scenes[name] for name in squares or ())}
    rows = []
    for name, stem, unknowns, more, case, law in models:
        memory, uncertain = none, nan
        if (measured := series.get(f"domain-{stem}-course")) is not None:
            dof, grown, _ = _costs(measured, squares)
            memory = measured.memory(dof, grown)
            uncertain = np.abs(grown / memory(dof) - 1).max()
        for n in SIZES:
            of_paper = (paper, "3" if case.startswith("c") else "5", case.format(n=n))
            printed = number_if_printed(*of_paper, "degrees of freedom")
            rows.append(
                {
                    "model": name,
                    "cells in a row [1]": n,
                    "degrees of freedom [1]": round(unknowns(n)),
                    "with multipliers [1]": more(n),
                    "degrees of freedom, paper [1]": printed,
                    "the paper's law [1]": law(n),
                    "over the paper's [1]": unknowns(n) / (printed if np.isnan(law(n)) else law(n)),
                    "memory growth, by its law [MB]": memory(unknowns(n)),
                    "uncertainty of the memory [1]": uncertain,
                    "memory, paper [MB]": number_if_printed(*of_paper, "memory"),
                }
            )
    return pd.DataFrame(rows)
