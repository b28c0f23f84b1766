"""All figures by name: what each shows, which results it needs, and how it is drawn.

A new figure is a module with a function ``draw(**datasets) -> Figure``, an entry here, and a caption in
``workflow/report/``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from knitstudy.catalogue import TIED_COURSE, Entry, find, select

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


FIGURES = {
    "fig15a_force_strain": Entry(
        "Fig. 15a: force against strain in course direction, ties",
        ("dns", "rom3d", "rom2d"),
        TIED_COURSE,
    ),
    "fig01_unit_cell": Entry("Fig. 1: unit cell before and after optimisation", ("geometry",), TIED_COURSE),
    "fig02_interfaces": Entry("Fig. 2: tie constraint and contact with friction", (), {}),
    "fig04_honeycomb": Entry(
        "Fig. 4: 2D reduced model on the solid knit", ("geometry", "mesh", "contacts"), TIED_COURSE
    ),
    "fig05_contact_points": Entry(
        "Fig. 5: points of the 3D reduced model", ("geometry", "contacts"), TIED_COURSE
    ),
    "fig06_joints": Entry(
        "Fig. 6: 3D reduced model and its joints", ("geometry", "contacts", "rom3d"), TIED_COURSE
    ),
}
"""In the order of the report: the main comparison first."""


def entry(name: str) -> Entry:
    """Return a figure's entry.

    Raises
    ------
    ConfigurationError
        When there is no such figure; the message names those that there are.
    """
    return find("figure", FIGURES, name)


def draw(name: str, **datasets: xr.Dataset) -> Figure:
    """Draw a figure from the results that its entry names.

    Raises
    ------
    ConfigurationError
        When there is no such figure, or something that it needs is missing.
    """
    sources = select("figure", FIGURES, name, datasets)
    return import_module(f"knitstudy.figures.{name}").draw(**sources)
