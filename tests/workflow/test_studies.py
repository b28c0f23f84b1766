"""Everything that a study of the configuration shows can be planned."""

import pytest

from knitstudy.figures.catalogue import FIGURES
from knitstudy.stages.displays import Displays, reference_files
from knitstudy.stages.plan import Plan
from knitstudy.study.configuration import CONFIG, STUDIES, load_study
from knitstudy.tables.catalogue import TABLES


@pytest.fixture(scope="module")
def plan():
    return Plan.of(CONFIG)


@pytest.mark.parametrize("study", STUDIES)
def test_what_is_offered_has_all_that_it_is_made_from(plan, study):
    """Direct simulations without fields have no stress: pictures of it are not offered, instead of ending the study."""
    scenes = [plan.scenes[name] for name in load_study(study, CONFIG)]
    for catalogue in (FIGURES, TABLES):
        displays = Displays(catalogue, plan, scenes, reference_files(CONFIG))
        assert displays.names()
        for name in displays.names():
            assert displays.digest(name)
