"""Contact zones: groups of surface facets that touch and hang together."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1))
"""Half of the eight cells around a cell (along, around); the other half are those that have it as neighbour."""


def count_zones(place: np.ndarray, cell: np.ndarray, around: int, places: int) -> np.ndarray:
    """Return the number of zones (places,) at every place.

    Facets whose edges or corners meet belong to one zone. Those of different places never do.

    Parameters
    ----------
    place : ndarray of int, shape (p,)
        From 0 to ``places`` - 1: what is counted apart, such as the sides of crossings at increments.
    cell : ndarray of int, shape (p, 2)
        Layer along the yarn and facet around it of every touching point; one facet may be there several times.
    around : int
        Facets around a yarn: the last one is followed by the first.
    places : int
        Number of places.
    """
    if not len(place):
        return np.zeros(places, dtype=np.int64)
    layers = (
        int(cell[:, 0].max()) + 2
    )  # a layer beyond the last one keeps neighbours from running into the next place

    def number(place: np.ndarray, layer: np.ndarray, facet: np.ndarray) -> np.ndarray:
        return (place * layers + layer) * around + facet % around

    facets, index = np.unique(number(place, *cell.T), return_index=True)
    place, (layer, facet) = place[index], cell[index].T
    edges = []
    for step, turn in NEIGHBOURS:
        neighbour = number(place, layer + step, facet + turn)
        found = np.minimum(np.searchsorted(facets, neighbour), len(facets) - 1)
        touching = np.flatnonzero(facets[found] == neighbour)
        edges.append(np.stack([touching, found[touching]]))
    start, end = np.concatenate(edges, axis=1)
    graph = coo_array((np.ones(len(start), dtype=bool), (start, end)), shape=(len(facets), len(facets)))
    _, zone = connected_components(graph, directed=False)
    # A zone counts where its first facet is.
    return np.bincount(place[np.unique(zone, return_index=True)[1]], minlength=places)
