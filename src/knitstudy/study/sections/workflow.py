"""What the workflow makes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from knitstudy.study.keys import Section, key, validated


class Workflow(Section):
    """The configuration of the workflow (``config/config.yaml``, ``--config``)."""

    study: Literal["ci", "reduced", "full"] = key(
        "ci, reduced or full", standing="choice", source="which scenes are run", checked="all"
    )

    folder: str = key(
        "the path of a folder with defaults.yaml, scenes and a calibrated loop",
        standing="choice",
        source="where scenes are",
        checked="config",
    )

    plugins: tuple[str, ...] = key(
        "a list of modules to import, which register what is in them",
        standing="choice",
        source="what is added from outside of the package",
        checked="none",
        default=(),
    )


def workflow_configuration(config: Mapping) -> Workflow:
    """Return the validated configuration of the workflow; ConfigurationError where it is not allowed."""
    return validated(Workflow, dict(config), "the workflow's configuration")
