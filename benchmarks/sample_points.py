"""Points of the box of config/trade.yaml: the knits of the sample, drawn by a Sobol sequence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import floor, inf
from typing import Any

from scipy.stats.qmc import Sobol

from knitstudy.run.advice.sample import SMALL, TOUCHING, Inputs, SampleCase, Trade

SLIPS = 0.5  # Share of the knits whose yarns slip at small strains, too


def points_of(trade: Trade) -> Iterator[tuple[Inputs, bool]]:
    """Yield points of the box, and whether their yarns slip, without end, the same ones every time."""
    sampler = Sobol(len(trade.box) + 1, seed=trade.seed)
    while True:
        for *shares, slips in sampler.random(64):
            point = {name: _between(trade.box[name], u) for name, u in zip(trade.box, shares, strict=True)}
            yield Inputs(**point), slips < SLIPS


def _between(ends: list[Any], share: float) -> Any:
    """Return the value of a box at a share of the way: even, of texts one of them, of whole numbers one."""
    low = ends[0]
    high = ends[-1]
    if isinstance(low, str) or (isinstance(low, int) and isinstance(high, int)):
        choices = ends if isinstance(low, str) else range(low, high + 1)
        return choices[min(floor(share * len(choices)), len(choices) - 1)]
    return float(f"{low + share * (high - low):.4g}")


def drawn(trade: Trade, case: SampleCase, point: Inputs, slips: bool) -> Inputs:
    """Return the inputs of a case at a point of the box; a large strain lies in its range as the small one does.

    Yarns that touch slip at large strains, and at small ones where the point says so.
    """
    if case.path == SMALL:
        return point if slips or case.yarns != TOUCHING else replace(point, friction=inf)
    low, high = trade.box["strain"]
    first, last = trade.strains(case)
    strain = first + (last - first) * (point.strain - low) / (high - low)
    return replace(point, strain=float(f"{strain:.4g}"))
