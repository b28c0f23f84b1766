"""Fig. 10 on made-up contacts."""

import numpy as np
import pytest
import synthetic

from knitstudy.contacts.contacts import extract
from knitstudy.errors import DataFileError
from knitstudy.figures.fig10_kinematics import QUANTITIES, SIDES, ZONES, draw
from knitstudy.measures.centre_cell import closest_neighbour, rotation_angle


@pytest.fixture(scope="module")
def bare(knit):
    return extract(knit, synthetic.contact_history(knit))


@pytest.fixture(scope="module")
def contacts(bare):
    return synthetic.with_kinematics(bare)


def test_every_crossing_of_the_centre_cell_has_a_line_in_every_panel(contacts):
    panels = draw(contacts=contacts).axes
    assert len(panels) == len(QUANTITIES) * len(SIDES)
    for axes in panels:
        labels = [line.get_label() for line in axes.get_lines()]
        assert set(labels) >= {label for label, _ in ZONES}
        for line in axes.get_lines():
            if line.get_label() in dict(ZONES):
                np.testing.assert_allclose(line.get_xdata(), 100 * contacts["strain"])
    ends = [axes.get_lines()[1].get_ydata()[-1] for axes in panels]
    turned, spun = np.degrees(0.1), np.degrees(0.2)
    np.testing.assert_allclose(ends, [turned, turned, 1.0, 1.0, 100.0, 10.0, spun, spun])
    assert all("(" in axes.get_ylabel() for axes in panels[::2]), "units"


def test_contacts_without_kinematics_say_what_to_run(bare):
    with pytest.raises(DataFileError, match=r"section_rotation is missing.*run the direct simulation anew"):
        draw(contacts=bare)


def test_neighbour_that_comes_closer_at_the_end_is_followed(contacts):
    """One that comes closer on the way only, or that is not there, does not count."""
    contraction = contacts["segment_contraction"].copy(deep=True)
    contraction[:, 0, 0] = [[0.5, 0.1]] * 5 + [[-0.1, 0.2]]
    contraction[:, 1, 1] = [[np.nan, -0.3]] * 6
    closer = closest_neighbour(contacts.assign(segment_contraction=contraction))
    np.testing.assert_allclose(closer[:, 0, 0], [0.1] * 5 + [0.2])
    np.testing.assert_allclose(closer[:, 1, 1], -0.3)


def test_rotation_angle_is_the_length_of_the_vector(contacts):
    share = contacts["strain"].to_numpy()[:, None, None] / 0.05
    np.testing.assert_allclose(rotation_angle(contacts), np.broadcast_to(0.1 * share, (6, 36, 2)))
