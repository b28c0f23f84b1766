"""Claims about course spacing and yarn diameter: K9 and K10 of ``resources/reference/paper_claims.csv``.

The rule: the largest |u_z| at 5 % course strain, isotropic friction, goes the way that is claimed (K9: rises with the
course spacing; K10: falls with the diameter) from each value to the next by more than the sum of both points'
uncertainties, or at least never goes the other way by more than that; and over the whole range it changes that way by
more than the sum of the uncertainties of its ends. A reading of what is held fixed goes against the claim where a step,
or the whole range, goes the other way by more than these sums; else it decides nothing. The claim is reproduced where
it holds in every reading, and not reproduced where every reading goes against it. Where readings differ it is not
decidable: it hangs on what is held fixed, which is not printed.
"""

from __future__ import annotations

from functools import partial
from itertools import pairwise

from knitstudy.measures.claims.evidence import NOT_RUN, Evidence, Judgement, at_full_strain, verdict
from knitstudy.measures.claims.rule import BEFORE, Rule
from knitstudy.measures.names import INTERACTIONS
from knitstudy.measures.sweeps import DIAMETER, HELD, SPACING, Point, Series, series_of

FEWEST = 5
"""Values without which a sweep decides nothing, in the reading that has most."""

HANGS = "hangs on what is held fixed"

SAID = {True: "as claimed", False: "against it", None: "within the uncertainties"}


def judge(key: str, sign: int, evidence: Evidence) -> Judgement:
    """Judge by the rule of this module.

    Parameters
    ----------
    key : str
        What is swept.
    sign : {1, -1}
        Whether u_z is claimed to rise or to fall with it.
    evidence : Evidence
    """
    found = series_of(key, evidence.sweeps, evidence.scenes, evidence.reference)
    main = [each for each in found if each.main and each.interaction == "isotropic"]
    if max((len(each.points) for each in main), default=0) < FEWEST:
        return Judgement(
            "", NOT_RUN, f"the study has no sweep of {key} with {FEWEST} values and isotropic friction"
        )
    held = {each.keep: goes(each, sign) for each in main}
    lacks = [HELD[keep] for keep in HELD if keep not in held]
    said = [f"{HELD[each.keep]} {_said(key, each)}, {SAID[held[each.keep]]}" for each in main]
    ties = [each for each in found if each.main and each.interaction == "tie"]
    beside = [f"{HELD[each.keep]} {_said(key, each)}, {SAID[goes(each, sign)]}" for each in ties]
    result = next(iter(held.values())) if len(set(held.values())) == 1 else None
    notes = [HANGS if len(set(held.values())) > 1 else "", f"{INTERACTIONS['tie']}: {'; '.join(beside)}"]
    judged = Judgement(f"largest |u_z|: {'; '.join(said)}", verdict(result), "; ".join(filter(None, notes)))
    if lacks:
        judged = Judgement(judged.measured, NOT_RUN, f"without {', '.join(lacks)}; {judged.note}")
    scenes = [point.scene.name for each in main for point in each.points]
    return at_full_strain(evidence, judged, [evidence.sweeps[name] for name in scenes], scenes[0])


def goes(series: Series, sign: int) -> bool | None:
    """Whether a series goes the way of a sign; False where it goes the other way, None where that is open."""
    steps = [_change(*pair, sign) for pair in pairwise(series.points)]
    whole, limit = _change(series.points[0], series.points[-1], sign)
    if any(change < -allowed for change, allowed in [*steps, (whole, limit)]):
        return False
    return True if whole > limit and all(change >= -allowed for change, allowed in steps) else None


def _change(one: Point, other: Point, sign: int) -> tuple[float, float]:
    """Return the change of u_z from one point to another, in the sense of a sign, and both uncertainties together."""
    return sign * (other.u_z.value - one.u_z.value), one.u_z.uncertainty + other.u_z.uncertainty


def _said(key: str, series: Series) -> str:
    """Say the ends of a series, and how many values it has."""
    form = "{:.2f} c" if key == SPACING else "{:.4g} m"
    ends = ", ".join(
        f"{1e3 * point.u_z.value:.3f} ± {1e3 * point.u_z.uncertainty:.3f} mm at {form.format(point.value)}"
        for point in (series.points[0], series.points[-1])
    )
    return f"{ends} ({len(series.points)} values)"


WORDS = (
    "the largest |u_z| at 5 % strain, isotropic friction, {} from each value to the next by more than both "
    "uncertainties or never {} by more, and by more than both over the whole range; in every reading of what is held "
    "fixed. Where every reading goes against that: not reproduced; where readings differ: not decidable"
)

RULES = {
    "K9": Rule(
        partial(judge, SPACING, 1),
        WORDS.format("rises", "falls"),
        BEFORE,
        ("fig11a_course_spacing", "sweeps"),
        "of every value, by the next degree and hexahedra, beside the values",
    ),
    "K10": Rule(
        partial(judge, DIAMETER, -1),
        WORDS.format("falls", "rises"),
        BEFORE,
        ("fig11b_yarn_diameter", "sweeps"),
        "of every value, by the next degree and hexahedra, beside the values",
    ),
}
