"""Yarns as files, and the law of pressing between plates and at a crossing."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from pressing import HALF, crossing_over_plates, power_law
from scipy.integrate import quad

from knitstudy.errors import ConfigurationError
from knitstudy.loading.history import DIRECTIONS
from knitstudy.measures.fabrics import FORCES, SHARE, errors, measured, predict
from knitstudy.study.configuration import load_scene
from knitstudy.study.documents import RESOURCES
from knitstudy.study.yarns import KEYS, known_yarns, read_yarn
from knitstudy.tables.fabrics import tabulate_predictions

YARNS = sorted(known_yarns())


@pytest.fixture(scope="module")
def knit():
    return load_scene("beam-isotropic-course")


@pytest.mark.parametrize("name", YARNS)
def test_every_value_says_where_it_comes_from_and_lies_in_its_interval(name):
    yarn = read_yarn(name)
    assert set(yarn.values) == set(KEYS)
    for value in (*yarn.values.values(), *yarn.loop_lengths):
        assert value.interval is None or value.interval[0] <= value.value <= value.interval[1]


@pytest.mark.parametrize("name", YARNS)
def test_a_scene_takes_the_values_of_its_yarn_and_its_own_count_more(name, knit):
    values = {part: value.value for part, value in read_yarn(name).values.items()}
    scene = knit.vary({"yarn.of": name, "contact.friction": 0.7})
    assert scene.yarn.diameter == values["diameter"]
    assert scene.contact.friction == 0.7
    again = scene.vary({"yarn.of": name, "interaction": "rough"})
    assert again.yarn == scene.yarn


def test_a_yarn_of_which_a_model_knows_a_part_is_refused():
    with pytest.raises(ConfigurationError, match="which scenes of fidelity spline_yarns do not have; take"):
        load_scene("cell-course-isotropic").vary({"yarn.of": "acrylic"})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"diameter": "{value: 1e-3, unit: mm, standing: measured, source: a scale}"}, "must be 'm'"),
        (
            {"diametre": "{value: 1e-3, unit: m, standing: measured, source: a scale}"},
            "did you mean 'diameter'",
        ),
        ({"diameter": "{value: 1e-3, unit: m, standing: guessed, source: a scale}"}, "diameter.standing"),
        ({"diameter": "{value: 1e-3, unit: m, standing: measured}"}, "diameter.source. is missing"),
        ({"friction": "{value: null, unit: '1', standing: assumed, source: none}"}, "must be null where"),
    ],
)
def test_a_file_that_says_too_little_is_refused(tmp_path, knit, change, message):
    path = tmp_path / "wool.yaml"
    path.write_text("name: wool\nvalues:\n" + "".join(f"  {key}: {value}\n" for key, value in change.items()))
    with pytest.raises(ConfigurationError, match=message):
        knit.vary({"yarn.of": str(path)})


def test_an_unknown_yarn_is_named(knit):
    with pytest.raises(ConfigurationError, match=r"unknown yarn 'acrilic' .did you mean 'acrylic'"):
        knit.vary({"yarn.of": "acrilic"})


@pytest.mark.parametrize("m", [0.5, 1.0, 2.4])
def test_yarns_that_cross_carry_the_integral_of_the_pressure_of_their_layers(m):
    approach, radius = 0.1, 0.5  # over the diameter, 1
    half = np.sqrt(radius * approach)  # of the width between plates
    per_length = 2 * quad(lambda x: (approach / 2 - x**2 / (2 * radius)) ** m, 0, half)[0]
    r = np.sqrt(2 * radius * approach)  # of the round patch
    force = quad(lambda s: 2 * np.pi * s * max(approach / 2 - s**2 / (4 * radius), 0) ** m, 0, r)[0]
    assert force / per_length == pytest.approx(crossing_over_plates(m + HALF) * approach**HALF, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "plates"), [("acrylic", (2.41, 2.53, 2.61)), ("cotton", (1.95, 2.02, 2.10, 2.07))]
)
def test_pieces_between_plates_have_the_exponents_that_the_yarn_has_less_a_half(name, plates):
    table = pd.read_csv(RESOURCES / "measured" / "yarn_pressing.csv").query("yarn == @name")
    laws = [
        power_law(each.pressed_mm / each.diameter_mm, each.force_mN / 1e3)
        for _, each in table.groupby("sample")
    ]
    found = [n[0] for _, n, _ in laws]
    assert np.allclose(found, plates, atol=0.005)
    value = read_yarn(name).values["pressing_exponent"]
    assert min(found) - 0.05 <= value.value - HALF <= max(found) + 0.05
    # One power is off by a fifth of the force or more: both ends of the curve are not one law.
    assert all(scatter > 0.2 for _, _, scatter in laws)


def cell_of(slope, strain=0.5):
    """History of a cell whose course strain is force (N/mm) times a slope."""
    force = np.linspace(0, 1e3 * strain / slope, 11)
    zero = np.zeros_like(force)
    return xr.Dataset(
        {
            "force_per_width": (("increment", "form"), np.stack([force, zero, zero], axis=1)),
            "cell_strain": (("increment", "form"), np.stack([force / 1e3 * slope, zero, zero], axis=1)),
        }
    )


def test_a_strip_between_clamps_lies_between_the_cells_and_says_nothing_beyond_them():
    strip = predict(cell_of(2.0), cell_of(1.0), "course")
    share, off = SHARE["course"]
    assert strip.strain[:5] == pytest.approx((1 + share) * np.array(FORCES[:5]))
    assert strip.clamps[:5] == pytest.approx(off * np.array(FORCES[:5]))
    assert np.isnan(strip.strain[-1])  # 0.3 N/mm is beyond the free cell's 0.25


def test_predictions_of_a_yarn_have_the_scatter_of_its_stockinette():
    names = [
        f"fabric-cotton-{s}-{d}-{o}"
        for s in ("stockinette", "rib")
        for d in DIRECTIONS
        for o in ("free", "held")
    ]
    slope = {"free": 2.4, "held": 1.2}
    histories = {name: both_ways(cell_of(slope[name.split("-")[-1]], 1.0)) for name in names}
    table = tabulate_predictions(histories)
    assert list(table.columns) == [
        "yarn",
        "stitch",
        "direction",
        "force_per_width_N_mm",
        "strain",
        "lower",
        "upper",
    ]
    assert set(table["stitch"]) == {"rib"}
    off = np.concatenate(
        [
            errors(
                predict(histories[n], histories[n[:-4] + "held"], n.split("-")[3]).strain,
                measured("cotton", n.split("-")[3]),
            )
            for n in names
            if n.endswith("free") and "rib" not in n
        ]
    )
    row = table[table["direction"] == "wale"].iloc[2]
    half = np.hypot(SHARE["wale"][1] * 0.1 * 1.2, 2 * np.sqrt(np.mean(off**2)) * row["strain"])
    assert row["upper"] - row["strain"] == pytest.approx(half)


def both_ways(history):
    """Return a history that is pulled in course and wale direction alike."""
    return history.map(lambda values: values + values.isel(form=[1, 0, 2]).to_numpy())
