"""Which crossings are tied."""

import pytest

from knitstudy.knit.contacts.facets import tied_crossings


@pytest.mark.parametrize(("direction", "edge"), [("course", "row"), ("wale", "column")])
def test_edges_along_the_load_are_tied(knit, direction, edge):
    tied = tied_crossings(knit.crossings, True, "outer", direction)
    assert set(getattr(knit.crossings, edge)[tied]) == {0, 2}
    assert set(getattr(knit.crossings, edge)[~tied]) == {1}
