"""Measures of the local kinematics at crossings (Fig. 10), from contacts."""

from __future__ import annotations

import numpy as np
import xarray as xr


def rotation_angle(contacts: xr.Dataset) -> np.ndarray:
    """Return the angles (I, K, 2) by which sections have turned [rad]."""
    return np.linalg.norm(contacts["section_rotation"].to_numpy(), axis=-1)


def closest_neighbour(contacts: xr.Dataset) -> np.ndarray:
    """Return how much a crossing has come closer (I, K, 2) to one of its two neighbours on the yarn.

    The share of the chord, to that neighbour which comes closer at the last increment. Chords across the arcs of
    loops lie along the courses and lengthen in course tension; the other neighbour is at the far end of a leg, or is
    the other crossing of the same interlock.
    """
    contraction = contacts["segment_contraction"].to_numpy()
    most = np.argmax(np.nan_to_num(contraction[-1], nan=-np.inf), axis=-1)
    return np.take_along_axis(contraction, most[None, ..., None], axis=-1)[..., 0]
