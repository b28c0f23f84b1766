"""The largest part of a grid that repeats itself, found as by trying all parts of small grids."""

import time
from itertools import product

import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.scene.repeat_search import largest_repeat


def parts(whole, least):
    """Return slices that leave out at most half as much as they have on any side."""
    for start, stop in product(range(whole), range(1, whole + 1)):
        extent = stop - start
        if extent >= least and 2 * max(start, whole - stop) <= extent:
            yield slice(start, stop)


def largest_of_all(grid):
    """Return the area of the largest part that repeats itself, by trying all parts and repeats; 0 if there is none."""
    rows, columns = grid.shape
    for widths, fewest in ((range(1, columns // 2 + 1), 2), ((columns,), 1)):
        most = 0
        for high, wide in product(range(1, rows // 2 + 1), widths):
            for up, along in product(parts(rows, 2 * high), parts(columns, fewest * wide)):
                cells = grid[up, along]
                if (cells[high:] == cells[:-high]).all() and (cells[:, wide:] == cells[:, :-wide]).all():
                    most = max(most, cells.size)
        if most:
            return most
    return 0


@pytest.mark.parametrize("seed", range(40))
def test_no_part_that_repeats_itself_is_larger(seed):
    """Tiles with borders, edges and single other stitches."""
    chance = np.random.default_rng(seed)
    rows, columns = chance.integers(2, 9, 2)
    tile = chance.integers(0, 2, chance.integers(1, 4, 2))
    grid = np.tile(tile, (rows, columns))[:rows, :columns]
    grid[: chance.integers(0, 3), :] = 2
    grid[:, : chance.integers(0, 3)] = chance.integers(0, 3)
    grid[chance.integers(rows), chance.integers(columns)] = chance.integers(0, 3)
    found = largest_repeat(grid)
    area = 0
    if found:
        (up, along), (high, wide) = found
        cells = grid[up, along]
        assert (cells[high:] == cells[:-high]).all()
        assert (cells[:, wide:] == cells[:, :-wide]).all()
        area = cells.size
    assert area == largest_of_all(grid)


CHANCE = np.random.default_rng(0)
CROSS = CHANCE.integers(0, 2, (900, 900))
CROSS[300:600] = CROSS[:, 300:600] = 0
SPOTS = np.zeros((600, 300), int)
SPOTS[300, 150] = SPOTS[290, 170] = 1
GRIDS = {
    "plain": (np.zeros((1000, 1000), int), (1, 1)),
    "by chance": (CHANCE.integers(0, 2, (1000, 1000)), None),
    "spots": (SPOTS, None),
    "stripes": (np.arange(30000)[:, None] % 7 * np.ones(40, int), (7, 1)),
}


@pytest.mark.parametrize(("grid", "size"), GRIDS.values(), ids=GRIDS)
def test_large_grids_take_seconds(grid, size):
    begun = time.process_time()
    found = largest_repeat(grid)
    assert time.process_time() - begun < 5
    assert (found and found[1]) == size


def test_a_search_that_would_take_minutes_is_refused():
    with refusal("name the rows of one"):
        largest_repeat(CROSS)
