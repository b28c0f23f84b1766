"""Yarns as files: measured, printed, fitted or assumed values, each with its unit and its source.

With ``yarn.of: acrylic``, a scene takes its keys of the yarn from ``resources/yarns/acrylic.yaml``. Keys of the scene
itself have priority; friction is left out of scenes whose yarns do not slide. A path names a user's file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.documents import RESOURCES, read_yaml
from knitstudy.knit.scene.keys import Section, declared, validated
from knitstudy.registry import find

OF = "yarn.of"
FOLDER = RESOURCES / "yarns"

KEYS = {
    "diameter": ("yarn.diameter", "m"),
    "stretching": ("yarn.stretching", "N"),
    "bending": ("yarn.bending", "N m2"),
    "twisting": ("yarn.twisting", "N m2"),
    "pressing": ("yarn.pressing", "N"),
    "pressing_exponent": ("yarn.pressing_exponent", "1"),
    "friction": ("contact.friction", "1"),
}
"""The key of a scene, and its unit, of every value of a yarn."""

STIFFNESSES = tuple(KEYS[name][0] for name in ("stretching", "bending", "twisting"))
"""Keys that replace the stiffness of a solid circle."""


class Value(Section):
    """A value of a yarn."""

    value: float | None = declared(allowed="a number in the unit, or null where it is not known")
    unit: str = declared()
    provenance: Literal["measured", "printed", "fitted on stockinette", "assumed", "unknown"] = declared()
    source: Annotated[str, Field(min_length=1)] = declared(allowed="a text: where the value comes from")
    interval: tuple[float, float] | None = declared(
        allowed="the lowest and the highest value that go as well, or null", default=None
    )


class LoopLength(Value):
    """The yarn in a stitch of a fabric [m]."""

    stitches: Annotated[tuple[str, ...], Field(min_length=1)] = declared(
        allowed="rows of a repeat, as of pattern.stitches"
    )


class YarnFile(Section):
    """A yarn: its name for people, its values, and how much of it there is in a stitch of some fabrics."""

    name: str = declared(allowed="a text", default="")
    values: dict[str, Any] = declared(allowed="a group of values, such as diameter")  # of `Value`
    loop_lengths: tuple[Any, ...] = declared(allowed="a list of lengths", default=())  # of `LoopLength`


def known_yarns() -> dict[str, Path]:
    """Return the files of the yarns that are kept, by name."""
    return {path.stem: path for path in sorted(FOLDER.glob("*.yaml"))}


def read_yarn(name: str, where: str = OF) -> YarnFile:
    """Return a yarn by its name, or from a file of the user.

    Raises ConfigurationError, naming the file, the value and the allowed values.
    """
    own = Path(str(name))
    path = own if own.suffix in (".yaml", ".yml") else find("yarn", known_yarns(), str(name), where)
    yarn = validated(YarnFile, read_yaml(path), where := str(path))
    values = {part: validated(Value, entry, where, f"{part}.") for part, entry in yarn.values.items()}
    for part, quantity in values.items():
        _, unit = find("value of a yarn", KEYS, part, where)
        if quantity.unit != unit:
            raise ConfigurationError(f"{where}: {part}.unit is {quantity.unit!r} but must be {unit!r}")
        if (quantity.value is None) != (quantity.provenance == "unknown"):
            only = "where its provenance is unknown, and only there"
            raise ConfigurationError(f"{where}: {part}.value must be null {only}")
    lengths = tuple(
        validated(LoopLength, loop_length, where, "loop_lengths.") for loop_length in yarn.loop_lengths
    )
    return yarn.model_copy(update={"values": values, "loop_lengths": lengths})
