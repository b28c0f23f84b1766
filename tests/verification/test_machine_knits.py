"""Cells of machine files: a rib of one is the rib of letters, and what a half cardigan and floats do to a knit."""

from pathlib import Path

import pytest
from beam_cells import BEAMS

from knitstudy.run.configuration import load_scene
from knitstudy.run.store import simulate

FILES = Path(__file__).resolve().parents[2] / "examples" / "knitout"
DRAWN = {"pattern.wale_spacing": 3.3e-3, "pattern.course_spacing": 2.2e-3, "pattern.loop_length": None}
SOFT = DRAWN | {"load.start": "rest", "load.strain": 0.05, "load.largest_force": None, "solver.increments": 2}


def history(stitches, scene="fabric-acrylic-rib-course-free", keys=SOFT):
    """Return the history of a cell with keys of its stitches."""
    return simulate(load_scene(scene).vary({"knit": "machine-knit"} | keys | stitches)).history


@pytest.mark.parametrize(
    ("scene", "keys"),
    [
        ("stitches-rib-course", BEAMS),
        pytest.param("fabric-acrylic-rib-course-free", SOFT, marks=pytest.mark.full),
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
