"""Sizes of swatches: what is drawn, from what, and how intervals and comparisons are made."""

import numpy as np
import pandas as pd
import pytest
import swatches

STITCHES = "stitches (bottom row first)"


@pytest.fixture(scope="module")
def measured():
    return swatches.read_measured()


def test_swatches_are_the_same_knit_where_their_repeats_are(measured):
    repeats = measured["repeat"]
    assert len(measured) == 28
    assert set(repeats[["2_1", "2_2", "48_1", "98_2"]]) == {swatches.STOCKINETTE}
    assert repeats["103_3"] == repeats["2_3"] == repeats["55_2"]
    assert measured["mass [g]"].notna().sum() == 12


def test_yarn_between_the_beds_follows_from_masses(measured):
    """A swatch whose pattern has 10 % more yarn in a stitch for each transition."""
    x = np.array([0.0, 0.5, 1.0])
    inner, whole = swatches.PATTERN**2, swatches.WHOLE**2
    table = pd.DataFrame({"transitions": x, "mass [g]": 4.0 * (1 + 0.1 * x * inner / whole)})
    assert swatches.more_yarn(table) == pytest.approx(0.1)
    # Ribs, moss and seed hold more yarn than stockinette by their mass: 0.3 of 2 g
    assert 0.1 < swatches.more_yarn(measured.dropna()) < 0.25


@pytest.mark.parametrize(
    "stitches", [("K",), ("K", "P"), ("KP",), ("KP", "PK"), ("KPPK", "KPPK", "PKKP", "PKKP")]
)
def test_beds_are_as_far_apart_as_the_yarn_in_a_stitch_says(stitches):
    fabric = swatches.drawn_on_needles(stitches, swatches.RULE, 1e-4, more=0.2)
    size = len(stitches) * len(stitches[0])
    length = sum(line.length for line in fabric.centrelines[:-1]) / size
    wanted = swatches.RULE.length * (1 + 0.2 * swatches.transitions(stitches))
    assert length == pytest.approx(wanted, rel=0.04)  # Splines of drawn loops are up to 2 % shorter or longer
    assert fabric.crossings.distance.min() > 1e-4
    assert len(fabric.crossings.distance) == 4 * size


def test_intervals_hold_the_band_and_what_is_not_known(measured):
    shapes = pd.DataFrame(
        [
            {"repeat": " ".join(repeat), "start": start, "width": width, "height": 1e-3}
            for repeat in set(measured["repeat"])
            for start, width in (("rule", 1.6e-3), ("long", 1.76e-3))
        ]
    )
    predicted = swatches.predict(measured, shapes)
    plain = predicted.loc["2_1"]
    half = np.sqrt(0.1**2 + swatches.LENGTH**2 + swatches.OTHERS**2)
    assert plain["width [mm]"] == 96.0
    assert plain[["width lower", "width upper"]].tolist() == pytest.approx(
        [96 * (1 - half), 96 * (1 + half)], abs=0.1
    )
    rib = predicted.loc["3_3"]
    assert rib["height upper"] > plain["height upper"], "its yarn in a loop is known less well"


def test_judgement_counts_open_swatches_alone(measured):
    """A right prediction has rank correlation 1, no error, and all inside; the rule's own fabrics are left out."""
    right = pd.DataFrame(
        {
            name: measured[given].fillna(1.0) + add
            for size, given in swatches.SIZES.items()
            for name, add in ((f"{size} [mm]", 0), (f"{size} lower", -1), (f"{size} upper", 1))
        }
    )
    judged = swatches.judge(measured, right).set_index(["size", "swatches"])
    assert judged["Spearman"].tolist() == [1.0] * 4
    assert judged["median error"].tolist() == [0.0] * 4
    assert judged["inside"].tolist() == [1.0] * 4
    assert ("width", "not of the rule: 7") in judged.index
    assert judged.loc[("width", "open: 12"), "all are stockinette"] > 0
