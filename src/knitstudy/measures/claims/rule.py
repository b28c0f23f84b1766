"""By what a claim is judged: the rule in words, when it was fixed, and where to look."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from knitstudy.measures.claims.evidence import Evidence, Judgement

BEFORE, AFTER, UNRECORDED = "before its numbers", "after its numbers", "not on record"
"""When a rule was fixed."""


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
    """

    judge: Callable[[Evidence], Judgement]
    words: str
    fixed: str
    see: tuple[str, ...]
