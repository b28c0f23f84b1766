"""Deformed knits: tubes about centrelines, colours, copies of cells, and a page that holds them."""

import base64
import json
import re
import zlib
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.knit.geometry.fabric_file import fabric_dataset
from knitstudy.knit.geometry.lay_out import initial_loop
from knitstudy.knit.geometry.specimens import endless_cell, plain_knit
from knitstudy.use import deformed
from knitstudy.use.solids import AROUND

SCENE = SimpleNamespace(name="made-up", yarn=SimpleNamespace(radius=0.4e-3))  # not that of the drawn fabric


@pytest.fixture(scope="module")
def knit_of_two(plain_scene):
    return plain_knit(initial_loop(plain_scene), 1, 1)


def history_of(fabric, lift=1e-4, strain=(0.0, 0.05)):
    """Return a history in which all yarns rise by `lift` [m] and stretch along x."""
    stations = [np.linspace(0, curve.length, 40) for curve in fabric.centrelines]
    place = np.concatenate([curve.position(s) for curve, s in zip(fabric.centrelines, stations, strict=True)])
    yarn = np.repeat(np.arange(len(stations)), 40)
    moved = np.stack([np.outer(place[:, 0], [e, 0, 0]) for e in strain])
    moved[..., 2] += lift * np.arange(len(strain))[:, None]
    crossings = len(fabric.crossings.yarn)
    return xr.Dataset(
        {
            "strain": ("increment", np.array(strain)),
            "yarn": ("station", yarn),
            "arc_length": ("station", np.concatenate(stations)),
            "centreline": (("station", "xyz"), place),
            "centreline_displacement": (("increment", "station", "xyz"), moved),
            "crossing_slip": (("increment", "crossing"), np.outer(strain, np.arange(crossings) + 1.0)),
        }
    )


def test_corners_lie_on_the_surface_of_the_deformed_yarns(knit_of_two):
    history = history_of(knit_of_two)
    knit = deformed.deformed(SCENE, fabric_dataset(knit_of_two), history)
    centres = (history["centreline"] + history["centreline_displacement"][-1]).to_numpy()
    apart = np.linalg.norm(knit.points[-1][:, None] - centres[None], axis=-1).min(axis=1)
    assert apart.max() == pytest.approx(SCENE.yarn.radius, rel=1e-6)
    assert knit.values[-1] == pytest.approx(0.1), "mm"
    assert knit.strain.tolist() == [0.0, 0.05]


def test_colours_count_from_the_shape_in_which_a_path_begins(knit_of_two):
    """Soft yarns rise from the loops as drawn before they are pulled."""
    history = history_of(knit_of_two)
    at_rest = history["centreline_displacement"] + [0.0, 0.0, 3e-4]
    knit = deformed.deformed(
        SCENE, fabric_dataset(knit_of_two), history.assign(centreline_displacement=at_rest)
    )
    assert knit.values[0] == pytest.approx(0.0, abs=1e-12)
    assert knit.values[-1] == pytest.approx(0.1), "mm"


@pytest.mark.parametrize(("most", "length"), [(7.0, 5.0), (4.9, 2.0), (19.0, 10.0), (0.21, 0.2)])
def test_bars_of_scale_have_round_lengths(most, length):
    assert deformed._round_length(most) == pytest.approx(length)


def test_a_crossing_colours_both_yarns_near_it_alone(knit_of_two):
    values, label = deformed._of_stations(knit_of_two, history := history_of(knit_of_two), "slip")
    assert label == "slip at crossings (mm)"
    s, yarn = history["arc_length"].to_numpy(), history["yarn"].to_numpy()
    for crossing, (yarns, places) in enumerate(
        zip(knit_of_two.crossings.yarn, knit_of_two.crossings.arc_length, strict=True)
    ):
        for own, place in zip(yarns, places, strict=True):
            near = (yarn == own) & (np.abs(s - place) <= knit_of_two.radius)
            assert (values[-1, near] >= 1e3 * 0.05 * (crossing + 1)).all()
    away = np.array(
        [
            min(
                abs(a - s[k])
                for n, a in zip(
                    knit_of_two.crossings.yarn.ravel(), knit_of_two.crossings.arc_length.ravel(), strict=True
                )
                if n == yarn[k]
            )
            for k in range(len(s))
        ]
    )
    assert (values[-1, away > 2 * knit_of_two.radius] == 0).all()


@pytest.mark.parametrize("at_rest", [1.0, 0.6])
def test_a_cell_is_drawn_three_times_in_both_directions(plain_scene, at_rest):
    """Yarns go on along the courses; rows stand as far apart as where the path began, which may be a shape at rest."""
    cell = endless_cell(initial_loop(plain_scene), 1, 1)
    history = history_of(cell)
    history["cell_strain"] = (("increment", "plane"), [[0, 0, 0], [0.05, -0.02, 0.1]])
    history.attrs["cell_height"] = apart = at_rest * cell.height
    knit = deformed.deformed(SCENE, fabric_dataset(cell), history)
    rows = knit.points[-1].reshape(3, -1, 3)
    wale = apart * np.array([0.05, 0.98, 0])
    assert rows[1] - rows[0] == pytest.approx(np.broadcast_to(wale, rows[0].shape), abs=1e-9)
    one = (history["centreline"] + history["centreline_displacement"][-1]).to_numpy()
    course = cell.periods[0] * [1.05, 1, 1]
    copies = np.concatenate([one + number * course for number in range(3)])
    ends = np.linalg.norm(rows[0][:, None] - copies, axis=-1).min(axis=1) < 1e-9  # middles of caps
    assert ends.sum() == 2 * AROUND * len(cell.centrelines), "a yarn has two ends"


@pytest.mark.parametrize(
    ("colour", "message"),
    [
        ("red", "must be one of u_z, slip, force, stress, pressure"),
        ("force", "holds only u_z, slip"),
        ("stress", r"--set outputs=\[fields\]"),
    ],
)
def test_a_colour_that_the_history_lacks_is_refused(knit_of_two, colour, message):
    with pytest.raises(ConfigurationError, match=message):
        deformed.deformed(SCENE, fabric_dataset(knit_of_two), history_of(knit_of_two), colour=colour)


def test_a_page_holds_the_knit_and_loads_nothing(knit_of_two, tmp_path, monkeypatch):
    knit = deformed.deformed(SCENE, fabric_dataset(knit_of_two), history_of(knit_of_two))
    deformed.write_page(knit, tmp_path / "knit.html", "a <knit>")
    page = (tmp_path / "knit.html").read_text()
    data = json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.DOTALL)[1])
    raw = np.frombuffer(zlib.decompress(base64.b64decode(data["places"])), "<u2").reshape(2, -1, 3)
    low, reach = 1e3 * knit.points.min(axis=(0, 1)), 1e3 * np.ptp(knit.points, axis=(0, 1)).max()
    assert low + reach * raw / 65535 == pytest.approx(1e3 * knit.points, abs=reach / 65535)
    assert data["title"] == "a <knit>"
    assert not re.search(r'(?:src|href)="', page)
    monkeypatch.setattr(deformed, "MOST", knit.points.shape[1])
    deformed.write_page(knit, tmp_path / "last.html", "a")
    assert '"strain": [0.05]' in (tmp_path / "last.html").read_text(), (
        "full load alone, where there is no room"
    )


def test_increments_of_an_animation_are_spread_evenly():
    assert deformed._spread(3, 24).tolist() == [0, 1, 2]
    assert deformed._spread(50, 5).tolist() == [0, 12, 24, 37, 49]
