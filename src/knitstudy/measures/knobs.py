"""Which knobs of a model a scene has turned, and what models are called."""

from __future__ import annotations

from typing import Any

from knitstudy.measures.cases import label_of
from knitstudy.measures.discretisation import is_direct, made_of
from knitstudy.study.scene import Scene

MAIN: dict[str, Any] = {
    "mesh.growth": 1.2,
    "mesh.refinement": 1.0,
    "mesh.span": 0.9,
    "mesh.crossing_span": 0.9,
    "mesh.spline_degree": 3,
    "mesh.crossing_reach": 1.0,
    "mesh.beam_size": 0.5e-3,
    "tie.rule": "patch",
    "contact.cell": 0.25,
    "contact.window": 1.2,
    "contact.points": 3,
    "contact.normal_stiffness": 10,
    "contact.tangential_stiffness": 10,
    "contact.penetration": 0.01,
    "contact.augmentations": 10,
    "solver.increments": 12,
    "solver.residual_tolerance": 1e-6,
    "solver.correction_tolerance": 1e-6,
    "solver.hourglass": 0.005,
    "solver.linear": "auto",
    "beam.stiffness": 10,
}
"""Keys that cost or change an answer, with their values in the main models. What names a model is not among them."""


def model_of(scene: Scene) -> str:
    """Return what a model is called: of a direct simulation what it is made of, else its kind and variant."""
    return made_of(scene) if is_direct(scene) else label_of(scene)


def turned(scene: Scene) -> dict[str, Any]:
    """Return the keys of a scene that are not as in the main models, with their values."""
    found = {key: scene.value(key) for key, main in MAIN.items() if scene.value(key) not in (None, main)}
    if (span := found.get("mesh.crossing_span")) is not None and (scene.mesh.crossing_degree, span) in _SPANS:
        del found["mesh.crossing_span"]
        if found.get("mesh.span") == _SPANS[scene.mesh.crossing_degree, span]:
            del found["mesh.span"]
    return found


_SPANS = {(3, 0.6): 0.9, (4, 0.5): 0.75, (5, 0.4): 0.6}
"""Spans of the legs that go with a degree and its spans at crossings: higher degrees come with shorter ones."""


WORDS = {
    "solver.increments": "increments: {}",
    "mesh.span": "spans of {} R",
    "mesh.crossing_span": "",
    "mesh.spline_degree": "splines of degree {}",
    "mesh.beam_size": "beams of {} m",
    "mesh.refinement": "",
    "solver.residual_tolerance": "tolerances of {}",
    "solver.correction_tolerance": "",
    "solver.linear": "{}",
    "contact.cell": "cells of {} R",
    "contact.window": "windows of {} R",
    "contact.points": "{} x {} points",
    "contact.normal_stiffness": "stiffness {} E / h",
    "contact.tangential_stiffness": "",
}
"""What turned knobs are called; nothing where another one or the model's name says it. Others go by their keys."""


def called(scene: Scene) -> str:
    """Return the model of a scene with the knobs that are turned, in words."""
    found = turned(scene)
    words = (WORDS.get(key, f"{key} {{}}").replace("{}", shown(value)) for key, value in found.items())
    return ", ".join([model_of(scene), *filter(None, words)])


def shown(value: Any) -> str:
    """Return the value of a knob."""
    return f"{value:g}" if isinstance(value, int | float) else str(value)
