"""Cells of beams: rest, large strains, cycles of a plain knit, agreement with solid yarns, machine files."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from refusals import refusal

from knitstudy import CellOfBeams, CellStrain, Friction, Pattern, SetYarn
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.loading.run import Run
from knitstudy.knit.models.beam import contact as beam_contact
from knitstudy.knit.simulate import simulate
from knitstudy.mechanics.beams.laws import Patch
from knitstudy.run import simulations
from knitstudy.run.configuration import load_scene
from knitstudy.run.stages import STAGES

KEYS = yaml.safe_load(Path(__file__).with_name("endless_beams.yaml").read_text())
BEAMS, SOFT, FROM_REST = KEYS["beams"], KEYS["soft yarn"], KEYS["from rest"]
"""Keys of cells of beams of an elastic yarn, of a soft one, and of a soft one in stitches that are drawn."""


@pytest.fixture(scope="module")
def soft():
    scene = load_scene("cell-course-isotropic").vary(SOFT)
    geometry = lay_out(scene)
    return scene, geometry, STAGES["rest"].function(scene, geometry)


@pytest.mark.parametrize("deformation", ["wale", "shear"])
def test_a_cell_that_nothing_resists_yet_is_said_to_be_slack(deformation):
    """Yarns drawn apart by 0.2 um: until they touch, drag alone has energy, 1e-18 J, which ends no run."""
    drawn = Pattern(course_spacing=0.9e-3, wale_spacing=1.1e-3, loops=1, rows=1)
    scene = CellOfBeams(
        pattern=drawn,
        yarn=SetYarn(diameter=0.05e-3, youngs_modulus=1e9),
        load=CellStrain(deformation=deformation, strain=4e-3 if deformation == "shear" else 6e-4),
        contact=Friction(friction=0.3),
    ).vary({"load.lateral": "free", "mesh.beam_size": 1.5, "solver.increments": 4})
    history = simulations.simulate(scene).history
    strain, gap = history["strain"].to_numpy(), history["smallest_gap"].to_numpy()
    said = re.match(r"no stiffness (.*) below a strain of (\S+): ", history.attrs["slack"])
    assert said[1] == {"wale": "along wales", "shear": "in shear"}[deformation]
    touches = strain[np.argmax(gap < 0)]
    assert 0 < float(said[2]) <= 1.01 * touches
    if deformation == "wale":
        after = strain[strain > float(said[2])]
        assert after[0] <= 1.5 * touches
        assert history["force"][-1] > 1e3 * history["force"][1]  # of drag


def test_no_force_acts_at_rest(soft):
    scene, geometry, rest = soft
    history = simulate(scene.vary({"load.strain": 0.01, "solver.increments": 1}), geometry, rest=rest)
    start, end = np.abs(history.force_per_width.values[[0, -1]])
    assert start.max() < 1e-3 * end[0]
    assert end[1] < 1e-3 * end[0]  # free across
    assert rest.attrs["cell_width"] == pytest.approx(history.attrs["cell_width"])
    assert history.energy.sel(form="friction").values[-1] > 0  # yarns rub from the first increment on


def test_a_rest_without_friction_does_not_depend_on_friction(soft):
    """Two ways to one shape: with little friction and with much, which then goes. Progress is of both paths."""
    scene, geometry, rest = soft
    shares = []
    run = Run(progress=lambda done, note="": shares.append(done))
    other = STAGES["rest"].function(scene.vary({"contact.friction": 0.05}), geometry, run)
    assert shares == sorted(shares)
    assert {0.0, 0.5, 1.0} <= {*shares}
    for name in ("cell_width", "cell_height"):
        assert other.attrs[name] == pytest.approx(rest.attrs[name], rel=1e-6)
    held = STAGES["rest"].function(scene.vary({"load.start": "rest_with_friction"}), geometry)
    assert abs(held.attrs["cell_height"] / rest.attrs["cell_height"] - 1) > 1e-3


def test_a_cycle_dissipates_and_balances_energy(soft):
    scene, geometry, rest = soft
    turned = scene.vary({"load.strain": 0.3, "load.turns": [0.3, 0.05], "solver.increments": 40})
    history = simulate(turned, geometry, rest=rest)
    strain, force = history.cell_strain.values[:, 0], history.force_per_width.values[:, 0]
    first, back = np.argmax(strain > 0.2999), np.argmin(np.where(np.arange(len(strain)) > 5, strain, 1))
    loading, unloading = (
        np.interp(0.2, *sorted_by(strain[part], force[part]))
        for part in (slice(0, first + 1), slice(first, back + 1))
    )
    assert unloading < 0.9 * loading
    assert force[-1] == pytest.approx(force[first], rel=0.05)  # the second loading meets the first
    external, *others = history.energy.values[-1]
    assert external == pytest.approx(sum(others), rel=0.02)
    assert history.energy.sel(form="friction").values[-1] > 0.1 * external


def sorted_by(key, value):
    order = np.argsort(key)
    return key[order], value[order]


def test_a_cell_goes_to_twice_its_width(soft):
    scene, geometry, rest = soft
    history = simulate(scene.vary({"load.strain": 1.0, "solver.increments": 40}), geometry, rest=rest)
    force = history.force_per_width.values[:, 0]
    assert np.all(np.diff(force) > 0)
    assert history.newton_iterations.values.sum() < 400


def test_start_and_interaction_are_checked(soft):
    scene, geometry, _ = soft
    with refusal("none is given of shapes at rest"):
        simulate(scene, geometry)
    rough = {"interaction": "rough", "load.start": "drawn"}
    with refusal("must be friction"):
        simulate(scene.vary(rough), geometry)
    with refusal("somewhere else"):
        scene.vary({"load.turns": [0.3, 0.3]})


@pytest.mark.parametrize(("deformation", "expected", "contraction"), [("course", 158.1, 0.0065)])
def test_slender_elastic_yarn_carries_what_solid_yarns_do(deformation, expected, contraction):
    """The reference is the cell of spline yarns with friction, at 2.5 % strain (scene cell-course-isotropic)."""
    keys = {"fidelity": "beam", "load.strain": 0.025, "mesh.beam_size": 0.2, "beam.section": "hertz"}
    scene = load_scene(f"cell-{deformation}-isotropic").vary(keys | {"solver.increments": 10})
    history = simulate(scene, lay_out(scene))
    assert history.force_per_width.values[-1, 0] == pytest.approx(expected, rel=0.10)
    assert -history.cell_strain.values[-1, 1] == pytest.approx(contraction, rel=0.2)


def test_stockinette_of_acrylic_yarn_is_that_of_an_independent_program(monkeypatch):
    """One stitch as a quintic spline with bending, stretching and the potential alone (docs/notes/fabrics.md)."""

    def alone(patch, k_a, k_b, cos, near):
        one = k_a * 0.0 + 1.0
        return one, one

    monkeypatch.setattr(Patch, "density", alone)
    monkeypatch.setattr(beam_contact, "points_per_station", lambda length, fine: 2)
    scene = load_scene("cell-course-isotropic").vary(KEYS["independent program"])
    geometry = lay_out(scene)
    rest = STAGES["rest"].function(scene, geometry)
    assert (rest.attrs["cell_width"], rest.attrs["cell_height"]) == pytest.approx(
        (3.13e-3, 1.90e-3), rel=5e-3
    )
    for axis, direction, strains in (
        (0, "course", (0.175, 0.375, 0.486)),
        (1, "wale", (0.091, 0.235, 0.324)),
    ):
        load = {"load.deformation": direction, "load.strain": 1.5 * strains[-1], "solver.increments": 30}
        history = simulate(scene.vary(load | {"load.largest_force": 260.0}), geometry, rest=rest)
        assert history.force_per_width.values[-1, axis] >= 260 > history.force_per_width.values[-2, axis]
        assert history.attrs["full_load"] == history["load"].values[-1] < 1
        force, strain = history.force_per_width.values[:, axis], history.cell_strain.values[:, axis]
        assert np.interp([50, 150, 250], force, strain) == pytest.approx(strains, rel=0.025)


def pulled(stitches, keys):
    """Forces per width of a cell of the smallest size of stitches at the end, scaled by the largest."""
    size = {"pattern.loops": len(stitches[0]), "pattern.rows": len(stitches), "pattern.stitches": stitches}
    scene = load_scene("stitches-plain-course").vary(size | keys)
    force = simulate(scene, lay_out(scene)).force_per_width.values[-1, :2]
    return force / np.abs(force).max(), np.abs(force).max()


@pytest.mark.parametrize(
    ("keys", "same", "within"),
    [
        ({}, ["P"], 1e-9),
        (BEAMS, ["P"], 1e-9),
        (
            BEAMS | {"solver.increments": 12},
            ["KK"],
            1e-4,
        ),  # other loops of a repeat are optimised, to 5e-5 radii
    ],
    ids=["solid yarns", "beams", "a wider repeat"],
)
def test_all_purl_is_plain_knit(keys, same, within):
    (force, size), (other, other_size) = pulled(["K"], keys), pulled(same, keys)
    assert other_size == pytest.approx(size, rel=within)
    np.testing.assert_allclose(other, force, atol=within, rtol=0)


# Forces per width [N/m] of cells at 3 % strain by spline yarns (stitches.md), with their degree and the bar. From
# degree 3 to 6 forces without friction fall by 2 to 3 %: below that, indentation rests on a law of straight yarns, and
# above, that law is 2 % too soft (beams.md). Loops here are bent to 0.4 / R. Beams that do not know on which side of a
# bend yarns touch are 3 to 6 % too stiff.
SOLIDS = [
    ("plain", "course", 0.0, (80.65, 64.41), 6, 0.02),
    ("plain", "wale", 0.0, (71.11, 70.21), 8, 0.02),
    ("plain", "wale", 0.3, (82.20, 175.13), 6, 0.02),
    ("plain", "wale", 3.0, (122.12, 485.16), 6, 0.03),
    ("rib", "course", 0.0, (41.14, 43.65), 6, 0.02),
    ("garter", "course", 0.0, (94.43, 84.42), 6, 0.02),
    ("garter", "wale", 0.3, (71.00, 156.63), 3, 0.02),
    pytest.param("seed", "course", 0.3, (133.23, 92.65), 3, 0.07, marks=pytest.mark.full),
]


@pytest.mark.parametrize(("knit", "way", "friction", "solid", "degree", "bar"), SOLIDS)
def test_cells_of_beams_carry_what_solid_yarns_do(knit, way, friction, solid, degree, bar, verify):
    keys = {"contact.friction": friction, "mesh.beam_size": 0.4, "load.strain": 0.03, "solver.increments": 12}
    scene = load_scene(f"stitches-{knit}-{way}").vary(BEAMS | keys)
    history = simulate(scene, lay_out(scene))
    for axis, actual, expected in zip(
        ("courses", "wales"), history.force_per_width.values[-1], solid, strict=False
    ):
        case = f"cell of beams, {knit}, {way}, friction {friction:g}, along {axis}: solids of degree {degree}"
        verify.within(case, float(actual), expected, bar)
    lost = history.energy.sel(form="friction").values
    assert np.diff(lost).min() >= -1e-12 * np.abs(history.energy.values).max()


FILES = Path(__file__).resolve().parents[2] / "examples" / "knitout"


def history(stitches, scene="fabric-acrylic-rib-course-free", keys=FROM_REST):
    """Return the history of a cell with keys of its stitches."""
    return simulations.simulate(load_scene(scene).vary({"knit": "machine-knit"} | keys | stitches)).history


@pytest.mark.parametrize(
    ("scene", "keys"),
    [
        ("stitches-rib-course", BEAMS),
        pytest.param("fabric-acrylic-rib-course-free", FROM_REST, marks=pytest.mark.full),
    ],
    ids=["elastic yarn", "soft yarn at rest"],
)
def test_a_rib_of_a_file_is_the_rib_of_letters(scene, keys):
    """It begins one needle later: the same knit."""
    of_file = history({"pattern.knitout": str(FILES / "rib.k")}, scene, keys)
    letters = {"pattern.stitches": ["KP"], "pattern.loops": 2, "pattern.rows": 1}
    of_letters = history(letters, scene, keys)
    for name in ("force", "cell_strain", "force_per_width"):
        expected = of_letters[name].to_numpy()
        within = 1e-6 * float(abs(expected).max())
        assert of_file[name].to_numpy() == pytest.approx(expected, abs=within), name
    assert of_file.attrs["cell_width"] == pytest.approx(of_letters.attrs["cell_width"], rel=1e-6)


@pytest.mark.full
def test_a_half_cardigan_is_wider_and_softer_than_its_rib():
    """Tucks push wales apart and hold loops long: the textbooks' fact (Spencer 2001, Knitting Technology, ch. 18)."""
    rib, tucked = (
        history({"pattern.knitout": str(FILES / f"{name}.k")}) for name in ("rib", "half_cardigan")
    )
    assert tucked.attrs["cell_width"] > 1.2 * rib.attrs["cell_width"]
    force = [float(each["force_per_width"][-1, 0]) for each in (rib, tucked)]
    assert 0 < force[1] < force[0]
