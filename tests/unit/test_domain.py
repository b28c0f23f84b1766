"""Square knits of rising size: what belongs together, how cost grows, and what the tables say of it."""

import numpy as np
import pytest
import study

from knitstudy.figures.fig12_size_and_beams import series_line
from knitstudy.measures.domain import PowerLaw, SumOfPowers, contact_over_ties, force_per_width, series_of
from knitstudy.study.configuration import load_scenes, load_study
from knitstudy.study.scene import LABELS
from knitstudy.tables import catalogue as tables

SIX = "domain-hexahedra-tie-course-6x6"


@pytest.fixture(scope="module")
def grown(plain_scene):
    return study.domain(plain_scene)


def test_laws_are_found_again():
    cells = np.array([3.0, 6.0, 8.0, 30.0])
    law = PowerLaw.through(cells, 5.0 * cells**2.1)
    assert (law.factor, law.exponent) == (pytest.approx(5.0), pytest.approx(2.1))
    assert law.at(10.0) == pytest.approx(5.0 * 10**2.1)
    law = SumOfPowers.through(cells, 5.0 * cells**2 + 2.0 * cells, (2, 1))
    np.testing.assert_allclose(law.factors, [5.0, 2.0])
    assert law.at(10.0) == pytest.approx(520.0)


def all_but_size(scene):
    document = {name: keys for name, keys in scene.to_dict().items() if name not in LABELS}
    of_size = {"pattern": ("loops", "rows"), "rom": ("contacts_from",)}
    for section, keys in of_size.items():
        document[section] = {
            key: value for key, value in document.get(section, {}).items() if key not in keys
        }
    return document


def test_series_of_the_study_differ_in_nothing_but_size_and_look_different():
    scenes = load_scenes()
    series = series_of(scenes[name] for name in load_study("full"))
    assert len(series) == 10
    for each in series:
        first, *others = map(all_but_size, each.scenes)
        assert all(other == first for other in others), each.stem
    lines = [series_line(each) for each in series if each.scenes[0].load.direction == "course"]
    for what in (["label"], ["color", "linestyle", "marker"]):
        assert len({tuple(line[key] for key in what) for line in lines}) == len(lines), what


def test_contact_over_ties_is_of_equal_sizes(grown):
    scenes, histories = grown
    (factors,) = contact_over_ties(series_of(scenes.values()), histories, "dof").values()
    assert list(factors) == [3, 6, 8]
    np.testing.assert_allclose(list(factors.values()), 311_913 / 189_513, rtol=1e-5)


def test_force_is_over_the_width_that_is_pulled(grown):
    scene, history = grown[0][SIX], grown[1][SIX]
    assert force_per_width(history, scene) == pytest.approx(10.0 / (6 * scene.pattern.course_spacing))
    wale = scene.replace("load.direction", "wale")
    assert force_per_width(history, wale) == pytest.approx(10.0 / (6 * scene.pattern.wale_spacing))


def test_response_is_compared_with_the_largest_knit(grown):
    scenes, histories = grown
    table = tables.tabulate("domain_response", domain=histories, domain_contacts={}, scenes=scenes)
    tied = table[table["interaction"] == "tie constraint"]
    np.testing.assert_allclose(tied["the same, over that of the largest knit [1]"], [8 / 3, 8 / 6, 1])
    assert tied["mean normal force in the centre cell [N]"].isna().all()
