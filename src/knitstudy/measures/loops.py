"""Loops that cannot be made, from the kept table of `knitstudy.geometry.reach`."""

from __future__ import annotations

import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.geometry.reach import FOUND

SWEPT = ("course ratio [1]", "yarn diameter [m]")
NEEDED = ("held fixed", "outcome", *SWEPT)


def refused(loops: pd.DataFrame, column: str, scale: float) -> pd.DataFrame:
    """Return the loops that cannot be made along one sweep: what is held fixed, and the swept value as ``at``.

    Parameters
    ----------
    loops : DataFrame
        ``resources/reference/loops.csv``.
    column : str
        One of `SWEPT`; the other one is as drawn.
    scale : float
        Factor of its values.

    Raises
    ------
    DataFileError
        When a column is missing.
    """
    missing = [name for name in NEEDED if name not in loops]
    if missing:
        raise DataFileError(
            f"the table of loops has no column {missing[0]!r}; make it again with `python -m knitstudy.geometry.reach`"
        )
    (other,) = (name for name in SWEPT if name != column)
    along = loops[loops[other] == loops[other].mode()[0]]
    lost = along[along["outcome"] != FOUND]
    return pd.DataFrame({"held fixed": lost["held fixed"], "at": scale * lost[column]})
