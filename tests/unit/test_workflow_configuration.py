"""The workflow's own keys are checked like those of a scene."""

from typing import get_args

import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.study.configuration import CONFIG, STUDIES, Workflow, workflow_configuration

GIVEN = {"study": "ci", "folder": "config"}


def test_studies_are_those_of_scenes():
    assert get_args(Workflow.model_fields["study"].annotation) == STUDIES


def test_without_plugins_there_are_none():
    assert workflow_configuration(GIVEN).plugins == ()
    assert workflow_configuration(GIVEN | {"plugins": ["toys.law", "element"]}).plugins == (
        "toys.law",
        "element",
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"study": "tiny"}, "study is 'tiny' but must be ci, reduced, full, reference or trade"),
        ({"folder": 3}, "folder is 3 but must be the path of a folder"),
        ({"folder": ""}, "folder is '' but must be the path of a folder"),
        ({"plugins": "toys"}, "plugins is 'toys' but must be a list of the dotted names of modules"),
        (
            {"plugins": ["toys.py/"]},
            "plugins has the entry 'toys.py/' but must be a list of the dotted names",
        ),
        (
            {"folders": "config"},
            "unknown key 'folders' (did you mean 'folder'?); allowed are folder, plugins, study",
        ),
    ],
)
def test_what_is_not_allowed(changes, message):
    with pytest.raises(ConfigurationError) as caught:
        workflow_configuration(GIVEN | changes)
    assert str(caught.value).startswith(f"the workflow's configuration: {message}")


def test_study_must_be_named():
    with pytest.raises(ConfigurationError, match="the key 'study' is missing"):
        workflow_configuration({"folder": "config"})


def test_configuration_of_the_checkout_is_valid():
    from knitstudy.study.configuration import read_yaml

    assert workflow_configuration(read_yaml(CONFIG / "config.yaml")).folder == "config"
