"""A strip of fabric between clamps, and the same fabric free across: membranes with a law of their cell.

Clamps hold both components of all nodes along their edges; one of them is driven. A membrane carries compression
across, where a fabric wrinkles: the least principal force of the strip says how much, and of a strip under tension it
is small.
"""

from __future__ import annotations

from math import ceil

import numpy as np
import xarray as xr

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.load_path import trace
from knitstudy.mechanics.membrane import MembraneLaw, MembraneModel, rectangle

ELEMENTS = 16  # in either direction: twice as many change forces by 3e-4 (docs/notes/membrane.md)
INCREMENT = 0.02  # largest increment of strain, of 5 increments at least
NEVER = 10**9  # iterations: viscous flows find nothing in a membrane that halved increments do not


def stretch_strip(
    law: MembraneLaw,
    length: float,
    width: float,
    strain: float,
    axis: int = 0,
    clamped: bool = True,
    elements: int = ELEMENTS,
    increments: int | None = None,
    largest_force: float = np.inf,
) -> xr.Dataset:
    """Return forces and widths of a strip of a length and width [m] that is pulled to a strain.

    It is pulled in course (`axis` 0) or wale direction (1). Strains are displacements over the length between the
    clamps, forces per width refer to the undeformed edge. Without clamps the strip is free across, as an endless
    fabric is: one element, whose ends stay straight. The pull ends early at the largest force per width [N/m].
    Raises ConvergenceError if Newton's method finds no equilibrium; its `history` is the strip so far.
    """
    if not clamped:
        elements = 1
    sides = (length, width)
    nodes, quads, number = rectangle(sides, (elements, elements), degree=2 if clamped else 1)
    nodes = nodes if axis == 0 else nodes[:, ::-1]
    model = MembraneModel(nodes, quads, law)
    along, across = (2 * number + component for component in (axis, 1 - axis))
    ends = [along[0], along[-1], *((across[0], across[-1]) if clamped else (across[0, :1],))]
    fixed = np.concatenate(ends)
    value = np.where(np.isin(fixed, along[-1]), strain * length, 0.0)
    many = increments or max(5, ceil(abs(strain) / INCREMENT))
    settings = Settings(increments=many, vain=NEVER)
    middle, rows, failure = across[number.shape[0] // 2], [], None
    try:
        for increment in trace(model, PrescribedDisplacement(fixed, value), settings, LU()):
            moved = increment.state.ravel()
            inner = model.principal_forces(increment.state)
            force = increment.response.force[along[-1]].sum() / width
            waist = 1 + (moved[middle[-1]] - moved[middle[0]]) / width
            rows.append((increment.load * strain, force, waist, inner[..., 0].min(), inner[..., 1].max()))
            if force >= largest_force:
                break
    except ConvergenceError as error:
        failure = ConvergenceError(
            f"a strip of {length:.4g} x {width:.4g} m finds no equilibrium at a strain of {strain:g}: {error}"
        )
        failure.__cause__ = error
    strip = xr.Dataset(
        {
            name: ("increment", curve, about)
            for (name, about), curve in zip(VARIABLES.items(), np.transpose(rows), strict=True)
        },
        attrs={"length": length, "width": width, "axis": axis, "clamped": int(clamped)},
    ).set_coords("strain")
    if failure is not None:
        failure.history = strip
        raise failure
    return strip


VARIABLES = {
    "strain": {"units": "1", "long_name": "displacement of the clamps over the length"},
    "force_per_width": {"units": "N/m", "long_name": "force over undeformed width"},
    "waist": {"units": "1", "long_name": "width half way between the clamps over width at rest"},
    "least_force": {"units": "N/m", "long_name": "least principal force per deformed width"},
    "largest_force": {"units": "N/m", "long_name": "largest principal force per deformed width"},
}


WRINKLES = 0.05  # compression over the largest tension from which a strip is said to wrinkle


def strain_at(strip: xr.Dataset, force: np.ndarray) -> np.ndarray:
    """Return the strains at forces per width (k,) [N/m] of a strip, nan beyond its last.

    Examples
    --------
    >>> strip = xr.Dataset({"force_per_width": [0.0, 10.0], "strain": [0.0, 0.2]})
    >>> strain_at(strip, np.array([5.0, 20.0])).tolist()
    [0.1, nan]
    """
    return np.interp(force, strip["force_per_width"], strip["strain"], right=np.nan)
