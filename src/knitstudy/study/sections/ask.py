"""What a scene asks for whose fidelity is ``auto``: a model is chosen for that (docs/trade.md)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from knitstudy.study.keys import Section, key, validated

AUTO = "auto"
"""The fidelity of a scene that leaves the model open."""


class Ask(Section):
    """What is asked of a scene whose fidelity is `auto`, how surely, and at which price at most.

    It is resolved where scenes are read: what is simulated is an ordinary scene of the cheapest model that will do.
    """

    question: Literal["force", "out_of_plane", "contact", "stress"] = key(
        "force, out_of_plane (motion), contact (force and slip) or stress (normal, at a contact)",
        standing="choice",
        source="what the model is chosen for; tables/trade.csv has the errors of all models by question",
        checked="all four",
    )

    accuracy: float = key(
        "a number > 0 and <= 10, the relative error that may be made",
        standing="choice",
        source="a model is taken whose error is at most this where it is measured",
        checked="0.02 to 0.2, on knits with other spacings and diameters (docs/trade.md)",
        gt=0,
        le=10,
    )

    seconds: float | None = key(
        "a number > 0 of seconds, or null",
        unit="s",
        standing="choice",
        source="what the simulation may take, with those that it is made from",
        checked="prices are those of one core of the machine that made resources/trade.csv",
        default=None,
        gt=0,
    )

    memory: float | None = key(
        "a number > 0 of megabytes, or null",
        unit="MB",
        standing="choice",
        source="by how much the memory of the process may grow",
        checked="as ask.seconds",
        default=None,
        gt=0,
    )

    among: tuple[Annotated[str, Field(min_length=1)], ...] = key(
        "a list of fidelities to choose from, for example [rom3d, solid_yarns]; [] for all",
        standing="choice",
        source="narrows what is taken",
        checked="single ones",
        default=(),
    )


def asked(values: Any, where: str) -> Ask:
    """Return what a scene asks for.

    Raises
    ------
    ConfigurationError
        Naming the key, its value and what is allowed.
    """
    return validated(Ask, values, where, "ask.")
