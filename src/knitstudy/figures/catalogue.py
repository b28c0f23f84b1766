"""All figures by name: what each shows, which results it needs, and how it is drawn.

A new figure is a module with a function ``draw(**sources) -> Figure``, an entry here, and a caption in
``workflow/report/``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from knitstudy.measures.catalogue import Entry, find, module_of, select
from knitstudy.measures.selection import ISOTROPIC_COURSE, ISOTROPIC_WALE, TIED_COURSE, TIED_WALE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


FIGURES = {
    **{
        f"fig15{letter}_force_strain": Entry(
            f"Fig. 15{letter}: force against strain in {direction} direction, {interaction}",
            ("dns", "rom3d", "rom2d", "scenes"),
            of,
            ("other_mesh", "reduced"),
            module="fig15_force_strain",
        )
        for letter, direction, interaction, of in (
            ("a", "course", "ties", TIED_COURSE),
            ("b", "wale", "ties", TIED_WALE),
            ("c", "course", "isotropic friction", ISOTROPIC_COURSE),
            ("d", "wale", "isotropic friction", ISOTROPIC_WALE),
        )
    },
    "fig01_unit_cell": Entry("Fig. 1: unit cell before and after optimisation", ("geometry",), TIED_COURSE),
    "fig02_interfaces": Entry("Fig. 2: tie constraint and contact with friction", (), {}),
    "fig03a_interactions": Entry(
        "Fig. 3a: crossings that are tied and that touch with friction, course tension",
        ("geometry", "contacts", "scenes"),
        ISOTROPIC_COURSE,
        module="fig03_interactions",
    ),
    "fig03b_interactions": Entry(
        "Fig. 3b: crossings that are tied and that touch with friction, wale tension",
        ("geometry", "contacts", "scenes"),
        ISOTROPIC_WALE,
        module="fig03_interactions",
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
    "fig10_kinematics": Entry(
        "Fig. 10: rotation, contraction, sliding and spin at the crossings of the centre cell",
        ("contacts",),
        ISOTROPIC_COURSE,
    ),
    "fig12b_beam_contact": Entry(
        "Fig. 12b: force against strain of beams in contact and of solid yarns",
        ("dns", "beams", "scenes"),
        ISOTROPIC_COURSE,
        ("rom3d", "tie_course_rom3d"),
    ),
    "fig16_out_of_plane": Entry(
        "Fig. 16: out-of-plane displacement along the yarns, course tension",
        (
            "geometry",
            "tie_course_dns",
            "tie_course_rom3d",
            "isotropic_course_dns",
            "isotropic_course_rom3d",
        ),
        TIED_COURSE,
    ),
    "fig16_wale": Entry(
        "Fig. 16, wale tension: out-of-plane displacement along the yarns",
        ("geometry", "tie_wale_dns", "tie_wale_rom3d", "isotropic_wale_dns", "isotropic_wale_rom3d"),
        TIED_WALE,
        module="fig16_out_of_plane",
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
