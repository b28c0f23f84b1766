"""What the workflow makes, and from which files: the keys of ``config/config.yaml``."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from knitstudy.study.keys import Section, key, validated


class Workflow(Section):
    """The study of scenes that is made, the folder that they stand in, and modules of kinds from outside."""

    study: Literal["ci", "reduced", "full", "reference", "trade"] = key(
        "ci, reduced, full, reference or trade",
        standing="choice",
        source="which scenes are run; no result depends on it",
        checked="all",
    )

    folder: Annotated[str, Field(min_length=1)] = key(
        "the path of a folder with defaults.yaml, families of scenes and a calibrated loop",
        standing="choice",
        source="where files are",
        checked="config, and folders of tests",
    )

    plugins: tuple[Annotated[str, Field(pattern=r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)*$")], ...] = key(
        "a list of the dotted names of modules, for example [my_elements], that register kinds of their own",
        standing="choice",
        source="what the study is extended by",
        checked="toy kinds of the tests",
        default=(),
    )


def workflow_configuration(config: Any) -> Workflow:
    """Return the checked configuration of the workflow.

    Parameters
    ----------
    config : mapping
        ``config/config.yaml``, with what the command line says laid over it.

    Raises
    ------
    ConfigurationError
        Naming the key, its value and what is allowed.
    """
    return validated(Workflow, config, "the workflow's configuration")
