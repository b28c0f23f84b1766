"""One simulation and one question: how far off it is, and what it costs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from knitstudy.measures.cost import Expense
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.knobs import called, model_of
from knitstudy.measures.questions import Question
from knitstudy.study.scene import Scene

REFERENCE = "reference"
"""What an error is to, where no two models bracket the quantity."""

TIES = "ties in place of contact"
"""What models are called that tie yarns which touch and stick."""


@dataclass(frozen=True)
class Point:
    """One simulation and one question.

    Attributes
    ----------
    scene : Scene
    interaction : str
        Of the problem: that of the scene, or contact that sticks, for which its ties stand in.
    question : Question
    quantity : str
        That of those which answer the question whose error may be the largest.
    strain : float
        Where it is compared.
    true : Estimate
        What it is compared with.
    source : str
        `REFERENCE`, or the models that bracket it.
    error : Estimate
        |value / true - 1| [1].
    expense : Expense
    answers : mapping of str to float
        Values of all quantities that answer the question, there.
    floor : float
        Error below which it counts as luck [1] (`measures.luck`).
    """

    scene: Scene
    interaction: str
    question: Question
    quantity: str
    strain: float
    true: Estimate
    source: str
    error: Estimate
    expense: Expense
    answers: Mapping[str, float]
    floor: float = 0.0

    @property
    def value(self) -> float:
        """Of the quantity."""
        return self.answers[self.quantity]

    @property
    def bound(self) -> float:
        """The error and its uncertainty, and no less than luck: what it is at most."""
        return max(self.error.value + self.error.uncertainty, self.floor)

    @property
    def stands_in(self) -> bool:
        """Whether its yarns are tied where those of the problem touch."""
        return self.interaction != self.scene.interaction

    @property
    def model(self) -> str:
        """What its model is called (`knobs.model_of`)."""
        return self._said(model_of(self.scene))

    @property
    def called(self) -> str:
        """The same with the knobs that are turned (`knobs.called`)."""
        return self._said(called(self.scene))

    def no_surer_than(self, bound: float) -> Point:
        """Return it with a floor that is no lower than some error."""
        return replace(self, floor=max(self.floor, bound))

    def _said(self, model: str) -> str:
        return f"{TIES}, {model}" if self.stands_in else model
