"""Sections of keys that several models read: sizes of elements, ties, contact, Newton's method, gates and joints.

`knit.models` has the sections of single models.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from knitstudy.knit.scene.keys import Count, Positive, SceneName, Section, numerics, physics, resolution

# Meshes

Size = Annotated[float, Field(ge=0.01, le=10)]
"""Length of an element over the yarn's radius: a section has no room for larger ones, and smaller ones only cost."""


class BeamMesh(Section, group="mesh"):
    """Size of beam elements, and their section."""

    beam_size: Size = resolution("stated", unit="yarn radii")
    """Table 5: 0.5 mm, of a radius of 0.9 mm. Checked: 5/9; gates.polygon refuses longer ones that bend too much."""
    section_law: Literal["straight", "curved"] = numerics(
        "assumed",
        allowed="straight (of a straight rod) or curved (of a rod as bent as the yarn is): law of the beams' sections",
    )
    """Table 5 prints B31, which is straight; curved: as stiff as a bent yarn of solids (docs/notes/beams.md). Checked:
    straight, force -2 to -4 % beside curved (scenes rom3d-* and rom3d-curved-*)."""


# Ties and contact (section 2.2, Fig. 2 and Table 1)


class Tie(Section, group="tie"):
    """At a tied crossing, the displacements of both yarns have the same mean and linear moments over a disc."""

    radius: float = physics("inferred", unit="yarn radii", default=0.183, ge=0.05, le=0.8)
    """sqrt(2 R delta) with delta = 5 % of the stated 0.3 mm, Abaqus's default tolerance. Checked: 0.1 to 0.5: force of
    a tied cell of solid yarns -7 to +15 % (docs/notes/ties.md)."""


class Friction(Section, group="contact"):
    """Coulomb friction."""

    friction: float = physics("stated", ge=0, le=1e6)
    """Table 1: 0.76; static value of the polypropylene's data sheet (sliding: 0.44). Checked: 0 to 1.5."""


class TiedEdges(Section, group="contact"):
    """Crossings of a knit in contact that stay tied (Fig. 3).

    "outer": crossings of the outer interlock rows in course tension, of the outer columns of loops in wale tension.
    """

    tied_edges: Literal["outer", "none"] = physics(
        "stated",
        allowed="outer (the first and the last interlock row, in wale tension the outer columns, are tied) or none",
    )
    """Section 2.3, Fig. 3; wale tension "for the same reason", taken as the outer columns. Checked: outer and none
    (scene inputs-untied-isotropic-course)."""


class SolidContact(Section, group="contact"):
    """Contact of solid yarns: the penetration that is allowed."""

    penetration: float = numerics("assumed", unit="h", meaning="a share of the mesh size", gt=0, le=1)
    """Table 1 says hard contact; how hard is not printed. Checked: 0.003 and 0.01, of a pair pressed by 90 um and slid
    at 0.3 mm: force within 1 % at the end of the path."""


class FacetContact(SolidContact):
    """Contact of hexahedra (Table 1): stiffnesses over E / h, and how it is enforced.

    A penetration deeper than the share `penetration` of h is reduced by at most `augmentations` updates of the
    multipliers per increment.
    """

    normal_stiffness: Positive = numerics("stated", unit="E / h", meaning="times E over the mesh size")
    """Table 1: contact stiffness over element stiffness is 10; as pressure over gap it is taken as 10 E / h. Checked: 3
    to 30, of a pair pressed by 90 um: force -1.5 to +0.1 %; of knits: scenes *-penalty*."""
    tangential_stiffness: Positive = numerics("stated", unit="E / h", meaning="times E over the mesh size")
    """Table 1: stick stiffness over element stiffness is 10; as traction over slip it is taken as 10 E / h. Checked: 3
    to 30, of a pair slid by 0.45 mm at 0.3 mm: force within 0.04 %, work -1.8 to +0.7 %."""
    augmentations: int = numerics("choice", ge=0, le=100)
    """Numerical; largest number of updates per increment. Checked: 10; pairs needed 3."""
    slave: Literal["both", "lower", "upper"] = numerics(
        "assumed",
        meaning="surface of two yarns whose points carry the contact: both, or that of the lower or the upper row",
        default="both",
    )
    """Section 2.2: master and slave are chosen at random. Both in turn share the contact here; one alone does not see
    that a yarn touches itself. Checked: lower and upper (scenes reading-as-printed-slave-*)."""


# Newton's method


class Newton(Section, group="solver"):
    """Least number of increments, and tolerances."""

    increments: Count = resolution("choice")
    """Numerical; no increment is larger than 1 / `increments` of the load, and increments that do not converge are
    halved. Checked: 5 to 40: the same force."""
    residual_tolerance: float = resolution(
        "choice", meaning="relative to the mean internal force", gt=0, le=1e-2
    )
    """Numerical; of the mean internal force. Checked: 1e-6."""
    correction_tolerance: float = resolution("choice", meaning="relative to the mesh size", gt=0, le=1e-2)
    """Numerical; of the element size. Checked: 1e-6."""


class SolidNewton(Newton):
    """Further settings of solids: the viscosity `stabilisation` relative to Young's modulus."""

    stabilisation: float = numerics("assumed", unit="E", meaning="times Young's modulus", ge=0, le=1e6)
    """Section 2.2: static stabilisation, its size is not printed; none unless a scene asks for it. Checked: 0 to 1e-6,
    of one cell at 0.6 mm: force within 0.003 %."""


# Gates: limits of errors of a run; beyond a limit the run ends with one message (docs/reference/gates.md)


class Gates(Section, group="gates"):
    """Limits of every model."""

    ledger: float = numerics("choice", meaning="over the external work", default=0.05, gt=0)
    """Every scene of the study stays below 0.035; pairs in 8 increments reach 0.14, gates.md. Checked: 0.05."""
    flow: float = numerics("choice", meaning="over the internal energy", default=0.01, ge=0)
    """A viscous flow continues the path where Newton's method does not converge (gates.md); scenes of the study need
    none. Checked: 0.01."""


class SpatialGates(Gates):
    """Additional limits of yarns in space."""

    overlap: float = numerics("choice", meaning="over the yarn's radius", default=0.5, gt=0)
    """Depth by which two places of yarn may overlap, of centrelines, docs/reference/gates.md. Checked: 0.5."""


class BeamGates(SpatialGates):
    """Additional limits of beams that follow bent yarns."""

    polygon: float = numerics("choice", meaning="of the stiffness of a ring", default=0.05, gt=0)
    """A ring of beams that turn by phi each is phi^2 / 3 too stiff, docs/reference/gates.md. Checked: 0.05."""


class SolidGates(SpatialGates):
    """Additional limits of solids."""

    stabilisation: float = numerics("choice", meaning="over the internal energy", default=0.05, ge=0)
    """5 % is the field's rule. Checked: 0.05."""
    viscous_force: float = numerics(
        "choice", meaning="over the reaction of the driven side", default=0.05, ge=0
    )
    """Forces are wrong by about as much, docs/reference/gates.md. Checked: 0.05."""


# Reduced models: where their joints come from, and of which kind they are (sections 2.4 to 2.6)


class Joints(Section, group="rom"):
    """The direct simulation that provides the joints of a reduced model; none if the geometry is sufficient."""

    contacts_from: SceneName | None = numerics(
        "choice",
        allowed="the name of the scene of solid yarns with the contacts (empty: the geometry predicts them)",
        default=None,
    )
    """The solid yarns whose contact zones make the joints (sections 2.4, 2.5). Checked: one simulation a knit, and none
    (scenes trade-*-rom*): tied knits carry the same within 1e-13."""
