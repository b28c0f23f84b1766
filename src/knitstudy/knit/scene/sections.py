"""Sections of the physical problem: specimen, optimisation of its loops, yarn and load."""

from __future__ import annotations

from itertools import pairwise
from math import ceil
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.keys import Count, Length, OneOf, Positive, Section, output, physics
from knitstudy.knit.scene.stitches import wrong_stitches
from knitstudy.mechanics.materials import MATERIALS, material_of

Point = tuple[float, float, float]
Modulus = Annotated[float, Field(gt=0, le=1e20)]  # In Pa

# Specimen: a knit, or two crossing yarns


class Pattern(Section, group="pattern"):
    """Size and shape of the knit: `rows` rows of interlocks between `rows` + 1 yarns of `loops` loops.

    `control_points` (P, 3) in m describe one loop from sinker centre to sinker centre before optimisation; `clearance`
    is the target gap c0 at every crossing, in yarn radii. The loop is drawn for `course_spacing` and `wale_spacing`;
    rows stand `course_ratio` times the course spacing apart, and `keep` names the quantity of the drawn loop that is
    held fixed then. Without control points a loop is drawn for the spacings, the diameter and `loop_length`. `stitches`
    are the rows of a repeat, the bottom row first, seen from the front: K, a knit stitch, is drawn through the loop
    below it from the back to the front; P, a purl stitch, from the front to the back. ["KP"] is a 1 x 1 rib, ["K", "P"]
    a garter, ["KP", "PK"] a seed stitch. A tuck (T) is laid on the needle next to the held loop, a float (-) passes it:
    ["KP", "KT"] is a half cardigan. Marks move loops to other needles before the next row: ["K>K(", "KK"] is a 1 x 1
    cable, ["K)K", "TK"] a lace. A repeat with different letters has drawn loops, without control points. `loops` and
    `rows` are multiples of the loops and rows of the repeat.
    """

    loops: Count = physics("stated")
    """Sections 3.1 and 3.5: 3 x 3 unit cells. Checked: 3."""
    rows: Count = physics("inferred")
    """DOF(n) = n^2 [21057 + 40700 (1 - 2/n)] fits Table 3 within 0.4 %: n rows of cells with as much yarn each, all but
    the outer ones in contact. Checked: 3 and, as another reading, 4."""
    course_spacing: Length = physics("calibrated", unit="m")
    """Not printed; fitted with the control points. Checked: two values."""
    wale_spacing: Length = physics("calibrated", unit="m")
    """Not printed; fitted with the control points. Checked: two values."""
    control_points: Annotated[tuple[Point, ...], Field(min_length=4)] | None = physics(
        "calibrated",
        unit="m",
        allowed="a list of at least 4 points x, y, z in m, or null: a loop is drawn for the spacings",
    )
    """Not printed; fitted to the angles of Table 4 and 55.5 mm of yarn a cell (Table 5). Checked: 55.5 and 41.6 mm."""
    loop_length: Length | None = physics(
        "choice",
        unit="m",
        allowed="the length of yarn in a loop, a number > 0 in m; or null: about the length of Peirce's loop",
        default=None,
    )
    """Peirce 1947: 2 c + w + 5.94 d. Checked: the calibrated loop's, within 3 %."""
    stitches: tuple[str, ...] = physics(
        "choice",
        allowed="a list of rows of the letters K (knit), P (purl), T (tuck) and - (float), the bottom row first, such "
        'as ["KP", "PK"]; > or < behind a letter moves the loop by a needle, in front of others, ) or ( behind them',
        default=("K",),
    )
    """The paper knits plain stitches. Checked: all repeats of K and P of up to 2 x 2, half cardigan, cross tuck,
    floats of every second needle, a 1 x 1 cable, and lace."""
    clearance: float = physics("assumed", unit="yarn radii", ge=0, le=1)
    """Not printed; Fig. 7 shows no contact at 0.05 % strain, and symmetric contact by 0.45 %: 0.005 to 0.03. Checked:
    0.01 and 0.03: force -5 % at 1.95 % strain (docs/notes/sensitivity.md)."""
    course_ratio: float = physics(
        "choice", meaning="course spacing over that of the drawn loop", default=1.0, ge=0.5, le=2
    )
    """Fig. 11a varies the course spacing without saying how far. Checked: 0.7 to 1.3 (docs/notes/geometry.md)."""
    keep: Literal["shape", "length", "wale_spacing"] = physics(
        "choice",
        meaning="what is held fixed of the drawn loop at another course spacing or diameter",
        default="shape",
    )
    """Not printed: Fig. 11 does not name the fixed quantity (docs/notes/geometry.md). Checked: all three."""

    @model_validator(mode="after")
    def _stitches_are_a_repeat(self) -> Pattern:
        if wrong := wrong_stitches(self.stitches):
            raise ValueError(f"stitches is {list(self.stitches)}: {wrong}")
        return self


class Pair(Section, group="pair"):
    """Two straight yarns of `length` that cross at `angle` in their middles, `clearance` yarn radii apart.

    `support` names the held and the driven nodes of the yarns: both "ends", or the "back", the half of the surface that
    faces away from the other yarn.
    """

    angle: float = physics("choice", unit="degrees", gt=0, le=90)
    """A verification case. Checked: 90 and 30."""
    length: Length = physics("choice", unit="m")
    """A verification case: nearly three diameters, more than the other yarn covers. Checked: 5 mm."""
    clearance: float = physics("choice", unit="yarn radii", ge=0, le=1)
    """A verification case. Checked: 0.01."""
    support: Literal["ends", "back"] = physics(
        "choice", meaning="the part of each yarn that is held or driven"
    )
    """A verification case: bodies in theories of contact are held at their backs. Checked: back."""


# Optimisation of the loop (section 2.1 of the paper)


class Geometry(Section, group="geometry"):
    """Optimisation of the loop: weights of Eqs. (1) and (3), free control points, and samples per Bezier curve.

    `free` lists for every control point the components that may move: "", "z", "yz", "xyz" and so on.
    """

    alpha: Positive = physics("assumed", meaning="the weight of F_distance in Eq. (1)")
    """Weight of Eq. (1), not printed. Checked: times 0.1 and 10: angles within 0.5 degrees (docs/notes/geometry.md)."""
    beta: float = physics("assumed", meaning="the weight of F_bending in Eq. (1)", ge=0, le=1e12)
    """Weight of Eq. (1), not printed. Checked: times 0.1 and 10: angles within 0.5 degrees (docs/notes/geometry.md)."""
    gamma: float = physics("assumed", meaning="the weight of F_length in Eq. (1)", ge=0, le=1e12)
    """Weight of Eq. (1), not printed. Checked: times 0.1 and 10: angles within 0.5 degrees (docs/notes/geometry.md)."""
    beta_0: float = physics("assumed", meaning="the scalar of Eq. (3)", ge=0, le=1e12)
    """Scalar of Eq. (3), not printed. Checked: times 0.1 and 10: angles within 0.5 degrees (docs/notes/geometry.md)."""
    free: tuple[Annotated[str, Field(pattern="^x?y?z?$")], ...] = physics(
        "assumed",
        allowed='a list of the components that may move, one text such as "", z or xyz for every control point',
    )
    """The paper says that a subset of points and components moves, without naming the subset. Checked: one list."""
    diameter_share: float = physics(
        "choice",
        meaning="the diameter of the drawn loops over that of the yarn; less than 1 if yarns press each other at rest, "
        "as soft yarns do in tight fabrics",
        default=1.0,
        gt=0,
        le=1,
    )
    """Drawn yarns do not overlap; yarns of measured fabrics are packed. Checked: 0.6."""
    samples: int = physics("stated", meaning="samples per Bezier curve", ge=4, le=10_000)
    """Section 2.1: 100 points per Bezier curve; here the closest points are refined from them. Checked: 100."""


# Yarn


class Yarn(Section, group="yarn"):
    """Circular yarn of one isotropic material."""

    diameter: Length = physics("inferred", unit="m")
    """63,171 nodes at 0.3 mm (Table 5) are 38 a section: 6 elements across. Checked: 1.8 mm."""
    youngs_modulus: Modulus = physics("inferred", unit="Pa")
    """Data sheet of the polypropylene that the paper cites: homopolymer 1.30 GPa, copolymer 1.10 GPa. Checked: 1.30
    GPa; forces are proportional to it, 1.1 to 1.5 GPa need no run of their own."""
    poisson_ratio: float = physics("inferred", gt=-1, lt=0.5)
    """The same data sheet. Checked: 0.42."""

    @property
    def radius(self) -> float:
        """Yarn radius in m."""
        return self.diameter / 2


class SolidYarn(Yarn):
    """Circular yarn of solids, of one material.

    For a transversely isotropic material, `youngs_modulus` and `poisson_ratio` hold along the axis of the yarn, and
    the other three constants default to the values of an isotropic material.
    """

    material: Annotated[str, OneOf(MATERIALS.all)] = physics("assumed")
    """Isotropic polypropylene (section 2.3) with geometric nonlinearity; Abaqus uses Hencky then. Checked:
    the isotropic laws: force +1.2 % at most (docs/notes/sensitivity.md)."""
    transverse_modulus: Modulus | None = physics(
        "assumed",
        unit="Pa",
        allowed="a number > 0 and <= 1e20, in Pa: Young's modulus across the yarn; or null: the modulus along the yarn",
        default=None,
    )
    """Section 2.3 takes yarns as isotropic; twisted yarns are softer across than along. Checked: 0.3 of the modulus
    along the yarn, against closed forms."""
    transverse_poisson_ratio: float | None = physics(
        "assumed",
        allowed="a number between -1 and 1 (both excluded): Poisson's ratio across the yarn; or null: the ratio along "
        "the yarn",
        default=None,
        gt=-1,
        lt=1,
    )
    """Section 2.3 takes yarns as isotropic. Checked: 0.25, against closed forms."""
    axial_shear_modulus: Modulus | None = physics(
        "assumed",
        unit="Pa",
        allowed="a number > 0 and <= 1e20, in Pa: shear modulus along the yarn; or null: that of an isotropic yarn",
        default=None,
    )
    """Section 2.3 takes yarns as isotropic. Checked: 0.3 of that of an isotropic yarn, against closed forms."""

    @model_validator(mode="after")
    def _stores_energy(self) -> SolidYarn:
        for name in ("transverse_modulus", "transverse_poisson_ratio", "axial_shear_modulus"):
            if getattr(self, name) is not None and not MATERIALS.find(self.material).directional:
                of = f"where yarn.material is {self.material}, which is isotropic"
                raise ValueError(f"{name} is {getattr(self, name):g} but must be null {of}")
        try:
            material_of(self)
        except ConfigurationError as error:
            raise ValueError(str(error)) from error
        return self


OF_SOLIDS = {
    "yarn.material": "hencky",
    "yarn.transverse_modulus": None,
    "yarn.transverse_poisson_ratio": None,
    "yarn.axial_shear_modulus": None,
}
"""Values of the keys of `SolidYarn` that beams stand for: one isotropic material."""

Stiffness = Annotated[float, Field(gt=0, le=1e12)]


def _stiffness(unit: str, what: str, null: str = "a solid circle of yarn.youngs_modulus") -> Any:
    return physics(
        "assumed", unit=unit, allowed=f"a number > 0 in {unit}: {what}; or null: {null}", default=None
    )


OF_FIRST = "that of yarn"


class BeamYarn(Yarn):
    """Circular yarn of one isotropic material, or with stiffnesses of its own.

    Two yarns that cross press each other with the force `pressing` (approach / diameter)^`pressing_exponent`.
    """

    stretching: Stiffness | None = _stiffness("N", "force over strain")
    """Fibres of a spun yarn are not one solid. Checked: against closed forms."""
    bending: Stiffness | None = _stiffness("N m2", "moment over curvature")
    """Fibres of a spun yarn slide on each other. Checked: an elastica (tests/verification)."""
    twisting: Stiffness | None = _stiffness("N m2", "moment over twist")
    """Fibres of a spun yarn slide on each other. Checked: against closed forms."""
    pressing: Stiffness | None = _stiffness(
        "N", "force of yarns that cross at an approach of a diameter", "the law of beam.section"
    )
    """Yarns pressed between plates. Checked: against closed forms."""
    pressing_exponent: float = physics(
        "assumed",
        meaning="the exponent of the approach, where yarn.pressing is set",
        default=1.5,
        ge=1.5,
        le=10,
    )
    """1.5: cylinders that cross (Hertz); spun yarns pressed between plates have 2 to 4. Checked: 1.5 to 2.9."""


class SetYarn(BeamYarn):
    """Yarn of beams whose stress-free shape lies between straight and the drawn loop."""

    set: float = physics(
        "assumed",
        meaning="stress-free curvature over the curvature of the drawn loop",
        default=1.0,
        ge=0,
        le=1,
    )
    """1: the drawn shape is free of stress, as in a heat-set knit; 0: a free yarn is straight. Checked: 0 and 1."""


INLAY = "inlay"


class SecondYarn(Section, group="yarn_b"):
    """A second yarn: rows take `yarn` (a) and this one (b) by turns, as `rows` lists them from the bottom on.

    What is null is as of `yarn`, which is at least as thick; all null: there is no second yarn. `contact.friction` is
    that of both.
    """

    rows: Annotated[tuple[Literal["a", "b", "inlay"], ...], Field(min_length=1)] = physics(
        "choice",
        allowed="a list of a and b, the bottom row first, such as [a, a, b]; inlay after a row lays b into it",
        default=("a", "b"),
    )
    """Alternate courses, or weft yarns between the beds of a rib. Checked: [a, b], [b, a] and [a, inlay]."""
    diameter: Length | None = _stiffness("m", "thickness", OF_FIRST)
    """Plied, covered and single yarns differ. Checked: down to half of that of yarn."""
    youngs_modulus: Modulus | None = _stiffness("Pa", "Young's modulus", OF_FIRST)
    """Of another polymer. Checked: a tenth to ten times that of yarn."""
    stretching: Stiffness | None = _stiffness("N", "force over strain", OF_FIRST)
    """Elastane stretches where cotton does not. Checked: straight rows, nylon beside cotton."""
    bending: Stiffness | None = _stiffness("N m2", "moment over curvature", OF_FIRST)
    """Of fewer or thinner fibres. Checked: nylon beside cotton."""
    twisting: Stiffness | None = _stiffness("N m2", "moment over twist", OF_FIRST)
    """Of fewer or thinner fibres. Checked: nylon beside cotton."""
    pressing: Stiffness | None = _stiffness(
        "N", "force of two such yarns at an approach of a diameter", OF_FIRST
    )
    """Unlike layers give way in series. Checked: against closed forms."""
    pressing_exponent: float | None = physics(
        "choice", allowed=f"a number from 1.5 to 10; or null: {OF_FIRST}", default=None, ge=1.5, le=10
    )
    """The law of two yarns is a fitted power, within 5 %. Checked: 2.5 beside 2.9."""
    set: float | None = physics(
        "choice", allowed=f"a number from 0 to 1; or null: {OF_FIRST}", default=None, ge=0, le=1
    )
    """One yarn may be heat-set and the other not. Checked: none."""


# Load


MOST_STOPS = 100_000  # steps of one entry of load.stops


class Tension(Section, group="load"):
    """A specimen is deformed to an engineering `strain`; a negative strain compresses it.

    `lateral`: strains across the load, held or free; `stops`: strains at which an increment has to end.
    """

    strain: float = physics("stated", meaning="not 0 (0.05 is 5 %, -0.05 a compression)", ge=-0.2, le=0.5)
    """Section 3.1: 5 % course strain. Checked: -5 to 5 %."""
    lateral: Literal["fixed", "free"] = physics(
        "assumed", meaning="the other displacements of the driven ends, or the other strains of a cell"
    )
    """Prescribed displacements on the driven side; lateral components held, a variant leaves them free. Checked: fixed;
    free: force -3.3 % (docs/notes/sensitivity.md)."""
    stops: tuple[float, ...] = output(
        "choice",
        allowed="a list of strains on the load path, for example [0.01, 0.02]; an entry [0.006, 0.0002] stands for "
        "even steps of at most 0.0002 from the stop before to 0.006, 100,000 of them at most; or []",
    )
    """Numerical; increments end there, so that figures show the strains of Fig. 7c and the onset of contact."""

    @field_validator("stops", mode="before")
    @classmethod
    def _graded(cls, stops: object) -> object:
        """Return stops with the even steps that pairs [end, largest step] stand for."""
        if not isinstance(stops, list | tuple):
            return stops
        graded: list[Any] = []
        for stop in stops:
            match stop:
                case [float() | int() as end, float() | int() as step] if 0 < step <= end <= MOST_STOPS:
                    last = max((limit for limit in graded if isinstance(limit, float | int)), default=0.0)
                    if (steps := (end - last) / step) > MOST_STOPS:
                        raise ValueError(f"{steps} steps")  # the message is `allowed` above
                    parts = max(ceil(steps - 1e-9), 1)
                    graded += [last + (end - last) * part / parts for part in range(1, parts + 1)]
                case _:
                    graded.append(stop)
        return tuple(graded)

    @field_validator("strain")
    @classmethod
    def _is_not_zero(cls, strain: float) -> float:
        if strain == 0:
            raise ValueError("nothing is deformed")
        return strain

    @model_validator(mode="after")
    def _stops_are_on_the_way(self) -> Tension:
        turns = getattr(self, "turns", ())
        name, first = ("the first of load.turns", turns[0]) if turns else ("load.strain", self.strain)
        shares = (0.0, *(stop / first for stop in self.stops), 1.0)
        if any(later <= earlier for earlier, later in pairwise(shares)):
            wanted = f"go on from one to the next between 0 and {name}, {first:g}"
            raise ValueError(f"stops is {list(self.stops)} but must {wanted}")
        return self


class KnitTension(Tension):
    """A knit is pulled in `direction` to an engineering `strain` (section 2.3, Fig. 3).

    `lateral`: driven ends fixed or free in the other components; `stops`: strains at which an increment has to end.
    """

    direction: Literal["course", "wale"] = physics("stated")
    """Section 2.3: course and wale tension; wale pulls head arcs of the top yarn. Checked: both."""


class DrawnCellStrain(Tension):
    """A cell is deformed to an engineering `strain`: in course or wale direction, in both at a `ratio`, or sheared.

    `lateral`: the other strains in the plane are held at 0, or free, so that no force goes with them. The load goes
    through the strains `turns`, in this order, and then to `strain`.
    """

    strain: float = physics("stated", meaning="not 0 (0.05 is 5 %, -0.05 a compression)", ge=-0.5, le=4)
    """Section 3.1: 5 % course strain; knitted fabrics take 20 to 200 %. Checked: -5 to 100 %."""
    turns: tuple[Annotated[float, Field(ge=-0.5, le=4)], ...] = physics(
        "choice",
        allowed="a list of strains from -0.5 to 4, for example [0.3, 0] and strain 0.3; or []",
        default=(),
    )
    """Loading, unloading and loading again show hysteresis. Checked: one cycle to 30 %."""

    @model_validator(mode="after")
    def _turns_are_distinct(self) -> DrawnCellStrain:
        way = (0.0, *self.turns, self.strain)
        if any(one == other for one, other in pairwise(way)):
            raise ValueError(
                f"turns is {list(self.turns)} but must go somewhere else each time, from 0 to {self.strain:g}"
            )
        return self

    largest_force: float | None = physics(
        "choice", unit="N/m", default=None, gt=0, allowed="a force per width, or null"
    )
    """The load path ends when the force per width along the load reaches this value; null: at full strain. Checked: 310
    N/m."""

    deformation: Literal["course", "wale", "biaxial", "shear"] = physics("choice", default="course")
    """Strains in the plane that define a shell's stiffness. Checked: all four."""
    ratio: float = physics(
        "choice", meaning="wale strain over course strain of a biaxial deformation", default=1.0, ge=-5, le=5
    )
    """Tests on crossed grips prescribe both strains. Checked: 0.5, 1 and 2."""

    @model_validator(mode="after")
    def _has_a_ratio_where_both_are_strained(self) -> Self:
        if self.ratio != 1 and self.deformation != "biaxial":
            raise ValueError(
                f"ratio is {self.ratio:g} but must be 1 where load.deformation is {self.deformation}"
            )
        return self


class CellStrain(DrawnCellStrain):
    """A cell is deformed from the drawn loops, or from a shape at rest.

    Two rigid plates without friction may "press" it: `strain` is the share of their distance by which they close.
    """

    deformation: Literal["course", "wale", "biaxial", "shear", "press"] = physics("choice", default="course")  # type: ignore[assignment]
    """Strains in the plane that define a shell's stiffness, or plates. Checked: all five."""

    largest_pressure: float | None = physics(
        "choice", unit="Pa", default=None, gt=0, allowed="a pressure of plates, or null"
    )
    """The load path ends when plates press with this; null: at full strain. Checked: 5.4 kPa."""

    @model_validator(mode="after")
    def _plates_press(self) -> Self:
        if self.deformation != "press":
            if self.largest_pressure is not None:
                raise ValueError(f"largest_pressure must be null where deformation is {self.deformation}")
        elif self.largest_force is not None or not all(0 <= way < 1 for way in (*self.turns, self.strain)):
            raise ValueError(
                "deformation press needs largest_force null, and strain and turns from 0 to below 1"
            )
        return self

    start: Literal["drawn", "rest", "rest_with_friction"] = physics(
        "choice",
        allowed="drawn (the drawn loops), rest_with_friction (a cell without forces on its edges, in "
        "which friction has stopped the yarns) or rest (the stable shape after that, once friction is removed)",
        default="drawn",
    )
    """From rest, strains and forces refer to the spacings at rest. Checked: all three."""


class PairPath(Section, group="load"):
    """The grips of the upper yarn of a pair move to the displacements of `path`, one after another.

    Legs are straight and take equal shares of the load factor; the first leg begins at the initial position.
    """

    lateral: ClassVar[str] = "fixed"

    path: tuple[Point, ...] = physics(
        "choice", unit="m", allowed="a list of one displacement x, y, z in m or more", min_length=1
    )
    """A verification case; a knit has none."""
