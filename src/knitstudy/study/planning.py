"""From a scene that leaves its model open to an ordinary one: fidelity ``auto`` resolved where scenes are read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.study.choice import AUTO, Ask, Choice, asked, choose, resolved, second
from knitstudy.study.kinds import role_of
from knitstudy.study.scene import Scene, set_dotted

ANY = "spline_yarns"
"""A fidelity that models all knits: what a problem is read with before its model is known."""


@dataclass(frozen=True)
class Planned:
    """A scene with the model that was chosen for it."""

    scene: Scene
    choice: Choice
    problem: Scene  # what is simulated, by any model


def is_open(keys: Mapping[str, Any]) -> bool:
    """Whether keys of a scene, by dotted name, leave its model open."""
    return keys.get("fidelity") == AUTO


def of_model(key: str) -> bool:
    """Whether a key says by which model a scene is computed, and how, and not what it is of."""
    return key == "outputs" or ("." in key and role_of(key) in ("resolution", "numerics"))


def problem_and_ask(name: str, keys: Mapping[str, Any], where: str, defaults: Mapping) -> tuple[Scene, Ask]:
    """Return what is to be simulated, by any model, and what is asked of it.

    The scene sets `keys`, by dotted name, over `defaults`; `where` begins messages.
    Raises ConfigurationError where the scene sets keys of a model, or asks for nothing or nonsense.
    """
    own: dict[str, Any] = {}
    for key, value in keys.items():
        if of_model(key) and key != "outputs":
            of = f"where fidelity is {AUTO}: it comes with the model that is chosen"
            raise ConfigurationError(f"{where}: {key} is {value!r} but must be left out {of}")
        if key != "fidelity" and not key.startswith("ask."):
            set_dotted(own, key, value, where)
    wish = {key.partition(".")[2]: value for key, value in keys.items() if key.startswith("ask.")}
    ask = asked(wish, where)
    return Scene.from_dict({"name": name, "fidelity": ANY} | own, where, defaults), ask


def planned(problem: Scene, ask: Ask, templates: Mapping[str, Scene], where: str) -> Planned:
    """Return a scene with the model that is chosen for it; see `knitstudy.study.choice.choose`."""
    return _made(problem, choose(problem, ask, templates, where), templates)


def compared(found: Planned, templates: Mapping[str, Scene]) -> Planned | None:
    """Return a scene by the model that its result can be compared with, if there is one (`study.choice.second`)."""
    rung = second(found.choice)
    if rung is None:
        return None
    return _made(found.problem.vary({"outputs": []}), replace(found.choice, rung=rung), templates)


def _made(problem: Scene, choice: Choice, templates: Mapping[str, Scene]) -> Planned:
    """Return a scene by the model of a choice."""
    return Planned(problem.vary(resolved(choice, templates)), choice, problem)
