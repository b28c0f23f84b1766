"""Alternative keys of a knit: loops per length, tex, files of control points or for machines, a yarn by its name.

These names may be set like keys of a scene, in families and with ``--set``; a scene has the keys that they stand for.
Keys of the scene itself have priority over those of a yarn; friction is left out of scenes whose yarns do not slide.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Mapping
from functools import cache
from math import pi, sqrt
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.documents import RESOURCES, read_yaml
from knitstudy.knit.scene.keys import Positive, Section, declared, refused, validated
from knitstudy.knit.scene.knitout import repeat_of
from knitstudy.knit.scene.stitches import size_of_repeat
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.registry import find

log = logging.getLogger(__name__)

COURSE, WALE, DIAMETER = "pattern.course_spacing", "pattern.wale_spacing", "yarn.diameter"
LENGTH, POINTS, FREE = "pattern.loop_length", "pattern.control_points", "geometry.free"
STITCHES = "pattern.stitches"

PER_METRE = {"pattern.courses_per_metre": COURSE, "pattern.wales_per_metre": WALE}
TEX = "yarn.tex"  # g/km; it goes with yarn.density [kg/m3], of the yarn with the air in it
POINTS_FILE = "pattern.points_file"
"""CSV file of points x, y, z: one loop from a sinker's centre to the next one's, which is its last row."""
ROUNDED = 1e-6  # wale spacings by which points of a file may miss their symmetry without a word
_COLUMN = re.compile(r"([xyz]) *[(\[]?(mm|m|)[)\]]?")

KNITOUT = "pattern.knitout"
"""File for a knitting machine, whose repeat the stitches are: one repeat, where loops and rows are not set."""
KNITOUT_PART = ("pattern.knitout_rows", "pattern.knitout_needles")
"""The first and the last pass of the carriage, and needle, of the part in which the repeat is looked for."""

RELAXED = "geometry.relaxed"
"""Whether a cell of beams is drawn for a thinner yarn and relaxes before the load: any stitches find their shape."""
OF_RELAXED = {
    "load.start": "rest",
    "geometry.diameter_share": 0.6,
    "geometry.free": [],
    "mesh.section_law": "straight",  # the law of curved rods ends at bends that drawn tucks have
}
"""Keys of the base that relaxed loops stand for, where they are not set themselves."""

FRICTION, OF = "contact.friction", "yarn.of"
"""A yarn by its name in ``resources/yarns``, or by the path of a user's file."""

SECTIONS = "yarn", "yarn_b"
"""Sections of yarns, which all may say `of`, `tex` and `density`."""

FOLDER, FIBRES = RESOURCES / "yarns", RESOURCES / "fibres.yaml"

KEYS = {
    "tex": (TEX, "g/km"),
    "diameter": ("yarn.diameter", "m"),
    "stretching": ("yarn.stretching", "N"),
    "bending": ("yarn.bending", "N m2"),
    "twisting": ("yarn.twisting", "N m2"),
    "pressing": ("yarn.pressing", "N"),
    "pressing_exponent": ("yarn.pressing_exponent", "1"),
    "friction": (FRICTION, "1"),
}
"""The key of a scene, and its unit, of every value of a yarn."""

UNITS = {part: unit for part, (_, unit) in KEYS.items()} | {"packing": "1", "pull": "N/tex", "extension": "1"}
OF_FIBRE = {"density": "kg/m3", "modulus": "N/tex", "pressure": "Pa", "pressing_exponent": "1"}
"""Units of all values of a yarn, where `pull` and `extension` are a point of its curve, and of a fibre."""

OF_BEAMS = ("stretching", "bending", "twisting", "pressing")
"""Stiffnesses of a yarn that beams alone have."""

STIFFNESSES = tuple(f"yarn.{name}" for name in OF_BEAMS[:3])
"""Keys that replace the stiffness of a solid circle."""

OF_YARNS = tuple(f"{section}.{name}" for section in SECTIONS for name in ("tex", "density", "of"))
OTHER_WAYS = (*PER_METRE, *OF_YARNS, POINTS_FILE, KNITOUT, *KNITOUT_PART, RELAXED)
"""Names that may be set like keys, though no scene has them."""

DRAWS = (COURSE, WALE, LENGTH)
"""Keys that ask for a loop that is drawn for them, unless control points are given with them."""


def in_base_keys(keys: Mapping[str, Any], where: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return keys by dotted name as keys of a scene, and the keys that yarns set, with their tex or None.

    The former take precedence. A loop length that a yarn has in a fabric of the same stitches is among them: the loop
    is drawn then.
    Raises ConfigurationError where keys give one quantity twice or in part, or a value is not allowed.
    """
    own = dict(keys)
    of_yarns: dict[str, Any] = {}
    for section in SECTIONS:
        own, values = _without_yarn(section, own, where)
        of_yarns |= values
    for in_base in (_spacings, _diameters, _points, _stitches_of_machine, _relaxed, _drawn_loop):
        own = in_base(own, where)
    return own, of_yarns


def _without_yarn(section: str, keys: Mapping[str, Any], where: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return keys without the name of the yarn of a section, and the keys that this yarn sets."""
    of = f"{section}.of"
    tex_key = f"{section}.tex"
    tex = {tex_key: keys[tex_key]} if tex_key in keys else {}
    remaining = {key: value for key, value in keys.items() if key != of}
    if of not in keys:
        return remaining, tex
    yarn = read_yarn(keys[of], where, keys.get(f"{section}.diameter"))
    values = _keys_of_yarn(yarn)
    if section == SECTIONS[0]:
        remaining |= _known_length(yarn, remaining)
    else:
        values = {in_section(key, section): value for key, value in values.items() if key != FRICTION}
        needed = [in_section(key, section) for key, _ in KEYS.values() if key not in (FRICTION, TEX)]
        if lacking := [key for key in needed if key not in values | remaining]:
            raise ConfigurationError(f"{where}: {of} {keys[of]} has no value of {', '.join(lacking)}; set it")
    return remaining, {tex_key: None} | values | tex


def _keys_of_yarn(yarn: YarnFile) -> dict[str, Any]:
    """Return the keys that a yarn sets where it is the first one, friction among them."""
    values = {
        KEYS[part][0]: entry.value
        for part, entry in yarn.values.items()
        if part in KEYS and entry.value is not None
    }
    if any(key in values for key in STIFFNESSES):
        values["mesh.section_law"] = "straight"
    return values


def _known_length(yarn: YarnFile, keys: Mapping[str, Any]) -> dict[str, Any]:
    """Return the loop length of a yarn in a fabric of the stitches that keys name, if keys leave the loop open."""
    if (keys.get(LENGTH), keys.get(POINTS)) != (None, None):
        return {}
    stitches = _rows(keys)
    lengths = [length.value for length in yarn.loop_lengths if length.stitches == stitches and length.value]
    return {LENGTH: lengths[-1]} if lengths else {}


def _spacings(keys: dict[str, Any], where: str) -> dict[str, Any]:
    """Return keys with spacings in place of counts per metre."""
    for name, base in PER_METRE.items():
        if name in keys:
            _only(keys, name, base, where)
            keys[base] = 1 / _positive(name, keys.pop(name), where)
    return keys


def _diameters(keys: dict[str, Any], where: str) -> dict[str, Any]:
    """Return keys with diameters in place of linear and volume densities."""
    for section in SECTIONS:
        densities = [f"{section}.{name}" for name in ("tex", "density")]
        if not any(name in keys for name in densities):
            continue
        for name in densities:
            _only(keys, name, f"{section}.diameter", where)
            if name not in keys:
                raise ConfigurationError(
                    f"{where}: {name} is missing; {' and '.join(densities)} belong together"
                )
        tex, density = (_positive(name, keys.pop(name), where) for name in densities)
        keys[f"{section}.diameter"] = diameter_of(tex, density)
    return keys


def _points(keys: dict[str, Any], where: str) -> dict[str, Any]:
    """Return keys with control points in place of the file that holds them."""
    if POINTS_FILE not in keys:
        return keys
    for base in (POINTS, WALE):
        _only(keys, POINTS_FILE, base, where)
    points, wale, _ = _content(read_points, Path(str(keys.pop(POINTS_FILE))))
    free = keys.get(FREE, ["xyz"] * len(points))
    return keys | {POINTS: points.tolist(), WALE: wale, FREE: free}


def _stitches_of_machine(keys: dict[str, Any], where: str) -> dict[str, Any]:
    """Return keys with stitches in place of the file of a knitting machine."""
    if KNITOUT not in keys:
        return keys
    _only(keys, KNITOUT, STITCHES, where)
    path = Path(str(keys.pop(KNITOUT)))
    part = [_first_and_last(name, keys.pop(name, None), where) for name in KNITOUT_PART]
    repeat = _content(repeat_of, path, *part)
    size = dict(zip(("pattern.loops", "pattern.rows"), size_of_repeat(repeat), strict=True))
    return size | keys | {STITCHES: list(repeat)}


def _relaxed(keys: dict[str, Any], where: str) -> dict[str, Any]:
    """Return keys with those that relaxed loops stand for."""
    if RELAXED not in keys:
        return keys
    relaxed = keys.pop(RELAXED)
    if not isinstance(relaxed, bool):
        raise ConfigurationError(f"{where}: {refused(RELAXED, relaxed, 'true or false')}")
    return (OF_RELAXED if relaxed else {}) | keys


def _drawn_loop(keys: dict[str, Any], where: str) -> dict[str, Any]:
    """Return keys without control points of the defaults, where keys ask for a loop that is drawn."""
    mixed = len(set("".join(_rows(keys)))) > 1
    asked = mixed or any(name in keys for name in DRAWS)
    return keys | {POINTS: None} if asked and POINTS not in keys else keys


def in_section(key: str, section: str) -> str:
    """Return the key of a section of yarns that is that of the first one."""
    return key.replace(f"{SECTIONS[0]}.", f"{section}.")


def values_of_yarns(keys: Mapping[str, Any]) -> list[tuple[str, Value]]:
    """Return the values of the yarns that keys name, each behind the key of a scene that it may be the value of."""
    named = [
        (section, read_yarn(keys[of], diameter=keys.get(f"{section}.diameter")))
        for section in SECTIONS
        if (of := f"{section}.of") in keys
    ]
    values = [(LENGTH, length) for _, yarn in named for length in yarn.loop_lengths]
    for section, yarn in named:
        parts = KEYS.keys() & yarn.values.keys()
        values += [(in_section(KEYS[part][0], section), yarn.values[part]) for part in parts]
    return values


def _rows(keys: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the rows of stitches that keys name; what they cannot be, the section of the scene refuses."""
    rows = keys.get(STITCHES)
    return tuple(map(str, rows)) if isinstance(rows, list | tuple) else ()


def _content(read: Callable[..., Any], path: Path, *part: Any) -> Any:
    """Return what a function reads from a file; every version of the file is read once."""
    return _read(read, path, path.stat().st_mtime_ns if path.is_file() else 0, *part)


@cache
def _read(read: Callable[..., Any], path: Path, _changed: int, *part: Any) -> Any:
    return read(path, *part)


def _first_and_last(name: str, value: Any, where: str) -> tuple[int, int] | None:
    if value is None:
        return None
    ends = value if isinstance(value, list | tuple) else ()
    if [type(end) for end in ends] != [int, int] or ends[0] > ends[1]:
        raise ConfigurationError(
            f"{where}: {name} is {value!r} but must be the first and the last one, such as [3, 14]"
        )
    return ends[0], ends[1]


def _only(keys: Mapping[str, Any], name: str, base: str, where: str) -> None:
    if name in keys and base in keys:
        raise ConfigurationError(f"{where}: {name} and {base} conflict: set only one of them")


def _positive(name: str, value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 < value <= 1e12:  # type: ignore[operator]
        raise ConfigurationError(f"{where}: {refused(name, value, 'a number > 0 and <= 1e12')}")
    return float(value)


def diameter_of(tex: float, density: float) -> float:
    """Return the diameter [m] of a round yarn of a linear density [tex] and a density [kg/m3].

    Its section has the area of the mass per length over the density: Peirce 1937, "The geometry of cloth structure",
    Journal of the Textile Institute 28, who takes 909 kg/m3 (1.1 cm3/g) for cotton and prints d = 34.14 sqrt(1.1 / N)
    thousandths of an inch.
    """
    return sqrt(4 * 1e-6 * tex / (pi * density))


def read_points(path: Path) -> tuple[np.ndarray, float, float]:
    """Return the control points (P, 3) of a file, made symmetric, their wale spacing and by how much they moved. [m]

    Half a turn leads them along x with heads and sinkers behind the legs; the first point goes to x = 0, the middles of
    y and z to 0. The mirror image about the middle of the loop and, where the number of points is a multiple of four,
    that of the half turn about the middle of a leg are averaged in.
    Raises ConfigurationError where the file is not a table of a loop.
    """
    try:
        points = _table(path)
    except (OSError, ValueError) as error:
        wanted = "must be a CSV file with the columns x, y, z in m, or x (mm), y (mm), z (mm)"
        why = error.strerror if isinstance(error, OSError) else str(error).strip()
        raise ConfigurationError(f"{path}: {POINTS_FILE} {wanted}: {why}") from error
    count = len(points) - 1
    along, _, behind = np.sign([points[-1, 0] - points[0, 0], 1.0, points[:, 2].mean() - points[0, 2]])
    points = points * [along, along * (behind or 1.0), behind or 1.0]
    wale = float(points[-1, 0] - points[0, 0])
    middle = 0.5 * (points.max(axis=0) + points.min(axis=0))
    if count < 4 or count % 2 or not np.isfinite(points).all() or wale <= 0 or points[0, 1] > middle[1]:
        raise ConfigurationError(
            f"{path}: {POINTS_FILE} has {count + 1} rows over {wale:g} m of x but must have 5, 7, 9 ... rows of "
            "numbers along x, from a sinker's centre below the heads to the next one's"
        )
    points = points - [points[0, 0], middle[1], middle[2]]
    symmetric = 0.5 * (points + [wale, 0, 0] + points[::-1] * [-1, 1, 1])
    if count % 4 == 0:
        half = symmetric[: count // 2 + 1]
        half = 0.5 * (half + [wale / 2, 0, 0] + half[::-1] * [-1, -1, 1])
        symmetric = np.vstack([half, [wale, 0, 0] + half[-2::-1] * [-1, 1, 1]])
    moved = float(np.linalg.norm(symmetric - points, axis=1).max())
    if moved > ROUNDED * wale:
        log.warning("%s: control points were moved by at most %.3g mm to be symmetric", path, 1e3 * moved)
    return symmetric[:-1], wale, moved


def _table(path: Path) -> np.ndarray:
    """Return the points (P + 1, 3) of a file, with or without names of its columns. [m]"""
    import pandas as pd

    table = pd.read_csv(path, comment="#", skipinitialspace=True, header=None, dtype=str)
    head = [str(name).strip() for name in table.iloc[0]]
    named = {name[1]: (k, name[2] or "m") for k, name in enumerate(map(_COLUMN.fullmatch, head)) if name}
    if not named and len(head) == 3 and pd.to_numeric(table.iloc[0], errors="coerce").notna().all():
        return table.to_numpy(dtype=float)
    units = {unit for _, unit in named.values()}
    if len(named) < 3 or len(units) > 1 or len(table) < 2:
        raise ValueError(f"the first row is {', '.join(head)}{', and no other follows' * (len(table) < 2)}")
    points = table.iloc[1:, [named[axis][0] for axis in "xyz"]].to_numpy(dtype=float)
    return points * (1e-3 if units == {"mm"} else 1.0)


# Yarns as files: values with unit and source; estimates, of fibres that slide or are bonded (notes/yarn_library.md)

OTHER, UPPER = [0, 2, 1], [False, True, False]  # of a value, the upper and the lower end
SHAPE = np.array([0.8, 1.0, 0.59])  # eta: wool, circles, silk (Morton and Hearle 2008, chapter 17)


class Value(Section):
    """A value of a yarn."""

    value: float | None = declared(allowed="a number in the unit, or null where it is not known")
    unit: str = declared(allowed="a unit as a text, such as m, or '1' in quotes")
    provenance: Literal[
        "measured", "printed", "fitted on stockinette", "from a source", "estimated", "assumed", "unknown"
    ] = declared()
    source: Annotated[str, Field(min_length=1)] = declared(allowed="a text: where the value comes from")
    interval: tuple[float, float] | None = declared(
        allowed="the lowest and the highest value that go as well, or null", default=None
    )

    @property
    def ends(self) -> Floats:
        """The value, and the upper and the lower end of its interval."""
        return np.array([self.value, *(self.interval or (self.value, self.value))[::-1]], dtype=float)


class LoopLength(Value):
    """The yarn in a stitch of a fabric [m]."""

    unit: Literal["m"] = declared()
    stitches: Annotated[tuple[str, ...], Field(min_length=1)] = declared(
        allowed="rows of a repeat, as of pattern.stitches"
    )


class Strand(Section):
    """Fibres of one kind in a yarn; the last strand is the outer one."""

    fibre: str = declared(allowed="a fibre of resources/fibres.yaml")
    tex: Positive = declared(unit="g/km")
    fibre_tex: Positive = declared(unit="g/km")
    length: float = declared(meaning="metres of it in a metre of the yarn", default=1.0, ge=1)
    pull: Positive | None = declared(
        unit="N/tex", meaning="tension at `extension`, a point of its curve as a yarn", default=None
    )
    extension: Positive | None = declared(meaning="strain of it at `pull`", default=None)

    @property
    def pulls_by(self) -> float | None:
        """Pull over extension [N/tex]; None where it pulls as straight fibres do."""
        return None if self.pull is None or self.extension is None else self.pull / self.extension


class YarnFile(Section):
    """A yarn: its name for people, its values or strands, and how much of it there is in a stitch of some fabrics."""

    name: str = declared(allowed="a text", default="")
    values: dict[str, Any] = declared(allowed="a group of values, such as diameter")  # of `Value`
    loop_lengths: tuple[Any, ...] = declared(allowed="a list of lengths", default=())  # of `LoopLength`
    strands: tuple[Any, ...] = declared(allowed="a list of strands", default=())  # of `Strand`


def known_yarns() -> dict[str, Path]:
    """Return the files of the yarn library, by name."""
    return {path.stem: path for path in sorted(FOLDER.glob("*.yaml"))}


def read_yarn(name: str, where: str = OF, diameter: Any = None) -> YarnFile:
    """Return a yarn by its name, or from a file of the user, with estimates of what its strands give and it leaves out.

    A `diameter` that the scene says [m] takes the place of a packing that the file does not say.
    Raises ConfigurationError, naming the file, the value and the allowed values.
    """
    own = Path(str(name))
    path = own if own.suffix in (".yaml", ".yml") else find("yarn", known_yarns(), str(name), where)
    if not path.is_file():
        raise ConfigurationError(f"{where}: yarn {name!r}: there is no such file")
    yarn = validated(YarnFile, read_yaml(path), where := str(path))
    values = _values(yarn.values, UNITS, where)
    lengths = tuple(
        validated(LoopLength, loop_length, where, "loop_lengths.") for loop_length in yarn.loop_lengths
    )
    if strands := [validated(Strand, strand, where, "strands.") for strand in yarn.strands]:
        values = _estimates(strands, values, where, diameter) | values
    return yarn.model_copy(update={"values": values, "loop_lengths": lengths})


def _values(entries: Mapping[str, Any], units: Mapping[str, str], where: str) -> dict[str, Value]:
    """Return values by name, each in the unit that it must have."""
    values = {part: validated(Value, entry, where, f"{part}.") for part, entry in entries.items()}
    for part, quantity in values.items():
        unit = find("value of a yarn", units, part, where)
        if quantity.unit != unit:
            raise ConfigurationError(f"{where}: {part}.unit is {quantity.unit!r} but must be {unit!r}")
        if (quantity.value is None) != (quantity.provenance == "unknown"):
            only = "where its provenance is unknown, and only there"
            raise ConfigurationError(f"{where}: {part}.value must be null {only}")
        if quantity.interval and quantity.interval[0] > quantity.interval[1]:
            raise ConfigurationError(f"{where}: {part}.interval must be the lowest value before the highest")
    return values


def _known_ends(
    strands: list[Strand], values: Mapping[str, Value], where: str, diameter: Any
) -> dict[str, Floats]:
    """Return values with their upper and lower ends (3,) by name; refuse what no estimate can be made of."""
    known = {part: value.ends for part, value in values.items() if value.value is not None}
    if isinstance(diameter, int | float) and diameter > 0:
        known.setdefault("diameter", np.full(3, float(diameter)))
    if _is_packed(known) and not all(0 < packing <= 1 for packing in known.get("packing", [0])):
        needs = "packing is missing or not above 0 and <= 1; an estimate of the diameter needs it"
        raise ConfigurationError(f"{where}: {needs}: set it, or the diameter")
    if min(known.get("extension", [1])) <= 0:
        raise ConfigurationError(f"{where}: extension is not above 0, as of a point of the yarn's curve")
    if halves := [s.fibre for s in strands if (s.pull is None) != (s.extension is None)]:
        raise ConfigurationError(f"{where}: strand {halves[0]}: pull and extension belong together; set both")
    return known


def _is_packed(known: Mapping[str, Floats]) -> bool:
    """Whether the diameter follows from the packing."""
    return "packing" in known or "diameter" not in known


def _estimates(
    strands: list[Strand], values: Mapping[str, Value], where: str, diameter: Any = None
) -> dict[str, Value]:
    """Return values of T tex of fibres of t tex each; arrays hold value, upper and lower end, of strands (n, 3).

    The diameter follows from the packing, or else is that of the file, or the `diameter` that the scene sets [m].
    """
    known = _known_ends(strands, values, where, diameter)
    fibres = [_values(find("fibre", read_yaml(FIBRES), s.fibre, where), OF_FIBRE, where) for s in strands]
    rho, E, pressure, exponent = (np.array([fibre[part].ends for fibre in fibres]) for part in OF_FIBRE)
    T, t, length = np.moveaxis(np.array([3 * [(s.tex, s.fibre_tex, s.length)] for s in strands]), 2, 0)
    tex, volume, straight = np.sum([T * length, T * length / rho[:, OTHER], E * T], axis=1)
    if _is_packed(known):
        diameter = np.array([*map(diameter_of, tex, known["packing"][OTHER] * tex / volume)])
    else:
        diameter = known["diameter"]
    curve = {"pull", "extension"} <= known.keys()
    # Strands of one length are parallel springs; longer ones, such as turns around a core, are slack at first.
    pulling = np.array(
        [E_s if s.pulls_by is None else 3 * [s.pulls_by] for s, E_s in zip(strands, E, strict=True)]
    )
    shortest = np.sum(pulling * T, axis=0, where=length <= np.min(length))
    slack = tex * known["pull"] / known["extension"][OTHER] if curve else shortest
    sliding = SHAPE * 1e-6 * np.sum(E * T * t / (4 * pi * rho[:, OTHER] * length), axis=0)
    stretching, bending = np.where(UPPER, (straight, straight * diameter**2 / 16), (slack, sliding))
    found = {
        "tex": (tex, "sum of T length"),
        "diameter": (diameter, "sqrt(4 V / (pi packing)), V = sum of T length / rho"),
        "stretching": (
            stretching,
            "tex pull / extension, else sum of T pull / extension, or E T, of shortest strands; up to sum of E T",
        ),
        "bending": (bending, "sum of eta E T t / (4 pi rho length); up to d2 / 16 times sum of E T"),
        "twisting": (bending * [1 / 1.33, 1 / 1.33, 0.1], "bending / (1 + 0.33); down to bending / 10"),
        "pressing": (pressure[-1] * diameter**2, "pressure d2, of the outer strand"),
        "pressing_exponent": (exponent[-1], "of the outer strand"),
    }
    return {
        part: Value(value=x, unit=UNITS[part], provenance="estimated", source=formula, interval=(low, high))
        for part, (ends, formula) in found.items()
        for x, high, low in [ends.tolist()]
    }
