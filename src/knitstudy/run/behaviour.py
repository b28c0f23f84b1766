"""What the present physics does, as recorded: a digest of numbers where a digest of code would change with every edit.

``resources/histories.csv`` has the numbers of small scenes, some of every group; ``tests/regression`` fails where the
code gives others, so that a change of numbers is recorded with the code that makes it. A committed table is as good as
new as long as the recorded numbers of its groups stay.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Collection, Mapping
from functools import cache

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.knit.scene.scene import Scene, digest
from knitstudy.registry import unknown_choice

HISTORIES = RESOURCES / "histories.csv"

DIGITS = 5
"""Digits of a recorded number that count: a change below them is within what solvers leave open."""

OF_SOLVERS = ("correction", "residual", "newton_iterations", "krylov_iterations", "augmentations")
"""Quantities of a history that say how it was solved, and do not count."""

GEOMETRY = "geometry"
"""The group of drawn loops, before any simulation."""


def group_of(scene: Scene) -> str:
    """Return the group of a scene: what is knitted, its model, and whether yarns touch."""
    return group(scene.specimen, scene.fidelity, scene.kind.interaction.touches)


def group(specimen: str, fidelity: str, touches: bool) -> str:
    """Return the name of a group; knits are one specimen, however they end."""
    return f"{specimen.removeprefix('cut_')} {fidelity} {'touching' if touches else 'tied'}"


ENDLESS_BEAMS = group("cell", "beam", True)
OF_BEAMS = group("knit", "beam", True)


def groups() -> tuple[str, ...]:
    """Return the groups that have recorded numbers."""
    return tuple(_recorded())


def behaviour(of: Collection[str]) -> str:
    """Return the digest of the recorded numbers of some groups.

    Raises ConfigurationError where a group has none.
    """
    recorded = _recorded()
    for group in of:
        if group not in recorded:
            raise ConfigurationError(
                unknown_choice("no recorded scene is of the group", group, group, list(recorded))
            )
    return digest({group: recorded[group] for group in sorted(of)})


@cache
def _recorded() -> Mapping[str, list[list[str]]]:
    """Return the recorded numbers of every group, rounded: scene, quantity, norm, and the sum over the norm."""
    found: dict[str, list[list[str]]] = defaultdict(list)
    with HISTORIES.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["quantity"] not in OF_SOLVERS:
                norm = float(row["norm"])
                share = float(row["sum"]) / norm if norm else 0.0
                numbers = f"{norm:.{DIGITS - 1}e}", f"{share:.{DIGITS}f}"
                found[row["group"]].append([row["scene"], row["quantity"], *numbers])
    return found
