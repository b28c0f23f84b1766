"""The force that stresses carry through a knit, which has to be that of the grips.

Whatever balances satisfies, for every function phi(x) that is constant at both grips, with its derivative psi,

    integral of sigma_xx psi dv = F * integral of psi dx :

stresses averaged over a slab with the weight psi give the force through it. Contact adds nothing where yarns touch, for
both sides of it lie at one place.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.contacts.segments import KINDS, NO_SEGMENT, centre
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.load_path import DIRECTIONS

SLAB = 0.4
"""Width of the slab that a force through a cut is averaged over, as share of the knit along the load: about a cell."""


def cut_force(stresses: xr.Dataset, share: float) -> float:
    """Return the force through a cut across the load, at a share of the deformed knit along it [N].

    The weight is psi = 1 + cos over a slab about the cut: smooth, so that what balances in the mean of elements
    balances here.

    Parameters
    ----------
    stresses : Dataset
        In the format of docs/architecture.md.
    share : float
        From 0 to 1; the slab should lie between the grips.
    """
    axis = DIRECTIONS.index(stresses.attrs["direction"])
    place = stresses["cell_place"].to_numpy()[:, axis]
    length = np.ptp(place)
    away = (place - place.min() - share * length) / (SLAB * length)
    weight = np.where(np.abs(away) < 0.5, 1 + np.cos(2 * np.pi * away), 0.0)
    stress = stresses["cell_stress"].to_numpy()[:, axis]  # xx, yy, zz come first
    return float(np.sum(stress * stresses["cell_volume"].to_numpy() * weight) / (SLAB * length))


def cell_force(stresses: xr.Dataset, knit: Knit) -> float:
    """Return the force through the centre column or row of cells, from the mean stresses of its pieces of yarn [N].

    With psi constant over one period of the knit: mean stress times volume, summed over the pieces of the period, over
    its deformed length. That is as exact as the cells beside it are like it.

    Parameters
    ----------
    stresses : Dataset
        In the format of docs/architecture.md.
    knit : Knit
    """
    axis = DIRECTIONS.index(stresses.attrs["direction"])
    share = _in_column(stresses, knit) if axis == 0 else _in_row(stresses, knit)
    whole = stresses.sel(extent="whole")
    carried = whole["piece_stress"].to_numpy()[:, axis, axis] * whole["piece_volume"].to_numpy()
    period = (knit.loop.wale_spacing, knit.loop.course_spacing)[axis]
    return float(carried @ share) / (period * (1 + stresses.attrs["strain"]))


def _in_column(stresses: xr.Dataset, knit: Knit) -> np.ndarray:
    """Return the share (P,) of every piece that lies in the centre column, from sinker to sinker."""
    s, loop = stresses["piece_arc_length"].to_numpy(), knit.centrelines[0].length / knit.loops
    first = centre(np.arange(knit.loops)) * loop
    inside = np.minimum(s[:, 1], first + loop) - np.maximum(s[:, 0], first)
    return np.clip(inside, 0, None) / np.diff(s, axis=1)[:, 0]


def _in_row(stresses: xr.Dataset, knit: Knit) -> np.ndarray:
    """Return the share (P,) of every piece that lies in the centre row: half of the legs to it and from it."""
    row, segment = centre(np.arange(knit.rows)), stresses["piece_segment"].to_numpy()
    inside = segment != NO_SEGMENT
    kind = np.where(inside, stresses["segment_kind"].to_numpy()[segment], NO_SEGMENT)
    at = np.where(inside, stresses["segment_row"].to_numpy()[segment], NO_SEGMENT)
    leg = np.isin(kind, [KINDS.index("leg, left"), KINDS.index("leg, right")])
    share = np.where(leg, 0.5 * ((at == row) | (at == row - 1)), 1.0 * (inside & (at == row)))
    # Cut ends of the upper yarn are halves of its sinkers.
    s, yarn = stresses["piece_arc_length"].to_numpy(), stresses["piece_yarn"].to_numpy()
    cut = (s[:, 0] == 0) | np.isclose(s[:, 1], knit.centrelines[0].length, rtol=1e-12)
    return np.where(cut & (yarn == row + 1), 1.0, share)
