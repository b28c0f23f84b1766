"""Flow of stress along yarns, and the area under pressure, of made-up results by hand."""

import numpy as np
import pytest
import synthetic
import xarray as xr

from knitstudy.knit.contacts.contacts import extract
from knitstudy.measures.centre_cell import pressed_area_of_cell, zones_of_cell
from knitstudy.measures.stress_flow import POINTS, SECTIONS, flows_of

RADIUS = 1e-3


@pytest.fixture(scope="module")
def straight():
    """Two straight yarns of 10 mm along x, which touch halfway, with the segment that ends there."""
    contacts = xr.Dataset(
        {
            "tied": ("crossing", [0]),
            "zones": (("increment", "crossing"), [[0], [1]]),
            "yarn": (("crossing", "side"), [[0, 1]]),
            "arc_length": (("crossing", "side"), [[5e-3, 5e-3]]),
        }
    )
    pieces = xr.Dataset(
        {
            "piece_yarn": ("piece", [0, 1]),
            "piece_arc_length": (("piece", "end"), [[0.0, 10e-3], [0.0, 10e-3]]),
            "piece_segment": ("piece", [0, -1]),
        }
    )
    return pieces, synthetic.history(stations=41), contacts


@pytest.mark.parametrize(("pressed", "sections"), [(0.0, (30.0, 10.0)), (3.0, None)])
def test_stress_leaves_the_yarn_at_contacts(straight, pressed, sections):
    """At 30 degrees within 1.6 radii of the contact, else at 10; a cell that bending presses turns means alone."""
    pieces, history, contacts = straight
    stresses = synthetic.flowing(
        pieces, history, contacts, RADIUS, at_contact=30.0, elsewhere=10.0, pressed=pressed
    )
    flows = flows_of(stresses, history, contacts, RADIUS)
    points = flows[POINTS]
    assert len(points.angle) == 2 * 41, "of the yarn that belongs to a segment"
    assert points.mean_angle(points.at_contact) == pytest.approx(30)
    assert points.mean_angle(points.away) == pytest.approx(10)
    of_sections = flows[SECTIONS]
    assert len(of_sections.angle) == 10, "one for every radius"
    means = [of_sections.mean_angle(here) for here in (of_sections.at_contact, of_sections.away)]
    if sections:
        assert means == pytest.approx(sections)
        assert of_sections.share_within(20.0) == pytest.approx((10 - 4) / 10, abs=0.11)
    else:
        assert min(means) > 45, "the largest mean stress lies across the yarn"


def test_no_contact_is_near_where_the_crossing_is_tied(straight):
    pieces, history, contacts = straight
    tied = contacts.assign(tied=("crossing", [1]))
    stresses = synthetic.flowing(pieces, history, contacts, RADIUS)
    for flow in flows_of(stresses, history, tied, RADIUS).values():
        assert not flow.at_contact.any()
        assert flow.away.any()


def test_area_under_pressure_is_the_mean_of_both_sides(knit):
    """Each crossing that touches has two points of 1e-8 m2 on either side."""
    history = synthetic.contact_history(knit)
    contacts = extract(knit, history)
    np.testing.assert_allclose(pressed_area_of_cell(history, contacts), 2e-8 * zones_of_cell(contacts))
