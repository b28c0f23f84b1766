"""All tables by name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from knitstudy.measures.catalogue import Catalogue

if TYPE_CHECKING:
    import pandas as pd

TABLES = Catalogue("table", "knitstudy.tables")


def tabulate(name: str, **sources: Any) -> pd.DataFrame:
    """Build a table from its sources.

    Raises ConfigurationError when there is no such table, or something that it needs is missing.
    """
    return TABLES.make(name, **sources)
