"""By what a claim is judged: the rule in words, when it was fixed, and where to look."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from knitstudy.measures.claims.evidence import NOT_REPRODUCED, NOT_RUN, OPEN, REPRODUCED, Evidence, Judgement

BEFORE, AFTER, UNRECORDED = "before its numbers", "after its numbers", "not on record"
"""When a rule was fixed."""

AGAIN = "by other discretisations"
"""The uncertainty of a claim that no reference decides: whether it would be decided likewise."""

OF_REFERENCE = "of the reference, beside the values"

OF_COSTS = "unknowns are exact; memory and time are of one run each, on one machine"


@dataclass(frozen=True)
class Rule:
    """How a claim is judged.

    Attributes
    ----------
    judge : callable
        From all evidence to what was measured, and the verdict.
    words : str
        What has to hold for "reproduced".
    fixed : str
        When it was: `BEFORE`, `AFTER` or `UNRECORDED`.
    see : tuple of str
        Figures and tables that show it.
    uncertainty : str
        Where that of the verdict comes from: `AGAIN`, `OF_REFERENCE`, `OF_COSTS`, or in other words.
    """

    judge: Callable[[Evidence], Judgement]
    words: str
    fixed: str
    see: tuple[str, ...]
    uncertainty: str

    def decide(self, evidence: Evidence) -> Judgement:
        """Judge, by other discretisations too where their difference is the uncertainty: they have to agree."""
        judged = self.judge(evidence)
        if judged.verdict not in (REPRODUCED, NOT_REPRODUCED):
            return judged
        if self.uncertainty != AGAIN:
            return replace(judged, uncertainty=self.uncertainty)
        others = {made: self.judge(other) for made, other in evidence.again.items()}
        others = {made: other for made, other in others.items() if other.verdict != NOT_RUN}
        if not others:
            return replace(judged, uncertainty="not known: one discretisation alone")
        said = "; ".join(f"{made}: {other.verdict}, {other.measured}" for made, other in others.items())
        agreed = all(other.verdict == judged.verdict for other in others.values())
        return replace(judged, verdict=judged.verdict if agreed else OPEN, uncertainty=said)
