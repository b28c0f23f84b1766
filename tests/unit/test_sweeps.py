"""Sweeps of course spacing and diameter: which simulations make a series, their errors, and claims K9 and K10."""

from dataclasses import replace

import pytest
import study
from study import DRAWN_LIFT, SURE, swept_histories

from knitstudy.paper.claims.evidence import evidence_of, judge
from knitstudy.paper.columns import rows_of
from knitstudy.paper.sweeps import SPACING, sweeps_of


@pytest.fixture(scope="module")
def scenes():
    return study.swept_scenes()


@pytest.fixture(scope="module")
def reference(scenes):
    return study.swept_reference(scenes)


def judged(claim, paper, scenes, reference, slopes, left_out=(), held="shape"):
    kept = {name: scene for name, scene in scenes.items() if not any(part in name for part in left_out)}
    known = {"geometry": None, "paper": paper, "reference": reference}
    evidence = evidence_of(swept_histories(kept, slopes), kept, **known, held=held)
    base = replace(evidence, held="shape")
    return judge(claim, base if held == "shape" else replace(evidence, base=base))


def test_series_are_of_one_reading_interaction_and_discretisation(scenes, reference):
    actual = sweeps_of(SPACING, rows_of(scenes, swept_histories(scenes, {"shape": 1.0})), reference)
    main = {(each.keep, each.interaction): each for each in actual if each.main}
    assert len(main) == 6
    ratios = [point.value for point in main["wale_spacing", "isotropic"].points]
    assert ratios == [0.75, 0.8, 0.9, 1.0, 1.1, 1.2, 1.25]
    assert [point.scene.name for point in main["shape", "tie"].points][-1] == "yarns-tie-course"
    others = sorted((each.made_of, each.interaction, len(each.points)) for each in actual if not each.main)
    assert others == [
        ("one-point hexahedra, 6 across", "isotropic", 2),
        ("one-point hexahedra, 6 across", "tie", 2),
        ("solid yarns of degree 3", "isotropic", 3),
        ("solid yarns of degree 3", "tie", 3),
    ]


def test_error_of_a_series_is_the_largest_that_is_known(scenes, reference):
    actual = swept_histories(scenes, {"shape": 1.0})

    def error():
        (series,) = (
            each
            for each in sweeps_of(SPACING, rows_of(scenes, actual), reference)
            if each.main and (each.keep, each.interaction) == ("length", "isotropic")
        )
        return series.points[0].u_z.uncertainty / series.points[0].u_z.value

    assert error() == pytest.approx(SURE)  # the drawn loop meets the reference
    finer = "sweep-shape-c075-isotropic-course-p3"
    actual[finer] = study.history(lift=1.1 * 0.75 * DRAWN_LIFT, scene=finer)
    assert error() == pytest.approx(0.1)


@pytest.mark.parametrize("claim", ["K9", "K10"])
@pytest.mark.parametrize(
    ("slopes", "verdict"),
    [
        ({"shape": 1.0}, "reproduced"),
        ({"shape": -1.0}, "contradicted"),
        ({"shape": 1.0, "length": -1.0}, "undecidable"),
        ({"shape": 1e-3}, "undecidable"),
    ],
)
def test_verdict_turns_with_the_slope_of_the_held_quantity(paper, scenes, reference, claim, slopes, verdict):
    actual = judged(claim, paper, scenes, reference, slopes)
    assert actual.verdict == verdict, actual
    if "length" in slopes:
        assert judged(claim, paper, scenes, reference, slopes, held="length").verdict == "contradicted"


def test_verdict_is_withheld_without_enough_values(paper, scenes, reference):
    few = judged("K9", paper, scenes, reference, {"shape": 1.0}, ["shape-c0"])
    assert (few.verdict, "5 values, drawn shape held" in few.note) == ("not yet run", True)
