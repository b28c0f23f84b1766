"""Claims of the paper: functions that register themselves in `CLAIMS`, and one scale for all of them.

One file makes a claim: a module here, or one from outside that the configuration names under ``plugins``. Its row of
``resources/reference/paper_claims.csv`` fixes the rule beforehand. The function compares evidence
(`claims.evidence.Evidence`) with the rule and yields the rows of the claim.

The paper has words where a rule needs a number, which is the same in all claims (`MUCH` to `TREND`).

A `Row` is one quantity of a claim. A row that is tested has a grade of its own: the sense of the claim (is it larger at
all?) and the size (is it larger by as much as the word says?) are tested apart. The claim takes its worst grade.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from math import inf, isfinite, isnan
from typing import Any

from knitstudy.measures.estimate import Estimate, all_hold
from knitstudy.registry import Registry

MUCH = 2.0  # "much", "by far": a factor
COMPARABLE = 1.5  # "comparable", "similar": within this factor; "more" and "less" go beyond it
GOOD = 0.1  # "good agreement": within this share
TREND = 0.75  # "grows", "falls": share of all pairs of values that at least go this way

REPRODUCED, DIRECTION, CONTRADICTED = "reproduced", "direction holds, size does not", "contradicted"
UNDECIDABLE = "undecidable"
NOT_RUN = "not yet run"  # No grade: the study lacks the simulations
GRADES = (CONTRADICTED, UNDECIDABLE, DIRECTION, REPRODUCED)  # The worst comes first
DECIDED = {REPRODUCED, DIRECTION, CONTRADICTED}
LETTERS = "GSKEMRB"  # with which names begin: geometry, size, knit in contact, energy, stress, models, beams


@dataclass(frozen=True)
class Row:
    """A quantity with its value in this study and in the paper, as texts with units, and its grade if it is tested."""

    quantity: str
    ours: str = ""
    paper: str = ""
    grade: str = ""  # Empty: shown, not tested
    # Factor by which the value passes (above 1) or misses its bar; inf of tests without a factor
    margin: float = inf

    def __post_init__(self) -> None:
        if isnan(self.margin):  # rows of equal values are equal
            object.__setattr__(self, "margin", inf)

    @property
    def tested(self) -> bool:
        """Whether the row counts for the grade of its claim."""
        return self.grade in GRADES

    @property
    def shown(self) -> Row:
        """The row without a grade: it is shown, and not tested."""
        return replace(self, grade="")

    def uncounted(self, why: str) -> Row:
        """Return the row, which does not count where it holds."""
        return replace(self, grade=f"holds, not counted: {why}") if self.grade == REPRODUCED else self


@dataclass(frozen=True)
class Remark:
    """A note beside the rows of a claim, and the scenes that must reach the paper's strain, the main one first."""

    note: str = ""
    scenes: tuple[str, ...] = ()
    complete: bool = True  # whether the study has all that a claim needs to be reproduced


class NotRun(Exception):
    """The study cannot decide a claim, for a reason; rows that the claim has yielded are shown nevertheless."""


Judge = Callable[..., Iterator[Row | Remark]]  # takes evidence, and what tells claims of one function apart


@dataclass(frozen=True)
class Claim:
    """A claim by its name, and the function that compares evidence with its rule."""

    name: str
    judge: Judge
    worst_first: bool = (
        False  # whether tests come first, of these failed ones and those with the least margin
    )


class Claims(Registry[Claim]):
    """All claims in the order of the paper's sections."""

    def add(self, name: str, worst_first: bool = False, **arguments: Any) -> Callable[[Judge], Judge]:
        """Return a decorator of the function that judges a claim; other keywords are arguments of the function.

        Raises ConfigurationError if the name is taken.
        """

        def added(judge: Judge) -> Judge:
            self.register(Claim(name, partial(judge, **arguments), worst_first))
            return judge

        return added

    def all(self) -> dict[str, Claim]:
        """Return all by name; those with other letters than the paper's come last."""
        names = sorted(
            super().all(), key=lambda name: (f"{LETTERS}{name[0]}".index(name[0]), len(name), name)
        )
        return {name: self._entries[name] for name in names}


CLAIMS = Claims("claim", "knitstudy.paper.claims")


def grade(direction: bool | None, size: bool | None = True) -> str:
    """Return the grade of one test; None where the uncertainty leaves a part of the test open.

    >>> grade(True, False)
    'direction holds, size does not'
    """
    if direction is not None and not direction:
        return CONTRADICTED
    if direction is None or size is None:
        return UNDECIDABLE
    return REPRODUCED if size else DIRECTION


def worst(rows: Iterable[Row]) -> str:
    """Return the worst grade of the rows that are tested."""
    return min((row.grade for row in rows if row.tested), key=GRADES.index)


def holds(
    quantity: str,
    ours: str,
    paper: str,
    direction: bool | None,
    size: bool | None = True,
    margin: float = inf,
) -> Row:
    """Return the row of a test that the caller has decided."""
    return Row(quantity, ours, paper, grade(direction, size), margin)


Value = Estimate | float


def at_least(
    quantity: str,
    value: Value,
    paper: str,
    bar: float,
    sense: float | None = None,
    text: str = "",
    sign: int = 1,
) -> Row:
    """Return the row of a value that must reach `bar` (size) and must exceed `sense` (direction).

    Without `sense` the bar decides both: a value below it contradicts the claim. With the sign -1 the value must not
    exceed the bar, and must lie below `sense`.
    """
    text = text or (str(value) if isinstance(value, Estimate) else f"{value:.2f}")
    value = _estimate(value)
    signed = Estimate(sign * value.value, value.uncertainty)
    size = direction = signed.above(sign * bar)
    if sense is not None:
        below = signed.below(sign * sense)
        direction = None if below is None else not below
    over, under = (value.value, bar) if sign > 0 else (bar, value.value)
    return Row(quantity, text, paper, grade(direction, size), over / under if under > 0 else inf)


at_most = partial(at_least, sign=-1)


def comparable(
    quantity: str, value: Value, paper: float, text: str, printed: str, direction: bool | None = None
) -> Row:
    """Return the row of a value that must lie within a factor of `COMPARABLE` of the paper's number.

    A number alone has no direction: without `direction` a value farther off contradicts the claim.
    """
    ratio = _estimate(value).of(lambda ours: ours / paper)
    size = all_hold((ratio.above(1 / COMPARABLE), ratio.below(COMPARABLE)))
    margin = COMPARABLE / max(ratio.value, 1 / ratio.value) if ratio.value > 0 else 0.0
    return Row(quantity, text, printed, grade(size if direction is None else direction, size), margin)


def trend(quantity: str, values: Sequence[Estimate], sign: int, paper: str, half: bool | None = None) -> Row:
    """Return the row of values, in rising order of the input, that grow (sign 1) or fall (-1).

    A pair of values that differ by less than both uncertainties counts half. `half` is whether half of the pairs are
    enough for the direction; None leaves that open.
    """
    pairs = list(combinations(values, 2))
    share = sum(_goes(one, other, sign) for one, other in pairs) / len(pairs)
    direction = half if share == 0.5 else share > 0.5
    text = f"{share:.0%} of {len(pairs)} pairs"
    return Row(quantity, text, paper, grade(direction, share >= TREND), share / TREND)


def _goes(one: Estimate, other: Estimate, sign: int) -> float:
    change = sign * (other.value - one.value)
    if abs(change) <= one.uncertainty + other.uncertainty:
        return 0.5
    return float(change > 0)


def _estimate(value: Value) -> Estimate:
    return value if isinstance(value, Estimate) else Estimate(float(value), 0.0)


def by_meanings(rows: Sequence[Row]) -> list[Row]:
    """Return one test by several meanings of the paper's words, open where they contradict each other.

    >>> [row.grade for row in by_meanings([Row("sections", grade=CONTRADICTED), Row("points", grade=REPRODUCED)])]
    ['undecidable', 'undecidable']
    """
    if disagree(row.grade for row in rows):
        return [replace(row, grade=UNDECIDABLE) for row in rows]
    return [*rows]


def disagree(grades: Iterable[str]) -> bool:
    """Whether a claim holds by some of these grades and is contradicted by others.

    >>> disagree([CONTRADICTED, REPRODUCED, UNDECIDABLE]), disagree([CONTRADICTED, UNDECIDABLE])
    (True, False)
    """
    found = set(grades)
    return CONTRADICTED in found and bool(found & {REPRODUCED, DIRECTION})


def margin_of(rows: Iterable[Row]) -> str:
    """Return in words how many tests hold, and by which factor the tightest of the tests passes or misses its bar.

    >>> margin_of([Row("a", grade=REPRODUCED, margin=2.0), Row("b", grade=DIRECTION, margin=0.5), Row("c")])
    '1 of 2 tests hold; b misses its bar by a factor of 2'
    """
    tests = [row for row in rows if row.tested]
    text = f"{sum(row.grade == REPRODUCED for row in tests)} of {len(tests)} tests hold"
    tightest = min(tests, key=lambda row: (GRADES.index(row.grade), row.margin))
    if not isfinite(tightest.margin) or tightest.margin <= 0:
        return text
    passes = tightest.margin >= 1
    factor = max(tightest.margin, 1 / tightest.margin)
    return (
        f"{text}; {tightest.quantity} {'passes' if passes else 'misses'} its bar by a factor of {factor:.3g}"
    )
