"""The physical problem of a scene, for which a model is chosen, beside the knits that models were measured on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from math import inf
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.keys import lists
from knitstudy.knit.scene.scene import Scene, digest, rounded
from knitstudy.run.advice.sample import (
    CYCLE,
    INPUT_KEYS,
    LARGE,
    OF_CONTACT,
    OF_KNIT,
    PEIRCE,
    SMALL,
    SPECIMENS,
    TIED,
    TOUCHING,
    UNDECIDED,
    Inputs,
    SampleCase,
    Trade,
    load_trade,
)

DIGITS = 6  # of numbers of problems that are alike

OVER = {
    "course": " over yarn.diameter",
    "wale": " over yarn.diameter",
    "length": " over that of Peirce's loop",
}

FREE = {*INPUT_KEYS.values(), "yarn.diameter", "yarn.youngs_modulus", "load.deformation"}
"""Physical keys that inputs stand for, or that results scale with."""

OF_LOOP = {"geometry.alpha", "geometry.free", "pattern.control_points"}
"""Physical keys of a loop with control points: its length stands for them beside the sample."""


@dataclass(frozen=True)
class PhysicalProblem:
    """The physical problem of a scene, whatever its model."""

    scene: Scene
    trade: Trade = field(default_factory=load_trade)

    @cached_property
    def inputs(self) -> Inputs:
        """The knit without dimensions."""
        scene = self.scene
        pattern = self.scene.value("pattern")
        load = self.scene.value("load")
        d = scene.yarn.diameter
        endless = scene.specimen == "cell"
        course = pattern.course_ratio * pattern.course_spacing / d
        wale = pattern.wale_spacing / d
        peirce = 2 * course + wale + PEIRCE
        return Inputs(
            course,
            wale,
            (pattern.loop_length or peirce * d) / (peirce * d),
            scene.yarn.poisson_ratio,
            self.turns[0] if self.turns else load.strain,
            scene.friction if scene.kind.interaction.touches else 0.0,
            1 if endless else pattern.loops,
            1 if endless else pattern.rows,
            load.deformation if endless else load.direction,
            load.lateral,
            scene.value("contact.tied_edges") or "none",
        )

    @cached_property
    def length(self) -> float:
        """The yarn in a loop over that in Peirce's; of control points once they are at their optimum."""
        if self.scene.value("pattern.control_points") is None:
            return self.inputs.length
        from knitstudy.knit.geometry.lay_out import lay_out  # which other problems do not wait for

        peirce = 2 * self.inputs.course + self.inputs.wale + PEIRCE
        return float(lay_out(self.scene)["loop_length"][-1]) / (peirce * self.scene.yarn.diameter)

    @property
    def turns(self) -> tuple[float, ...]:
        """Strains at which the load turns back."""
        return self.scene.value("load.turns") or ()

    @cached_property
    def case(self) -> SampleCase:
        """The specimen, tied or touching, to small or large strains, or through cycles."""
        yarns = TOUCHING if self.scene.kind.interaction.touches else TIED
        large = LARGE if self.inputs.strain > self.trade.box["strain"][-1] else SMALL
        return SampleCase(self.scene.specimen, yarns, CYCLE if self.turns else large)

    @cached_property
    def others(self) -> dict[str, Any]:
        """The physical keys that no input stands for, over diameter and Young's modulus of the yarn."""
        yarn = self.scene.yarn
        values = self.scene.scaled(1 / yarn.diameter, 1 / yarn.youngs_modulus).values_of("physics")
        drawn = self.scene.value("pattern.control_points") is None
        left_out = FREE | OF_LOOP if drawn else FREE
        return rounded({key: value for key, value in values.items() if key not in left_out}, DIGITS)

    @cached_property
    def digest(self) -> str:
        """Digest of all that is physical, the same at any scale and modulus."""
        inputs = rounded(asdict(self.inputs), DIGITS)
        parts: list[Any] = [self.scene.specimen, self.scene.interaction, inputs, self.others]
        pattern = self.scene.value("pattern")
        if self.case.specimen == "cell" and (size := [pattern.loops, pattern.rows]) != [1, 1]:
            parts.append(size)  # they have prices of their own
        return digest(parts + [self.scene.value("load.strain")] * bool(self.turns))

    @cached_property
    def settings(self) -> dict[str, dict[str, Any]]:
        """Keys of the model settings that take the problem, by name.

        Some do not: beams in endless cells always slip, for example.
        """
        settings = self.trade.settings_of(self.case)
        return {name: keys for name, keys in settings.items() if self._allows(keys)}

    def _allows(self, keys: Mapping[str, Any]) -> bool:
        try:
            self.scene.vary(keys)
        except ConfigurationError:
            return False
        return True

    def endless(self) -> PhysicalProblem:
        """Return a cell of the endless fabric of the same loops under the same strain."""
        size = {"pattern.loops": 1, "pattern.rows": 1, "load.deformation": self.scene.value("load.direction")}
        cell = {"specimen": "cell", "fidelity": UNDECIDED, "outputs": []}
        return replace(self, scene=self.scene.vary(cell | size))

    def largest_measured(self) -> PhysicalProblem | None:
        """Return a knit with as many cells as the largest of the sample, in place of a larger one; else None."""
        most = {INPUT_KEYS[name]: self.trade.box[name][1] for name in ("loops", "rows")}
        less = {key: count for key, count in most.items() if self.scene.value(key) > count}
        return replace(self, scene=self.scene.vary(less)) if less else None

    @cached_property
    def outside(self) -> str:
        """What lies outside of the box, in words; an empty text where all lies inside.

        The sample was made with the defaults of the package.
        """
        if self.scene.specimen not in SPECIMENS:
            measured = f"models were measured on {' and '.join(SPECIMENS)}"
            return f"specimen is {self.scene.specimen!r}, but {measured}"
        return next(self._outside(), "")

    def _outside(self) -> Iterator[str]:
        yield from self._outside_of_cycles()
        for name, value in (asdict(self.inputs) | {"length": self.length}).items():
            if self.case.specimen == "cell" and name in OF_KNIT:
                yield from self._outside_of_one_loop(INPUT_KEYS[name])
            elif name not in OF_CONTACT or self._has_measured_contact(value):
                yield from self._outside_of_range(name, value)
        yield from self._unlike_sample()

    def _outside_of_cycles(self) -> Iterator[str]:
        back = self.trade.cycle.back
        end = self.scene.value("load.strain")
        if self.turns and (len(self.turns) > 1 or not 0 <= end <= (1 + 1e-9) * back * self.turns[0]):
            fact = f"load.turns is {lists(self.turns)}, load.strain {end:g}"
            yield f"{fact}, but models were measured with one turn and back to {back:.0%}"

    def _outside_of_one_loop(self, key: str) -> Iterator[str]:
        if key.startswith("pattern.") and (count := self.scene.value(key)) != 1:
            yield f"{key} is {count}, but models were measured on cells of one loop"

    def _has_measured_contact(self, value: Any) -> bool:
        """Whether an input of contact has a range: not of tied yarns, nor infinite friction at small strains."""
        return self.case.yarns != TIED and not (value == inf and self.case.path == SMALL)

    def _outside_of_range(self, name: str, value: Any) -> Iterator[str]:
        key = INPUT_KEYS[name]
        between = self.trade.box[name]
        if name == "strain":
            between = self.trade.strains(self.case)
            key = "load.turns" if self.turns else key
        if isinstance(value, str):
            if value not in between:
                endless = self.case.specimen == "cell"
                key = "load.deformation" if endless and name == "direction" else key
                yield f"{key} is {value!r}, but models were measured with {' and '.join(between)}"
            return
        least, most = between
        if not least <= value * (1 + 1e-9) <= most * (1 + 2e-9):
            fact = f"{key}{OVER.get(name, '')} is {value:.4g}"
            yield f"{fact}, but models were measured from {least:g} to {most:g}"

    def _unlike_sample(self) -> Iterator[str]:
        """Yield the other physical keys that differ from those of the sample."""
        there = replace(self, scene=self.trade.scene(self.case, self.inputs)).others
        for key, value in self.others.items():
            if key in OF_LOOP or key == "load.turns":
                continue
            wanted = there.get(key)
            if wanted is None and value is not None:
                yield f"{key} is set, but models were measured without it"
            elif value != wanted:
                here_is, there_is = f"{lists(value)!r:.60}", f"{lists(wanted)!r:.60}"
                yield f"{key} is {here_is}, but models were measured with {there_is}"
