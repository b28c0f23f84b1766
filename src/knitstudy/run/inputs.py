"""What an answer changes with: each input of a fabric a little larger, in a cell of the endless fabric of its own.

The error that is promised is one of a model, for given values. Whoever does not know these values better than to some
per cent does not know the answer better than what they change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import log, nan, pi
from re import sub

from knitstudy.errors import KnitstudyError
from knitstudy.knit.scene.alternatives import OF_BEAMS, Value, known_yarns, read_yarn
from knitstudy.knit.scene.scene import Scene
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.simulations import simulate

STEP = 0.02  # share by which an input is larger: loops for 10 % more often do not fit
SHARE = 0.1  # of an input, of which the effect is told
SHOWN = 2  # inputs that are told
INCREMENTS = 10  # of a cell: the force at the end is within 0.1 % of that in 200

SPACINGS = ("pattern.course_spacing", "pattern.wale_spacing")
INPUTS = ("yarn.diameter", "pattern.loop_length", *SPACINGS, *(f"yarn.{name}" for name in OF_BEAMS))
FRICTION = "contact.friction"


@dataclass(frozen=True)
class Effect:
    """What an answer changes with an input."""

    key: str
    exponent: float  # of the answer as a power of the input

    @property
    def share(self) -> float:
        """Change of the answer, of itself, where the input is larger by `SHARE`."""
        return float((1 + SHARE) ** self.exponent - 1)

    def __str__(self) -> str:
        return f"{self.key} {100 * self.share:+.2g} %"


def compared_with_library(scene: Scene) -> str:
    """Return the bending stiffness of a scene's solid yarn, and of the library's yarn of the nearest diameter."""
    yarn = scene.yarn
    solid = yarn.youngs_modulus * pi * yarn.diameter**4 / 64

    def apart(values: Mapping[str, Value]) -> float:
        return abs(log(float(values["diameter"].value or nan) / yarn.diameter))

    library = {name: read_yarn(name).values for name in known_yarns()}
    name = min(library, key=lambda name: apart(library[name]))
    diameter = library[name]["diameter"].ends[0]
    bending = 1e6 * library[name]["bending"].ends
    within = f" ({bending[2]:.2g} to {bending[1]:.2g})" if bending[2] < bending[1] else ""
    return (
        f"the yarn is taken as a solid: it bends with {1e6 * solid:.2g} N mm2; {name}, {1e3 * diameter:.2g} mm thick, "
        f"with {bending[0]:.2g}{within}. Of a spun, multifilament or textured yarn give yarn.of or yarn.bending, and "
        "`knitstudy run`"
    )


def inputs_of(scene: Scene) -> list[str]:
    """Return the inputs of a scene that have a value; spacings where the fabric starts from loops drawn for them."""
    keys = [key for key in (*INPUTS, FRICTION) if (scene.value(key) or 0) > 0]
    drawn = (scene.value("load.start") or "drawn") == "drawn" and scene.value(
        "pattern.control_points"
    ) is None
    return [key for key in keys if drawn or key not in SPACINGS]


@dataclass(frozen=True)
class Changed:
    """An answer for a changed input; 1 and nan where there is no such fabric."""

    key: str
    factor: float = 1.0
    answer: float = nan

    def effect(self, base: float) -> Effect | None:
        """Return the effect on an answer that is `base` without the change; None where either is not known."""
        if not (self.answer > 0 and base > 0):
            return None
        return Effect(self.key, log(self.answer / base) / log(self.factor))


def changed(scene: Scene, key: str, answer: Callable[[Scene], float]) -> Changed:
    """Return the answer for a scene with a larger input, or with a smaller one where that fails."""
    name = f"{scene.name}-with-{sub('[^a-z]+', '-', key)}"
    for factor in (1 + STEP, 1 / (1 + STEP)):
        values = {"name": name, "knit": name, key: factor * float(scene.value(key))}
        with suppress(KnitstudyError):
            return Changed(key, factor, answer(scene.vary(values)))
    return Changed(key)


def largest(effects: Iterable[Effect | None]) -> list[Effect]:
    """Return the effects that matter most, the largest first."""
    known = [effect for effect in effects if effect is not None]
    return sorted(known, key=lambda effect: -abs(effect.exponent))[:SHOWN]


def effects_on_force(problem: PhysicalProblem) -> list[Effect]:
    """Return the inputs that the force of a problem changes most with, of an endless cell by a cheap model.

    Nothing where no such cell is found.
    """
    cell = problem.endless() if problem.scene.is_knit else problem
    keys = cell.settings.get("beams") or cell.settings.get("yarns-coarse")
    if keys is None:
        return []
    turns = cell.scene.value("load.turns") or (cell.scene.value("load.strain"),)
    scene = cell.scene.vary({**keys, "load.strain": turns[0], "solver.increments": INCREMENTS})
    if scene.value("load.turns"):
        scene = scene.vary({"load.turns": []})

    def force(scene: Scene) -> float:
        history = simulate(scene).history
        return abs(float(history["force_per_width"][-1, int(history.attrs["axis"])]))

    try:
        base = force(scene)
    except KnitstudyError:
        return []
    return largest(changed(scene, key, force).effect(base) for key in inputs_of(scene))
