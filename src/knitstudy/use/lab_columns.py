"""What the columns of a measured curve mean: their quantity, unit and measure of strain or stress.

Strains are changes of length over the length at rest, forces are per width at rest (nominal measures). Other measures
are converted where the conversion has no open value, and refused elsewhere: a word that changes the meaning of a
column is never passed over.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from knitstudy.errors import DataFileError
from knitstudy.registry import find

log = logging.getLogger(__name__)

RATIOS = {"%": 0.01, "1": 1.0, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0}
LENGTHS = {"um": 1e-6, "µm": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
FORCES = {
    "N": 1.0,
    "cN": 1e-2,
    "mN": 1e-3,
    "daN": 10.0,
    "kN": 1e3,
    "gf": 9.80665e-3,
    "kgf": 9.80665,
    "lbf": 4.4482216152605,
}
WIDTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
PER_WIDTH = {
    f"{force}/{width}": newton / metre for force, newton in FORCES.items() for width, metre in WIDTHS.items()
}
STRESSES = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "psi": FORCES["lbf"] / WIDTHS["in"] ** 2} | {
    f"{force}/{width}2": newton / metre**2
    for force, newton in FORCES.items()
    for width, metre in WIDTHS.items()
}
UNITS = {"strain": RATIOS | LENGTHS, "force": PER_WIDTH | FORCES | STRESSES}
"""Over 1 or N/m; or over m, N and Pa, which take a size of the specimen: divided by it, stresses times it."""

MENTIONED = {
    "strain": (*RATIOS, *LENGTHS),
    "force": (*FORCES, "N/m", "N/cm", "N/mm", "cN/cm", "gf/cm", "lbf/in", "Pa", "kPa", "MPa", "N/mm2", "psi"),
}
"""Units that messages name."""

OTHER_UNITS = frozenset(
    {"s", "sec", "ms", "min", "h", "Hz", "°C", "K", "V", "mV", "J", "mJ", "mm/min", "mm/s"}
)
SPELLINGS = {
    "-": "1",
    "percent": "%",
    "inch": "in",
    "inches": "in",
    "newton": "N",
    "newtons": "N",
    "μm": "µm",
}

SIZES = (
    dict.fromkeys(LENGTHS, "length") | dict.fromkeys(FORCES, "width") | dict.fromkeys(STRESSES, "thickness")
)
"""Sizes of the specimen by the units that take one."""

NAMES = {
    "strain": re.compile("strain|elongation|extension|displacement|stretch"),
    "force": re.compile("force|load|(?<!ex)tension|stress"),
}
LENGTHENED = re.compile("displacement|extension", re.IGNORECASE)  # without a unit these are no ratios
LARGEST = 1.5  # a strain without a unit that exceeds this one may be meant in %

# Words in the name of a column, by what they make of it
TRUE = {"true", "wahr", "wahre", "wahrer", "vrai", "vraie", "verdadera", "vera"}
TRUE_STRAIN = TRUE | {
    "truestrain",
    "logstrain",
    "log",
    "ln",
    "logarithmic",
    "logarithmique",
    "logarithmische",
    "hencky",
    "natural",
}
TRUE_STRESS = TRUE | {"truestress", "cauchystress", "cauchy"}
NOMINAL = {"nominal", "engineering", "eng", "technical", "original", "initial"}
STRETCH = ({"stretch", "ratio"}, {"draw", "ratio"}, {"lambda"})
DEFORMED = {"actual", "current", "instantaneous", "deformed"}
OTHER_STRAINS = DEFORMED | {
    "green",
    "lagrange",
    "lagrangian",
    "almansi",
    "euler",
    "eulerian",
    "biot",
    "cauchy",
}
OTHER_STRESSES = DEFORMED | {"piola", "kirchhoff", "biot"}
COMPRESSION = {"compressive", "compression"}
OTHER_COLUMNS = (
    {"sd", "std", "dev", "deviation", "err", "error", "rate", "energy", "work", "modulus"}
    | {"max", "maximum", "break", "yield", "permanent", "residual", "plastic"}
    | {"transverse", "lateral", "shear", "volumetric", "poisson", "minor"}
)
"""Words of columns that have a strain or a force in their names and are no curve; they can be named by an option."""

LARGEST_TRUE = 50.0  # beyond it exp overflows; no fabric has such a strain


@dataclass(frozen=True, eq=False)
class Measured:
    """A column as a nominal quantity.

    Parameters
    ----------
    label : str
        Name in the file.
    unit : str
        One of `UNITS`.
    values : Series
        Strains (n,) [1], forces per width (n,) [N/m]; measures as the file has them.
    """

    label: str
    unit: str
    values: pd.Series[float]

    @property
    def words(self) -> set[str]:
        """Words of the name."""
        return words_of(self.label)


def words_of(label: str) -> set[str]:
    """Return the words of a name in lower case.

    Examples
    --------
    >>> sorted(words_of("TrueStress_2 (MPa)"))
    ['mpa', 'stress', 'true']
    """
    apart = re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", " ", label)
    return set(re.findall(r"[^\W\d_]+", apart.lower()))


def plain_unit(text: str) -> str:
    """Return a unit as `UNITS` has it, without the brackets and blanks that a file writes around and within it.

    Examples
    --------
    >>> plain_unit("[ N / mm² ]"), plain_unit("(-)"), plain_unit("Percent")
    ('N/mm2', '1', '%')
    """
    bare = "".join(text.split()).strip("()[]").replace("²", "2").replace("^2", "2")
    return SPELLINGS.get(bare.lower(), SPELLINGS.get(bare, bare))


def is_unit(text: str) -> bool:
    """Return whether a text is a unit of some quantity of a test."""
    unit = plain_unit(text)
    return unit in OTHER_UNITS or any(unit in units for units in UNITS.values())


def parted(label: str) -> tuple[str, str | None]:
    """Return the name and the unit in brackets at the end of a label; None where it has no brackets there.

    Examples
    --------
    >>> parted("Force [ kN ]"), parted("Tensile strain (Extension) (%)"), parted("force_N")
    (('Force', 'kN'), ('Tensile strain (Extension)', '%'), ('force_N', None))
    """
    for opening, closing in ("()", "[]"):
        if label.endswith(closing) and opening in label:
            place = label.rindex(opening)
            return label[:place].strip(), plain_unit(label[place:])
    return label, None


def measured_columns(
    table: pd.DataFrame, how: Mapping[str, Any], direction: str, path: Path
) -> tuple[pd.Series[float], pd.Series[float]]:
    """Return strains (n,) [1] and forces per width (n,) [N/m] of a table, both nominal.

    Parameters
    ----------
    table : DataFrame
        Columns by their labels, as of `read_lab_table`.
    how : mapping
        For ``strain`` and ``force`` a column and its unit, where names do not tell them; ``length``, ``width`` and
        ``thickness`` of the specimen [m].
    direction : str
        "course" or "wale": of several columns the one is taken that begins with it.
    path : Path
        The file, for messages.

    Raises
    ------
    DataFileError
        If a column, its unit, its measure or a size that it takes is not known.
    """
    strain, force = (_measured(table, name, how, direction, path) for name in UNITS)
    nominal = _nominal_strain(strain, path)
    true_strain = strain.unit in RATIOS and bool(strain.words & TRUE_STRAIN)
    return nominal, _nominal_force(force, nominal, true_strain, path)


def _measured(table: pd.DataFrame, name: str, how: Mapping[str, Any], direction: str, path: Path) -> Measured:
    """Return the column of strain or force, over its unit and over a size of the specimen."""
    if name in how:
        column, unit = how[name]
        label = _named(table, column, f"{path}: --{name}")
        unit = plain_unit(unit)
        if (own := _own_unit(label, name)) not in ("", unit):
            log.warning("%s: %r is taken in %s, as --%s says, not in %s", path, label, unit, name, own)
    else:
        label, unit = _recognised(table, name, direction, path)
    scale = find("unit", UNITS[name], unit, f"{path}: --{name}")
    values = table[label]
    if not is_numeric_dtype(values):
        word = next(iter(values), "")
        raise DataFileError(f"{path}: {label!r} holds words: {word!r}; add --{name} COLUMN UNIT")
    values = scale * values
    if size := SIZES.get(unit):
        if size not in how:
            example = 0.001 if size == "thickness" else 0.05
            remedy = f"add --{size} of the specimen in m, for example --{size} {example}"
            raise DataFileError(f"{path}: {label!r} is in {unit}: {remedy}")
        values = values * how[size] if size == "thickness" else values / how[size]
    return Measured(label, unit, values)


def _named(table: pd.DataFrame, column: str, where: str) -> str:
    """Return the label of a column that an option names, with its unit or without."""
    wanted = " ".join(column.split())
    without_units = [label for label in table if parted(label)[0] == wanted]
    if wanted not in table and len(without_units) == 1:
        return without_units[0]
    find("column", dict.fromkeys(table), wanted, where)
    return wanted


def _own_unit(label: str, name: str) -> str:
    """Return the unit of a strain or a force that a label ends with, in brackets or as force_N_mm; "" for none."""
    unit = parted(label)[1]
    if unit is not None:
        return unit
    if label.endswith("%"):
        return "%"
    for unit in sorted(UNITS[name], key=len, reverse=True):
        for ending in (unit, unit.replace("/", "_")):
            if label.endswith(ending) and label[: -len(ending)].endswith((" ", "_", ",", "/")):
                return unit
    return ""


def _recognised(table: pd.DataFrame, name: str, direction: str, path: Path) -> tuple[str, str]:
    """Return the column of strain or force, of several that of the direction, and its unit, by their names."""
    labels = _named_like(table, name, direction)
    add = f"add --{name} COLUMN UNIT, with a unit of {', '.join(MENTIONED[name])}"
    if len(labels) != 1:
        some = ", ".join(map(repr, (labels or [*table])[:6])) + (", ..." if table.shape[1] > 6 else "")
        raise DataFileError(
            f"{path}: {len(labels) or 'no'} columns are named like a {name}: {some[:300]}; {add}"
        )
    (label,) = labels
    if unit := _own_unit(label, name):
        if unit not in UNITS[name]:
            raise DataFileError(f"{path}: {label!r}: unit {unit} is not known; {add}")
        return label, unit
    ratio = name == "strain" and not LENGTHENED.search(label)
    if ratio and is_numeric_dtype(table[label]) and table[label].abs().max() <= LARGEST:
        log.warning("%s: %r has no unit and is taken as a ratio, not in %%", path, label)
        return label, "1"
    raise DataFileError(f"{path}: {label!r} has no unit; {add}")


def _named_like(table: pd.DataFrame, name: str, direction: str) -> list[str]:
    """Return the columns that are named like a strain or force, of several those of the direction."""
    labels = [
        label
        for label in map(str, table)
        if NAMES[name].search(label.lower()) and not words_of(label) & OTHER_COLUMNS
    ]
    own = [label for label in labels if label.lower().startswith(direction)]
    if len(labels) > 1 and own:
        return [label for label in own if "[N/m]" in label] or own
    return labels


def _refuse(column: Measured, words: set[str], why: str, remedy: str, path: Path) -> None:
    """Raise DataFileError where a word of the name says that the column is of another measure."""
    if found := sorted(column.words & words):
        raise DataFileError(f"{path}: {column.label!r} {why} ({found[0]}): {remedy}")


def _nominal_strain(strain: Measured, path: Path) -> pd.Series[float]:
    """Return strains as changes of length over the length at rest."""
    _refuse(strain, COMPRESSION, "is of compression", "a curve of tension is needed", path)
    if strain.unit in LENGTHS:
        return strain.values
    remedy = (
        "give a change of length with --length, or name the column strain if it is over the length at rest"
    )
    _refuse(strain, OTHER_STRAINS, "is another measure of strain", remedy, path)
    if "λ" in strain.label or any(words <= strain.words for words in STRETCH):
        log.warning("%s: %r is a ratio of lengths; 1 is taken off", path, strain.label)
        return strain.values - 1
    if strain.words & TRUE_STRAIN:
        log.warning("%s: %r is true strain; exp(strain) - 1 is taken", path, strain.label)
        return np.expm1(strain.values.clip(-LARGEST_TRUE, LARGEST_TRUE))
    return strain.values


def _nominal_force(
    force: Measured, strain: pd.Series[float], true_strain: bool, path: Path
) -> pd.Series[float]:
    """Return forces over the width at rest; `strain` is nominal, from a column of `true_strain` or not."""
    _refuse(force, COMPRESSION, "is of compression", "a curve of tension is needed", path)
    if force.unit in FORCES:
        return force.values
    remedy = "give a force with --width"
    _refuse(force, OTHER_STRESSES, "is over a section or a width under load", remedy, path)
    if force.unit in PER_WIDTH:
        _refuse(force, TRUE_STRESS, "is over the width under load", remedy, path)
        return force.values
    if not force.words & TRUE_STRESS:
        if true_strain and not force.words & NOMINAL:
            raise DataFileError(
                f"{path}: {force.label!r} beside true strain can be true or nominal: write the word before its name"
            )
        return force.values
    if not (strain > -1).all():
        raise DataFileError(
            f"{path}: {force.label!r} is true stress and needs strains that begin at 0; {remedy}"
        )
    log.warning(
        "%s: %r is true stress; stress / (1 + strain) is taken, which is nominal at constant volume",
        path,
        force.label,
    )
    return force.values / (1 + strain)
