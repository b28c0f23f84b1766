"""Yarns as files, and the law of pressing between plates and at a crossing."""

import numpy as np
import pandas as pd
import pytest
import synthetic
from refusals import REFUSED, refusal
from scipy.stats import linregress

from knitstudy.knit.loading.history import DIRECTIONS
from knitstudy.knit.scene.alternatives import KEYS, known_yarns, read_yarn
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.mechanics.membrane import forces_per_width
from knitstudy.paper.tables import fabrics
from knitstudy.paper.tables.fabrics import (
    Pulled,
    StripLaw,
    strip_of,
    tabulate_predictions,
    tabulate_stockinette,
)
from knitstudy.run.configuration import load_scene

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


@pytest.mark.parametrize(("change", "message"), REFUSED["yarns"])
def test_a_file_that_says_too_little_is_refused(tmp_path, knit, change, message):
    path = tmp_path / "wool.yaml"
    path.write_text("name: wool\nvalues:\n" + "".join(f"  {key}: {value}\n" for key, value in change.items()))
    with refusal(message):
        knit.vary({"yarn.of": str(path)})


HALF = 0.5
"""Exponent of the force of yarns that cross less that of a yarn between plates.

Of layers whose pressure is a power of their compression: the pressed strip is as wide as the root of the approach, the
pressed patch of a crossing grows with the approach.
"""


def power_law(approach, force):
    """Return the exponent of F = k approach^n in least squares of logarithms, and the scatter of ln F about it."""
    x, y = np.log(approach), np.log(force)
    line = linregress(x, y)
    return line.slope, np.sqrt(np.mean((y - line.intercept - line.slope * x) ** 2))


@pytest.mark.parametrize(
    ("name", "plates"), [("acrylic", (2.41, 2.53, 2.61)), ("cotton", (1.95, 2.02, 2.10, 2.07))]
)
def test_pieces_between_plates_have_the_exponents_that_the_yarn_has_less_a_half(name, plates):
    table = pd.read_csv(RESOURCES / "measured" / "yarn_pressing.csv").query("yarn == @name")
    laws = [
        power_law(each.pressed_mm / each.diameter_mm, each.force_mN / 1e3)
        for _, each in table.groupby("sample")
    ]
    actual = [n for n, _ in laws]
    assert np.allclose(actual, plates, atol=0.005)
    value = read_yarn(name).values["pressing_exponent"]
    assert min(actual) - 0.05 <= value.value - HALF <= max(actual) + 0.05
    # One power is off by a fifth of the force or more: both ends of the curve are not one law.
    assert all(scatter > 0.2 for _, scatter in laws)


def cells_of(fabric, **changed):
    """Return all cells of a fabric."""
    names = [(way, other) for way in DIRECTIONS for other in ("free", "held")] + [("shear", "free")]
    return {
        f"fabric-{fabric}-{way}-{other}": synthetic.fabric_cell(other, way, 1.5, **changed)
        for way, other in names
    }


@pytest.fixture(autouse=True)
def few_elements(monkeypatch):
    monkeypatch.setattr(fabrics, "ELEMENTS", 2)


@pytest.fixture(scope="module", params=[0, 1])
def strip_law(request):
    cells = [
        Pulled.of(synthetic.fabric_cell(other, DIRECTIONS[request.param]), DIRECTIONS[request.param])
        for other in OTHERS
    ]
    return StripLaw.of(*cells, request.param, synthetic.LINEAR["shear"]), cells[1]


OTHERS = ("free", "held")


def test_a_law_between_two_cells_is_that_of_a_fabric_that_is_quadratic(strip_law):
    law, held = strip_law
    states = np.zeros((len(held.along), 3))
    states[:, law.axis] = held.along
    actual = forces_per_width(law, states)[:, law.axis]  # which the law has not been told
    assert actual == pytest.approx(held.force, abs=2e-3 * held.force[-1])
    e, across, g = 0.3, -0.05, 0.1
    stretch = [across, e] if law.axis else [e, across]
    strain = np.array([(1 + each) ** 2 / 2 - 0.5 for each in stretch] + [g])
    apart = across + synthetic.LINEAR["contraction"] * e
    energy = (
        synthetic.LINEAR["along"] * e**2 / 2
        + synthetic.LINEAR["across"] * apart**2 / 2
        + synthetic.LINEAR["shear"] * g**2 / 2
    )
    assert law.energy(strain) == pytest.approx(energy, rel=2e-3)


def test_stress_and_tangent_of_the_law_are_derivatives(strip_law):
    law, _ = strip_law
    strain = np.array([[0.3, -0.1, 0.1], [-0.05, 0.2, -0.2], [0.5, 0.4, 0.0]])
    for i, step in enumerate(1e-6 * np.eye(3)):
        ahead, behind = law.respond(strain + step), law.respond(strain - step)
        assert (ahead[0] - behind[0]) / 2e-6 == pytest.approx(law.stress(strain)[:, i], rel=1e-5, abs=1e-5)
        assert (ahead[1] - behind[1]) / 2e-6 == pytest.approx(law.tangent(strain)[:, i], rel=1e-4, abs=1e-2)


def test_a_strip_lies_between_its_cells_and_says_nothing_beyond_them():
    free, held = (synthetic.fabric_cell(other, "course", 0.45) for other in OTHERS)
    cells = {"free": Pulled.of(free, "course"), "held": Pulled.of(held, "course")}
    strip = strip_of(cells, synthetic.fabric_cell("free", "shear"), "cotton", "stockinette", "course")
    assert np.isnan(strip.strain[-2:]).all()  # 0.25 N/mm is beyond the free cell
    assert (strip.strain[:-2] < cells["free"].strain[:-2]).all()
    assert (strip.strain[:-2] > cells["held"].strain[:-2]).all()
    assert (strip.clamps[:-2] > 0).all()


def test_predictions_have_the_scatter_of_stockinette_and_the_change_by_a_loose_rest():
    cells = cells_of("cotton-stockinette") | cells_of("cotton-rib", along=400.0)
    table = tabulate_predictions(cells)
    assert list(table.columns) == PREDICTED
    assert set(table["stitch"]) == {"rib"}
    stockinette = tabulate_stockinette(cells_of("cotton-stockinette"))
    off = stockinette["error [%]"][stockinette["force per width [N/mm]"].between(0.05, 0.25)] / 100
    assert ((table["upper"] - table["strain"]) >= 2 * np.sqrt(np.mean(off**2)) * table["strain"]).all()
    loose = {"fabric-cotton-rib-wale-loose": synthetic.fabric_cell("free", "wale", 1.5, along=200.0)}
    both = table.merge(tabulate_predictions(cells | loose), on=PREDICTED[:4])
    wider = both[both["direction"] == "wale"]
    actual = (wider["upper_y"] - wider["strain_y"]) ** 2 - (wider["upper_x"] - wider["strain_x"]) ** 2
    assert actual.to_numpy()[:5] == pytest.approx(
        wider["strain_x"].to_numpy()[:5] ** 2, rel=0.02
    )  # twice as far


PREDICTED = ["yarn", "stitch", "direction", "force_per_width_N_mm", "strain", "lower", "upper", "status"]


def test_what_is_not_known_of_a_fabric_widens_its_interval_but_not_that_of_stockinette():
    strain = np.linspace(0.2, 0.8, len(fabrics.FORCES))
    assert not fabrics.changes_by_unknowns("stockinette", "wale", strain).any()
    table = pd.read_csv(fabrics.UNKNOWNS).query("stitch == 'rib' and direction == 'wale'")
    actual = fabrics.changes_by_unknowns("rib", "wale", strain)
    less = strain * table["less_yarn"].to_numpy()
    longer = (1 + strain) / (
        1 + table["rest_highest"].to_numpy()
    ) - 1  # counted from the longest shape at rest
    assert actual[0] == pytest.approx(np.hypot(less, longer - strain), rel=1e-12)
    assert (actual[1] > 0).all()


KEPT = pd.read_csv(RESOURCES / "predictions.csv")


def inside(stitch, direction):
    """Return whether measured strains of both yarns lie in the kept intervals."""
    rows = KEPT[(KEPT["stitch"] == stitch) & (KEPT["direction"] == direction)]
    known = pd.read_csv(RESOURCES / "measured" / f"{stitch}.csv")
    both = rows.merge(known, on=["yarn", "direction", "force_per_width_N_mm"], suffixes=("", "_measured"))
    return both["strain_measured"].between(both["lower"], both["upper"])


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_direction_of_rib_is_claimed_where_four_fifths_of_the_measured_strains_lie_inside(direction):
    claimed = ("rib", direction) not in fabrics.WITHDRAWN
    assert (inside("rib", direction).mean() >= 0.8) == claimed
    assert set(KEPT.query("stitch == 'rib' and direction == @direction")["status"]) == {
        "claimed" if claimed else "withdrawn"
    }
