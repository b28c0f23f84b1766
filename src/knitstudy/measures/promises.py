"""Whether a model that was chosen for an accuracy keeps it: on other knits, and beside a second model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.measures.estimate import UNKNOWN, Estimate
from knitstudy.measures.questions import QUESTIONS, answers, known
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import QUANTITIES, at_strain
from knitstudy.study.scene import Scene

BAR, DEAREST = 0.95, 3.0  # Least share of promises that hold, largest cost over the cheapest


@dataclass(frozen=True)
class Promise:
    """One scene and question: the accuracy that was asked for, and the error [1] of the model that was taken.

    `quantity` is the one with this error, the largest; `seconds` and `cheapest` are the time of the model and of the
    cheapest one that would have done. `other` says whether the true value is from another model: else a promise
    always holds.
    """

    scene: str
    question: str
    model: str
    accuracy: float
    error: Estimate
    quantity: str
    seconds: float
    cheapest: float
    other: bool = True

    @property
    def held(self) -> bool:
        """Whether the error is within the accuracy, whatever its uncertainty."""
        return self.error.value <= self.accuracy

    @property
    def surely(self) -> bool | None:
        """The same with the uncertainty; None where it leaves that open."""
        return self.error.below(self.accuracy)


def corrected(
    reference: Reference,
    base: tuple[xr.Dataset, xr.Dataset],
    here: tuple[xr.Dataset, xr.Dataset],
    strain: float,
) -> Reference:
    """Return the results of a knit without a reference, corrected by the error of their discretisation elsewhere.

    `base` and `here` are histories and contacts of one discretisation, the former of a problem with a reference: the
    error is taken to be the same. The uncertainty is that of the reference and half of the correction
    (docs/notes/reference.md). Where degrees 2 and 3 were both run, at the ends of both sweeps, the corrections differ
    by 0.7 % in force and 4 % in out-of-plane motion at most.
    """
    found = {}
    for quantity, (_, values) in QUANTITIES.items():
        true = known(reference, quantity, strain)
        if not true.known:
            continue
        there, ours = (at_strain(each[0], strain, values(*each)) for each in (base, here))
        if ours <= 0 or there <= 0:
            continue
        ratio = true.value / there
        open_share = true.uncertainty / true.value + 0.5 * abs(ratio - 1)
        found[quantity, strain] = Estimate(ratio * ours, open_share * ratio * ours)
    return Reference(found)


def error_made(
    question: str,
    scene: Scene,
    history: xr.Dataset,
    contacts: xr.Dataset | None,
    truth: Reference,
    strain: float,
) -> tuple[str, Estimate]:
    """Return the quantity of a question with the largest error of a model, and this error [1], unknown if none is."""
    found = []
    for quantity, value in answers(QUESTIONS[question], scene, history, contacts, strain).items():
        true = known(truth, quantity, strain)
        if true.known and np.isfinite(value):
            found.append((quantity, true.of(lambda other, value=value: abs(value / other - 1))))
    return max(found, key=lambda each: each[1].value, default=("", UNKNOWN))


Result = tuple[Scene, xr.Dataset, xr.Dataset | None]  # Scene, history, and contacts of a direct simulation


@dataclass(frozen=True)
class Comparison:
    """Bounds [1] of the error of a result from a second one, in the quantity in which both differ most."""

    quantity: str
    least: float
    most: float

    def judged(self, accuracy: float, by: str) -> str:
        """Return in words whether an accuracy was kept, with the name of the second model."""
        said = f"{self.quantity} is off by {self.least:.1%} to {self.most:.1%}, by {by}"
        if self.least > accuracy:
            return f"warning: {said}: more than the {accuracy:.2g} that was asked for; ask for less, or name a model"
        return f"{said}: as asked for" + ("" if self.most <= accuracy else ", but not for certain")


def compare(question: str, one: Result, other: Result, error: float) -> Comparison | None:
    """Return bounds of the error of one result, or None where both have no answer in common.

    With d = |a / b - 1| and an error of b of at most e, the error of a is between d (1 - e) - e and d (1 + e) + e.
    """
    strain = one[0].load.strain
    mine, theirs = (answers(QUESTIONS[question], *result, strain) for result in (one, other))
    apart = {
        quantity: abs(value / theirs[quantity] - 1)
        for quantity, value in mine.items()
        if theirs.get(quantity, 0.0) > 0 and np.isfinite(value)
    }
    if not apart:
        return None
    quantity = max(apart, key=apart.__getitem__)
    d = apart[quantity]
    return Comparison(quantity, max(0.0, d * (1 - error) - error), d * (1 + error) + error)
