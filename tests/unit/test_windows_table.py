"""Windows beside the same knits in full: which belong together, how far apart they are, and the table of both."""

import numpy as np
import pytest
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.measures.windows import distance, in_full, windows
from knitstudy.tables.models import tabulate_windows


@pytest.fixture(scope="module")
def scenes(plain_scene):
    full = plain_scene.vary({"name": "full", "fidelity": "spline_yarns"})
    window = plain_scene.vary({"name": "window", "fidelity": "window"})
    return [
        plain_scene.vary({"name": "hexahedra", "fidelity": "hexahedra"}),
        full.vary({"name": "finer", "mesh.crossing_degree": 3}),
        full.vary({"name": "shorter", "load.strain": 0.01}),
        full,
        window,
        window.vary({"name": "rough", "interaction": "rough"}),
    ]


def contacts(columns, force, pressure):
    """Contacts of one row, with as many crossings as there are columns."""
    names = {
        name: ("crossing", values) for name, values in zip(("row", "column", "zone"), columns, strict=True)
    }
    at_full_load = {
        "force": (("increment", "crossing", "xyz"), np.asarray(force, dtype=float)[None]),
        "largest_pressure": (("increment", "crossing"), np.asarray(pressure, dtype=float)[None]),
    }
    return xr.Dataset(names | at_full_load)


FULL = contacts(([1, 1, 1], [0, 1, 1], [0, 0, 1]), [[9, 9, 9], [3, 0, 4], [0, 2, 0]], [7, 10, 20])
SHOWN = contacts(([1, 1], [1, 1], [1, 0]), [[0, 2.1, 0], [3, 0, 4]], [19, 10])


def test_a_window_is_held_against_the_same_yarns_under_the_same_load(scenes):
    assert in_full(scenes[4], scenes).name == "full"
    assert [scene.name for scene in windows(scenes)] == ["full", "window"]


def test_crossings_are_found_by_row_column_and_zone():
    apart = distance(SHOWN, FULL)
    assert (apart.force, apart.pressure) == (pytest.approx(0.05), pytest.approx(0.05))
    with pytest.raises(DataFileError, match="no crossing of row 1, column 1, zone 1"):
        distance(SHOWN, FULL.isel(crossing=slice(2)))


def test_ties_have_no_pressure():
    assert np.isnan(distance(SHOWN, FULL.assign(largest_pressure=FULL["largest_pressure"] * np.nan)).pressure)


def test_a_row_for_every_window(scenes):
    def history(force, seconds, unknowns):
        values = {"force": ("increment", [0.0, force]), "seam_jump": ("increment", [0.0, 1e-9])}
        return xr.Dataset(values, attrs={"unknowns": unknowns, "wall_seconds": seconds})

    table = tabulate_windows(
        {"full": history(10.0, 200.0, 4000), "window": history(9.9, 10.0, 1000)},
        {"full": FULL},
        {"window": SHOWN},
        {scene.name: scene for scene in scenes},
    )
    assert table["scene"].tolist() == ["window"]
    row = table.iloc[0]
    assert row["in full"] == "full"
    assert row["force over that in full [1]"] == pytest.approx(0.99)
    assert row["time in full over this [1]"] == pytest.approx(20)
    assert row["unknowns in full over these [1]"] == pytest.approx(4)
