"""Points of the box of config/trade.yaml: the knits of the sample, drawn by a Sobol sequence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import floor, inf
from typing import Any

from scipy.stats.qmc import Sobol

from knitstudy.run.advice.sample import LARGE, Case, Inputs, Trade


def points_of(trade: Trade) -> Iterator[Inputs]:
    """Yield points of the box without end, the same ones every time."""
    sampler = Sobol(len(trade.box) + 1, seed=trade.seed)
    while True:
        for *shares, slips in sampler.random(64):
            point = {name: _between(trade.box[name], u) for name, u in zip(trade.box, shares, strict=True)}
            yield Inputs(**point | {"friction": point["friction"] if slips < 0.5 else inf})


def _between(ends: list[Any], share: float) -> Any:
    """Return the value of a box at a share of the way: even, of texts one of them, of whole numbers one."""
    low, high = ends[0], ends[-1]
    if isinstance(low, str) or (isinstance(low, int) and isinstance(high, int)):
        choices = ends if isinstance(low, str) else range(low, high + 1)
        return choices[min(floor(share * len(choices)), len(choices) - 1)]
    return float(f"{low + share * (high - low):.4g}")


def drawn(trade: Trade, case: Case, point: Inputs) -> Inputs:
    """Return the inputs of a case at a point of the box; a large strain lies in its range as the small one does."""
    low, high = trade.box["strain"]
    first, last = trade.large.strain
    strain = first + (last - first) * (point.strain - low) / (high - low)
    return replace(point, strain=float(f"{strain:.4g}")) if case.strains == LARGE else point
