"""Sections of how a scene is computed: mesh, ties, contact, solver, gates, reduced models, and beams.

Ties, friction and tied edges stand here as well: which of them a scene has depends on its model.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from knitstudy.mechanics.elements import ELEMENTS
from knitstudy.mechanics.spline_yarn import LARGEST_DEGREE
from knitstudy.study.keys import (
    Count,
    OneOf,
    Positive,
    SceneName,
    Section,
    numerics,
    physics,
    resolution,
)

# Meshes

Size = Annotated[float, Field(ge=0.01, le=10)]
"""Length of an element over the yarn's radius: a section has no room for larger ones, and smaller ones only cost."""


class SolidMesh(Section):
    """Sizes of solid elements at crossings, their growth on legs, and the element."""

    size: Size = resolution("stated", unit="yarn radii")
    """Table 5: 0.3 mm, of a radius of 0.9 mm. Checked: 0.25 to 0.67: force +7 % at 0.67 (docs/notes/sensitivity.md)."""
    growth: float = numerics("assumed", meaning="spacing on legs over size", ge=1, le=4)
    """Spacing of slices between crossings; near the count of nodes of Table 5. Checked: 1 to 1.5: force within 0.1%."""
    refinement: float = numerics(
        "assumed", meaning="size over the size of elements at crossings", default=1.0, ge=1, le=3
    )
    """Slices stand nearer, sections are drawn towards the other yarn (docs/notes/refinement.md). Checked: 1 to 3."""
    element: Annotated[str, OneOf(ELEMENTS.all)] = numerics("stated")
    """Section 2.3: linear hexahedra with reduced integration; quadratic ones are the reference. Checked: over
    quadratic, tied cell of size 1/3: one_point -3 % in force."""

    @property
    def smallest(self) -> float:
        """Size of elements at crossings in yarn radii: the length scale of contact."""
        return self.size / self.refinement


class BeamMesh(Section):
    """Size of beam elements, and their section."""

    beam_size: Size = resolution("stated", unit="yarn radii")
    """Table 5: 0.5 mm, of a radius of 0.9 mm. Checked: 5/9; gates.polygon refuses longer ones that bend too much."""
    section_law: Literal["straight", "curved"] = numerics(
        "assumed",
        allowed="straight (of a straight rod) or curved (of a rod as bent as the yarn is): law of the beams' sections",
    )
    """Section 2.5 prints none; curved: as stiff as a bent yarn of solids (docs/notes/beams.md). Checked: curved and
    straight: force -4 to -6 % (scenes rom3d-straight-*)."""


Degree = Annotated[int, Field(ge=2, le=LARGEST_DEGREE)]

Span = Annotated[float, Field(ge=0.05, le=2.0)]
"""Over the yarn's radius: a loop's bends have no room in longer spans, and shorter ones only cost."""

LOCKS = "as sections of degree 1 cannot widen in bending: 2.1 times too stiff at a Poisson ratio of 0.4"


class PolynomialMesh(Section):
    """Degree over the section and length of spans, on legs and near crossings, and the degree of the splines.

    Spans nearer to a crossing than a radius have the degree `crossing_degree`; their length is `crossing_span` there
    and grows to `span`.
    """

    degree: Degree = resolution("choice", meaning=LOCKS, default=2)
    """Numerical; degree of the polynomials over the section, away from crossings. Checked: 2 to 6: of one loop, force
    +3.2 % at 2 and within 0.3 % from 3 on (docs/notes/solid_yarns.md)."""
    spline_degree: int = numerics("choice", default=3, ge=2, le=5)
    """Numerical; of the splines along the yarn; quadratic ones need half as many spans more. Checked: 2 and 3."""
    span: Span = resolution(
        "choice", unit="yarn radii", meaning="in yarn radii, and not below mesh.crossing_span", default=0.9
    )
    """Numerical; length of a span away from crossings. Checked: 0.6 to 1.8: of one loop, force +0.8 % at 1.8
    (docs/notes/solid_yarns.md)."""
    crossing_degree: Degree = resolution("choice", meaning="not below mesh.degree", default=2)
    """Numerical; degree of the polynomials near crossings. Checked: 2 to 6: force +2.5 to +3.6 % with 2 everywhere
    (docs/notes/solid_yarns.md)."""
    crossing_span: Span = resolution("choice", unit="yarn radii", default=0.9)
    """Numerical; length of a span near crossings. Checked: 0.3 to 0.9: of a cell with friction, force +0.7 and u_z -4 %
    at 0.9 (docs/notes/solid_yarns.md)."""

    @model_validator(mode="after")
    def _is_finer_near_crossings(self) -> PolynomialMesh:
        if self.crossing_degree < self.degree:
            raise ValueError(
                f"crossing_degree is {self.crossing_degree} but must be at least mesh.degree, {self.degree}"
            )
        if self.crossing_span > self.span:
            raise ValueError(
                f"crossing_span is {self.crossing_span:g} but must be at most mesh.span, {self.span:g}"
            )
        return self


# Ties and contact (section 2.2, Fig. 2 and Table 1)


class Tie(Section):
    """The mean and the linear moments of two yarns' displacement on a disc are joined where they cross and are tied."""

    radius: float = physics("inferred", unit="yarn radii", default=0.183, ge=0.05, le=0.8)
    """sqrt(2 R delta) with delta = 5 % of the stated 0.3 mm, Abaqus's default tolerance. Checked: 0.1 to 0.5: force of
    a tied cell of solid yarns -7 to +15 % (docs/notes/ties.md)."""


class Sliding(Section):
    """Coulomb friction."""

    friction: float = physics("stated", ge=0, le=1e6)
    """Table 1: 0.76; static value of the polypropylene's data sheet (sliding: 0.44). Checked: 0 to 1.5."""


class TiedEdges(Section):
    """Which crossings of a knit in contact stay tied (Fig. 3).

    Of the "outer" interlock rows in course tension and columns of loops in wale tension, or "none".
    """

    tied_edges: Literal["outer", "none"] = physics(
        "stated",
        allowed="outer (the first and the last interlock row, in wale tension the outer columns, are tied) or none",
    )
    """Section 2.3, Fig. 3; wale tension "for the same reason", taken as the outer columns. Checked: outer and none
    (scene inputs-untied-isotropic-course)."""


class SolidContact(TiedEdges):
    """Contact of solid yarns (Table 1): stiffnesses over E / h, and how it is integrated and enforced.

    A `penetration` deeper than this share of h is removed by at most so many `augmentations` an increment. `points` are
    Gauss points along each side of a facet.
    """

    normal_stiffness: Positive = numerics("stated", unit="E / h", meaning="times E over the mesh size")
    """Table 1: contact stiffness over element stiffness is 10; as pressure over gap it is taken as 10 E / h. Checked: 3
    to 30, of a pair pressed by 90 um: force -1.5 to +0.1 %; of knits: scenes *-penalty*."""
    tangential_stiffness: Positive = numerics("stated", unit="E / h", meaning="times E over the mesh size")
    """Table 1: stick stiffness over element stiffness is 10; as traction over slip it is taken as 10 E / h. Checked: 3
    to 30, of a pair slid by 0.45 mm at 0.3 mm: force within 0.04 %, work -1.8 to +0.7 %."""
    penetration: float = numerics("assumed", unit="h", meaning="a share of the mesh size", gt=0, le=1)
    """Table 1 says hard contact; how hard is not printed. Checked: 0.003 and 0.01, of a pair pressed by 90 um and slid
    at 0.3 mm: force within 1 % at the end of the way."""
    augmentations: int = numerics("choice", ge=0, le=100)
    """Numerical; updates of the multipliers where the penalty lets yarns in too deep. Checked: 10; pairs needed 3."""
    points: int = numerics("choice", ge=1, le=4)
    """Numerical; even numbers have no point in the middle of a facet and find contact late. Checked: 1 to 4, of a pair
    pressed by 36 um: with 2 contact begins 10 um late (force -13 %)."""


class PolynomialContact(SolidContact):
    """Contact of solid yarns without hexahedra, on their true surfaces.

    The local indentation that polynomials cannot show is added in series, computed from their own space: stiffnesses,
    penetration and augmentations have no effect.
    Cells of contact are as long as `cell` along the yarn within `window` of a crossing, and three times as long
    elsewhere; around they are `cell`.
    """

    cell: float = numerics("choice", unit="yarn radii", default=0.25, ge=0.05, le=0.5)
    """Numerical; length of a cell near crossings, with contact.points x contact.points Gauss points. Checked: 0.15 to
    0.75 of a pair: force +0.3 % at 0.15, -2.5 % at 0.5, -7.6 % at 0.75 (docs/notes/contact.md)."""
    window: float = numerics(
        "choice",
        unit="yarn radii",
        meaning="in yarn radii, and not below contact.cell",
        default=1.2,
        ge=0.3,
        le=4,
    )
    """Numerical; sqrt(2) times the larger semiaxis of the area of contact and the way that it slides. Checked: 0.8 to
    1.6 of a pair: force within 1.3 % (docs/notes/contact.md)."""

    @model_validator(mode="after")
    def _has_a_cell_in_its_window(self) -> PolynomialContact:
        if self.window < self.cell:
            raise ValueError(f"window is {self.window:g} but must be at least contact.cell, {self.cell:g}")
        return self


# Newton's method


class Newton(Section):
    """First number of increments, and tolerances."""

    increments: Count = resolution("choice")
    """Numerical; the first increment's share of the load, adapted on the way. Checked: 5 to 40: the same force."""
    residual_tolerance: float = resolution(
        "choice", meaning="relative to the mean internal force", gt=0, le=1e-2
    )
    """Numerical; of the mean internal force. Checked: 1e-6."""
    correction_tolerance: float = resolution("choice", meaning="relative to the mesh size", gt=0, le=1e-2)
    """Numerical; of the element size. Checked: 1e-6."""


class SolidNewton(Newton):
    """The same of solids, with the linear solver; the viscosity `stabilisation` is relative to Young's modulus."""

    stabilisation: float = numerics("assumed", unit="E", meaning="times Young's modulus", ge=0, le=1e6)
    """Section 2.2: static stabilisation, its size is not printed; none unless a scene asks for it. Checked: 0 to 1e-6,
    of one cell at 0.6 mm: force within 0.003 %."""
    linear: Literal["auto", "three_scale", "amg", "lu"] = numerics("choice")
    """Numerical; no result depends on it. Checked: auto."""


class HexahedralNewton(SolidNewton):
    """The same of hexahedra, with their `hourglass` coefficient, relative to the shear modulus."""

    hourglass: float = numerics("assumed", unit="shear moduli", meaning="times the shear modulus", gt=0, le=1)
    """Abaqus's default stiffness of C3D8R, 0.005 G. Checked: 0.0025 to 0.05: force -1.4 to +3.8 %
    (docs/notes/sensitivity.md)."""


# Gates: limits of errors of a run; beyond a limit the run ends with one message (docs/reference/gates.md)


class Gates(Section):
    """Limits of every model."""

    ledger: float = numerics("choice", meaning="over the external work", default=0.05, gt=0)
    """Every scene of the study stays below 0.035; pairs in 8 increments leave 0.14, gates.md. Checked: 0.05."""
    penalty: float = numerics("choice", meaning="over the work of the leg", default=0.05, gt=0)
    """Penetration and elastic slip of penalties store at most as large a share of the work as they take from the force,
    docs/reference/gates.md. Checked: 0.05."""
    flow: float = numerics("choice", meaning="over the internal energy", default=0.01, ge=0)
    """Viscous flows lead on where Newton's method makes no headway (gates.md); scenes of the study need none.
    Checked: 0.01."""


class BeamGates(Gates):
    """Additional limits of beams that follow bent yarns."""

    polygon: float = numerics("choice", meaning="of the stiffness of a ring", default=0.05, gt=0)
    """A ring of beams that turn by phi each is phi^2 / 3 too stiff, docs/reference/gates.md. Checked: 0.05."""


class TouchingBeamGates(BeamGates):
    """Additional limits of beams in contact."""

    point: float = numerics("choice", meaning="over the internal energy", default=0.1, gt=0)
    """Energy of contact where yarns bend, cross or overlap beyond the verified range of the law, gates.md.
    Checked: 0.1, at which cells of beams are 5 % softer than solid yarns."""


class SolidGates(Gates):
    """Additional limits of solids."""

    stabilisation: float = numerics("choice", meaning="over the internal energy", default=0.05, ge=0)
    """5 % is the field's rule. Checked: 0.05."""
    viscous_force: float = numerics(
        "choice", meaning="over the reaction of the driven side", default=0.05, ge=0
    )
    """Forces are wrong by about as much, docs/reference/gates.md. Checked: 0.05."""


class HexahedralGates(SolidGates):
    """Additional limits of hexahedra."""

    hourglass: float = numerics("choice", meaning="over the internal energy", default=0.05, gt=0)
    """5 % is the field's rule; at least the usual stiffness of 0.005 G is counted. Checked: 0.05."""
    elements_across: float | None = numerics(
        "choice",
        allowed="a number > 0 of elements of mesh.size across the yarn, or null for 3 of a knit and 7 of a pair",
        default=None,
        gt=0,
    )
    """Force of a tied knit +5 % at 3.3, of a pressed pair within 8 % from 8 on, gates.md. Checked: 2 to 12."""


# Reduced order models: where their joints come from, and of which kind they are (sections 2.4 to 2.6)


class Joints(Section):
    """Which direct simulation a reduced model takes its joints from; none where the geometry says enough."""

    contacts_from: SceneName | None = numerics(
        "choice",
        allowed="the name of the scene of solid yarns with the contacts (empty: the geometry predicts them)",
        default=None,
    )
    """The DNS whose contact zones make the joints (sections 2.4, 2.5). Checked: one DNS a knit, and none (scenes
    trade-*-rom*): tied knits carry the same within 1e-13."""


class PlanarJoints(Joints):
    """Of the planar model (Fig. 4); `section` belongs to a segment that two yarns share.

    Its segments join the contacts, or lie along the maximum principal stress of the simulation `stress_from` (Fig. 14).
    """

    section: Literal["single", "doubled"] = numerics(
        "assumed", meaning="a segment of the planar model that two yarns share"
    )
    """Section 2.4: the same cross section as the yarns; not printed where two yarns share a segment. Checked:
    single and doubled (scenes rom2d-doubled-*)."""
    honeycomb: Literal["geometry", "principal_stress"] = numerics(
        "stated",
        allowed="geometry (segments of the planar model join the contacts) or principal_stress (they lie along it)",
        default="geometry",
    )
    """Section 3.4: MPS-based honeycombs and the one from geometry. Checked: both (scenes rom2d-by-*-stress-*)."""
    stress_from: SceneName | None = numerics(
        "choice",
        allowed="the name of a scene of solid yarns (empty where rom.honeycomb is geometry)",
        default=None,
    )
    """Table 4: directions of course and of wale tension, each pulled in both directions. Checked: course and wale
    tension (scenes rom2d-by-*-stress-*)."""

    @model_validator(mode="after")
    def _stress_where_used(self) -> PlanarJoints:
        if (self.honeycomb == "principal_stress") != (self.stress_from is not None):
            wanted = "name a scene of solid yarns" if self.stress_from is None else "be empty"
            of = f"where rom.honeycomb is {self.honeycomb}"
            raise ValueError(f"stress_from is {self.stress_from!r} but must {wanted} {of}")
        return self


class SpatialJoints(Joints):
    """Of the spatial model (Figs. 5 and 6)."""

    joint: Literal["rigid", "pinned", "patch", "printed"] = numerics(
        "assumed",
        allowed="rigid (arms), pinned (arms that turn), patch (pinned, compliant) or printed (no arms)",
    )
    """Table 2: u_T = 0, u_R = 0, and springs between the points, which no arms is to the letter. Checked: all four
    (scenes rom3d-pinned-*, rom3d-patch-*, rom3d-printed-*)."""
    normal: Literal[
        "normal_resultant", "mean_normal_resultant", "resultant", "mean_resultant", "closest_points"
    ] = numerics(
        "inferred",
        allowed="normal_resultant (of the pressure), resultant (of pressure and friction), mean_normal_resultant or "
        "mean_resultant (one for P1 and P2), or closest_points (their line)",
        default="normal_resultant",
    )
    """Section 2.5: the resultant contact force; section 4: contact forces along the normal, frictional forces in the
    tangent plane. Checked: all five (table2_springs, scenes rom3d-normal-*)."""


class Springs(SpatialJoints):
    """Springs where yarns are not tied (Table 2).

    All have one stiffness: the average over crossings of the secants of the relative `displacement` of interfaces or
    centrelines along the `axes`, here or in another scene, or a given `stiffness` along x, y and z.
    """

    springs_from: SceneName | None = numerics(
        "choice", allowed="the name of the scene of solid yarns to measure (empty: that of rom.contacts_from)"
    )
    """Springs of another simulation: how far they hold for another load. Checked: course springs in wale
    tension and the other way round (scenes rom3d-carried-*)."""
    stiffness: tuple[Annotated[float, Field(gt=0)], ...] = numerics(
        "stated",
        unit="N/m",
        allowed="[], or a list of the springs' three stiffnesses along x, y and z in N/m instead of measured ones",
        max_length=3,
    )
    """Table 2; none: the springs are measured. Checked: the values of Table 2 (scenes rom3d-table2-*)."""
    axes: Literal["local", "global"] = numerics(
        "inferred",
        allowed="local (z along the contact normal, x the course direction in the tangent plane) or global",
    )
    """Table 2 lists x, y and z; Fig. 6b: points and directions of springs. Along global z most measured secants are
    negative (table2_springs). Checked: both with the stiffnesses of Table 2 (scenes rom3d-table2-*)."""
    displacement: Literal["interface", "centreline"] = numerics(
        "stated", meaning="the relative displacement whose secants the springs are"
    )
    """Section 2.6: relative displacement between yarn interfaces; that of the centrelines is a variant. Checked:
    interface and centreline (table2_springs, scenes rom3d-centreline-*)."""

    @model_validator(mode="after")
    def _has_one_source(self) -> Springs:
        if self.contacts_from is None:
            why = "springs are measured at its contacts"
            raise ValueError(
                f"contacts_from is empty but must name a scene of solid yarns where yarns touch: {why}"
            )
        given = list(self.stiffness)
        if given and (len(given) != 3 or self.springs_from):
            wanted = "[] or three values, along x, y and z, which takes an empty rom.springs_from"
            raise ValueError(f"stiffness is {given} but must be {wanted}")
        return self


# Beams in contact (section 3.3, Fig. 12b)


class Beam(Section):
    """Contact along all yarns, of "rigid" or "hertz" sections; kind of ties.

    Rigid sections press each other with `stiffness` E sqrt(R) approach^1.5; pinned ties have `stiffness` E R.
    """

    section: Literal["rigid", "hertz"] = numerics(
        "inferred", allowed="rigid (a penalty) or hertz (the approach of two crossed cylinders)"
    )
    """Section 3.3: the deformation of the cross-section is ignored. Checked: rigid and hertz (scenes beam-*)."""
    tie: Literal["rigid", "pinned", "patch"] = numerics(
        "assumed",
        allowed="rigid, pinned (sections may turn) or patch (pins that yield as tied areas do): tied crossings",
    )
    """Section 2.3 ties the outer rows; tied solids turn nearly freely and yield. Checked: all three."""
    stiffness: Positive = numerics("assumed", meaning="over Hertz's 0.8 to 0.9 where sections yield")
    """Not printed; hard contact. Checked: 10 and 100 (scenes beam-*)."""
