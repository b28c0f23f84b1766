"""Specimens: what is simulated, with its sections and what contradicts each other between them."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from knitstudy.knit.scene.keys import section
from knitstudy.knit.scene.kinds import SPECIMENS, Specimen
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.sections import (
    DrawnCellStrain,
    Geometry,
    KnitTension,
    Pair,
    PairPath,
    Pattern,
    Tension,
)
from knitstudy.knit.scene.stitches import is_plain, size_of_repeat


class Looped(Scene):
    """Loops of yarns."""

    pattern: Pattern = section()
    geometry: Geometry = section()
    load: Tension = section()

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        pattern = self.pattern
        diameter = self.yarn.diameter
        for name in ("course_spacing", "wale_spacing"):
            if (spacing := getattr(pattern, name)) <= diameter:
                raise ValueError(
                    f"pattern.{name} is {spacing:g} m but must exceed yarn.diameter, {diameter:g} m"
                )
        if pattern.course_ratio <= (least := diameter / pattern.course_spacing):
            least_of = f"yarn.diameter / pattern.course_spacing, {least:.4g}"
            raise ValueError(f"pattern.course_ratio is {pattern.course_ratio:g} but must exceed {least_of}")
        if self.geometry.diameter_share != 1 and getattr(self.load, "start", "drawn") == "drawn":
            of = "where load.start is not rest: only there do yarns press each other before the load"
            raise ValueError(
                f"geometry.diameter_share is {self.geometry.diameter_share:g} but must be 1 {of}"
            )
        return self

    @model_validator(mode="after")
    def _has_whole_repeats(self) -> Self:
        pattern = self.pattern
        of = f"where pattern.stitches is {list(pattern.stitches)}"
        for name, repeat in zip(("loops", "rows"), size_of_repeat(pattern.stitches), strict=True):
            if (count := getattr(pattern, name)) % repeat:
                whole = f"the {name} of a repeat of pattern.stitches {list(pattern.stitches)}"
                raise ValueError(f"pattern.{name} is {count} but must be a multiple of {repeat}, {whole}")
        if not is_plain(pattern.stitches) and self.takes != "all stitches":
            must = f"must be cell and beam {of}: such loops find their shape at rest"
            raise ValueError(f"specimen is {self.specimen} and fidelity {self.fidelity} but {must}")
        if len(set("".join(pattern.stitches))) > 1 and self.takes == "one stitch":
            raise ValueError(
                f"fidelity is {self.fidelity} but must be another {of}: it models one stitch alone"
            )
        return self

    @model_validator(mode="after")
    def _has_a_loop(self) -> Self:
        pattern = self.pattern
        of = "where pattern.control_points is null: the loop is drawn for the spacings"
        if pattern.control_points is None:
            for name, value in (("course_ratio", 1.0), ("keep", "shape")):
                if getattr(pattern, name) != value:
                    raise ValueError(
                        f"pattern.{name} is {getattr(pattern, name)!r} but must be {value!r} {of}"
                    )
            return self
        points = len(pattern.control_points)
        entries = len(self.geometry.free)
        if len(set("".join(pattern.stitches))) > 1:
            of = f"where pattern.stitches is {list(pattern.stitches)}: loops that differ are drawn for the spacings"
            raise ValueError(f"pattern.control_points has {points} points but must be null {of}")
        if pattern.loop_length is not None:
            of = "where there are pattern.control_points, which have a length"
            raise ValueError(f"pattern.loop_length is {pattern.loop_length:g} m but must be null {of}")
        if entries != points:
            wanted = f"{points}, one for each of pattern.control_points"
            raise ValueError(f"geometry.free has {entries} entries but must have {wanted}")
        return self


class Knit(Looped):
    """A knit that ends: rows of loops, or cells cut out of one."""

    specimens = ("cut_knit", "knit")

    load: KnitTension = section()

    @model_validator(mode="after")
    def _is_not_tied_throughout(self) -> Self:
        name = "rows" if self.load.direction == "course" else "loops"
        if self.value("contact.tied_edges") == "outer" and (count := getattr(self.pattern, name)) < 3:
            of = f"where pattern.{name} is {count}: nothing is left that is not tied"
            raise ValueError(f"contact.tied_edges is 'outer' but must be none {of}")
        return self


class Cell(Looped):
    """A cell of an endless knit."""

    specimens = ("cell",)

    load: DrawnCellStrain = section()

    @model_validator(mode="after")
    def _has_a_deck_where_it_is_written(self) -> Self:
        if "deck" in self.outputs and not self.kind.fidelity.solid:
            of = f"where specimen is cell and fidelity {self.fidelity}"
            why = "decks have solid yarns, or the stiffness of tied ones; use fidelity spline_yarns"
            raise ValueError(f"outputs is {list(self.outputs)} but must be [] {of}: {why}")
        return self


class Crossing(Scene):
    """Two straight yarns that cross."""

    specimens = ("pair",)

    pair: Pair = section()
    load: PairPath = section()

    @model_validator(mode="after")
    def _is_long_enough(self) -> Self:
        if self.pair.length <= 2 * self.yarn.diameter:
            least = f"twice yarn.diameter, {self.yarn.diameter:g} m"
            raise ValueError(f"pair.length is {self.pair.length:g} m but must exceed {least}")
        return self


OF_KNIT = ("pattern", "geometry", "yarn.diameter")
OF_PAIR = ("pair.angle", "pair.length", "pair.clearance", "yarn.diameter")
for _specimen in (
    Specimen("knit", "rows of loops", Knit, OF_KNIT),
    Specimen("cut_knit", "cells cut out of a knit", Knit, OF_KNIT),
    Specimen("cell", "a cell of an endless knit", Cell, OF_KNIT, whole=False, outputs=("deck",)),
    Specimen("pair", "two straight yarns that cross", Crossing, OF_PAIR),
):
    SPECIMENS.register(_specimen)
