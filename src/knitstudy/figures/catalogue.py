"""All figures by name: what each shows, which results it needs, and how it is drawn.

A new figure is a module with a function ``draw(**sources) -> Figure``, an entry here, and a caption in
``workflow/report/``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from knitstudy.catalogue import ISOTROPIC_COURSE, TIED_COURSE, Entry, find, module_of, select

if TYPE_CHECKING:
    from matplotlib.figure import Figure


FIGURES = {
    "fig15a_force_strain": Entry(
        "Fig. 15a: force against strain in course direction, ties",
        ("dns", "rom3d", "rom2d"),
        TIED_COURSE,
    ),
    "fig01_unit_cell": Entry("Fig. 1: unit cell before and after optimisation", ("geometry",), TIED_COURSE),
    "fig02_interfaces": Entry("Fig. 2: tie constraint and contact with friction", (), {}),
    "fig03a_interactions": Entry(
        "Fig. 3a: crossings that are tied and that touch with friction",
        ("geometry", "contacts"),
        ISOTROPIC_COURSE,
    ),
    "fig04_honeycomb": Entry(
        "Fig. 4: 2D reduced model on the solid knit", ("geometry", "mesh", "contacts"), TIED_COURSE
    ),
    "fig05_contact_points": Entry(
        "Fig. 5: points of the 3D reduced model", ("geometry", "contacts"), TIED_COURSE
    ),
    "fig06_joints": Entry(
        "Fig. 6: 3D reduced model and its joints", ("geometry", "contacts", "rom3d"), TIED_COURSE
    ),
    "fig07a_zones": Entry(
        "Fig. 7a: contact zones in the centre cell, their number and area", ("contacts",), ISOTROPIC_COURSE
    ),
    "fig07b_force": Entry(
        "Fig. 7b: force against strain with isotropic friction", ("dns",), ISOTROPIC_COURSE
    ),
    "fig07c_contact_area": Entry(
        "Fig. 7c: where the centre cell touches", ("geometry", "dns", "contacts"), ISOTROPIC_COURSE
    ),
    "fig08_out_of_plane": Entry(
        "Fig. 8: contraction, out-of-plane motion and interfacial forces",
        ("geometry", "dns", "contacts"),
        ISOTROPIC_COURSE,
    ),
    "fig09a_force": Entry(
        "Fig. 9a: force against strain with ties, rough contact and isotropic friction",
        ("tie", "rough", "isotropic"),
        ISOTROPIC_COURSE,
    ),
    "fig09b_out_of_plane": Entry(
        "Fig. 9b: out-of-plane motion with ties, rough contact and isotropic friction",
        ("tie", "rough", "isotropic"),
        ISOTROPIC_COURSE,
    ),
    "fig_pair_slip": Entry(
        "Two crossing yarns: forces against sliding", ("pairs_contacts", "scenes"), {"specimen": "pair"}
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


def module(name: str) -> str:
    """Return the dotted name of the module that draws a figure.

    Raises
    ------
    ConfigurationError
        When there is no such figure.
    """
    return f"knitstudy.figures.{module_of('figure', FIGURES, name)}"


def draw(name: str, **sources: Any) -> Figure:
    """Draw a figure from the results that its entry names.

    Raises
    ------
    ConfigurationError
        When there is no such figure, or something that it needs is missing.
    """
    needed = select("figure", FIGURES, name, sources)
    return import_module(module(name)).draw(**needed)
