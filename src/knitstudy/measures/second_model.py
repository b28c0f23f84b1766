"""How far off a result is, by another model of the same scene whose own error is known to be bounded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.measures.questions import QUESTIONS, answers
from knitstudy.study.scene import Scene

Result = tuple[Scene, xr.Dataset, xr.Dataset | None]
"""Scene, history, and contacts of a direct simulation."""


@dataclass(frozen=True)
class Comparison:
    """What two results of one scene say of the first one's error.

    Attributes
    ----------
    quantity : str
        In which they differ most.
    least, most : float
        Between which the error of the first lies, if that of the second is bounded as assumed [1].
    """

    quantity: str
    least: float
    most: float

    def judged(self, accuracy: float, by: str) -> str:
        """Return in words whether an accuracy was kept, by what model that was seen."""
        said = f"{self.quantity} is off by {self.least:.1%} to {self.most:.1%}, by {by}"
        if self.least > accuracy:
            return f"warning: {said}: more than the {accuracy:.2g} that was asked for; ask for less, or name a model"
        return f"{said}: as asked for" + ("" if self.most <= accuracy else ", but not for certain")


def compare(question: str, one: Result, other: Result, error: float) -> Comparison | None:
    """Return between which bounds the error of one result lies, or None where both answer nothing alike.

    With d = |a / b - 1| and b off the truth by at most e, a is off by at most d (1 + e) + e, and at least by
    d (1 - e) - e.

    Parameters
    ----------
    question : str
        One of `questions.QUESTIONS`.
    one, other : tuple of Scene, Dataset, Dataset or None
        The result to judge, and the one that it is compared with.
    error : float
        What the other one is off by at most [1].
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
