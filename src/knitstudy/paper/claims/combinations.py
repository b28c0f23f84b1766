"""Combinations of readings: under which most claims hold together, and which claims exclude each other.

Readings of one choice (for example of the joints) exclude each other; a combination takes the base or one reading of
every choice. A claim that no reading of the combination touches has the verdict of the base. A claim that one reading
touches has the verdict under that reading. A claim that several readings touch needs a simulation with all of them and
stays open.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product

from knitstudy.paper.claims.scale import REPRODUCED
from knitstudy.paper.claims.verdicts import READING, Finding

OPEN = "open: several readings of the combination touch the claim"


@dataclass(frozen=True)
class Combination:
    """Findings of one reading of every choice; the base is none of them."""

    base: Finding
    findings: tuple[Finding, ...]

    @cached_property
    def verdicts(self) -> dict[str, str]:
        """Verdict of every claim."""
        return {claim: self._verdict(claim) for claim in self.base.judged}

    def _verdict(self, claim: str) -> str:
        touching = [finding for finding in self.findings if claim in finding.touched]
        if len(touching) > 1:
            return OPEN
        return (touching or [self.base])[0].judged[claim].verdict

    @property
    def holding(self) -> frozenset[str]:
        """Claims that are reproduced."""
        return frozenset(claim for claim, verdict in self.verdicts.items() if verdict == REPRODUCED)

    @property
    def counts(self) -> Counter[str]:
        """Number of claims by verdict."""
        return Counter(self.verdicts.values())


def combinations_of(findings: Sequence[Finding]) -> list[Combination]:
    """Return the combinations of all readings that a study has, those under which most claims hold first."""
    base, *others = findings
    choices: dict[str, list[tuple[Finding, ...]]] = {}
    for finding in others:
        if finding.reading.kind == READING and finding.evidence is not None:
            choices.setdefault(finding.reading.choice, [()]).append((finding,))
    combined = [Combination(base, sum(chosen, ())) for chosen in product(*choices.values())]
    return sorted(combined, key=lambda combination: (-len(combination.holding), len(combination.findings)))


def exclusive(combined: Sequence[Combination]) -> Iterator[tuple[str, str]]:
    """Yield the pairs of claims that both hold under some combination, but under none together."""
    together = {combination.holding for combination in combined}
    for pair in combinations(combined[0].base.judged, 2):
        if all(any(claim in holding for holding in together) for claim in pair) and not any(
            {*pair} <= holding for holding in together
        ):
            yield pair
