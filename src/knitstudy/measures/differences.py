"""Differences between two results: keys of their scenes, quantities side by side, variables to the last bit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from numbers import Real
from typing import Any

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.measures.summary import kind_of, summarise

MISSING = "-"  # stands for a key or a quantity that only the other result has


def pairs(first: Mapping, second: Mapping) -> Iterator[tuple[Any, Any, Any]]:
    """Yield the keys of two mappings with both values."""
    for key in first | second:
        yield key, first.get(key, MISSING), second.get(key, MISSING)


def side_by_side(first: xr.Dataset, second: xr.Dataset) -> Iterator[tuple]:
    """Yield name, both values, second over first, and unit of all numbers of two results, and of texts that differ.

    Raises DataFileError when the results are of different kinds, or are none.
    """
    if (kind := kind_of(first)) != (other := kind_of(second)):
        raise DataFileError(f"is a {other} and cannot be compared with a {kind}")
    quantities = ({(row.name, row.unit): row.value for row in summarise(data)} for data in (first, second))
    for (name, unit), a, b in pairs(*quantities):
        numbers = isinstance(a, Real) and isinstance(b, Real)
        if numbers or a != b:
            yield name, a, b, float(b) / float(a) if numbers and a else "", unit


def differing_variables(first: xr.Dataset, second: xr.Dataset) -> list[str]:
    """Return the variables, but for times, that are not the same to the last bit or that one result has alone."""

    def same(a: Any, b: Any) -> bool:
        if not isinstance(a, xr.Variable) or not isinstance(b, xr.Variable):
            return False
        values = np.asarray(a), np.asarray(b)
        return a.dims == b.dims and len({(v.shape, v.dtype.kind, v.tobytes()) for v in values}) == 1

    both = pairs(dict(first.variables), dict(second.variables))
    return [name for name, a, b in both if getattr(a, "attrs", {}).get("units") != "s" and not same(a, b)]
