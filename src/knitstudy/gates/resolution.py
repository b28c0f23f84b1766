"""Elements must be small against the yarn."""

from __future__ import annotations

from collections.abc import Mapping

from knitstudy.errors import MeshError

ELEMENTS_ACROSS: Mapping[str, float] = {"knit": 3.0, "pair": 7.0}
"""Fewest elements across a yarn by specimen: a knit bends, a pair that is pressed together is only indented."""


def fewest_across(specimen: str, refinement: float) -> float:
    """Return how many elements must lie across a yarn: of a pair fewer where they are smaller at the crossing.

    Parameters
    ----------
    specimen : str
    refinement : float
        ``mesh.refinement``.
    """
    return max(ELEMENTS_ACROSS["knit"], ELEMENTS_ACROSS[specimen] / refinement)


def require_elements_across(diameter: float, size: float, fewest: float) -> None:
    """Refuse elements that are too large for the yarn: sections deform, and yarns touch, in too few places.

    Parameters
    ----------
    diameter, size : float
        ``yarn.diameter`` and ``mesh.size`` [m].
    fewest : float
        Elements of that size across the yarn that are allowed, ``gates.elements_across``.

    Raises
    ------
    MeshError
        If there are fewer.
    """
    across = diameter / size
    # Rounded: a yarn of five elements is one in whatever unit of length.
    if round(across, 6) < fewest:
        raise MeshError(
            f"mesh.size is {size:g} m, {across:.2g} elements across a yarn.diameter of {diameter:g} m; "
            f"gates.elements_across asks for {fewest:g}: use {diameter / fewest:.3g} m or less, or ask for fewer"
        )
