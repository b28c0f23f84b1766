"""The endless knit: force between clamps, limit of square knits as they grow, and moduli of the shell.

Between grips an endless knit cannot contract where it is held, and a sheet that is stiffer across than along carries
that far; in between it necks, which turns its sides into the pull. The sheet is homogeneous and hyperelastic, with the
energy over area e M e / 2 of the stretches e = U - 1 (polar decomposition F = R U, shear doubled); `models.strip`
pulls it. docs/notes/periodic_cell.md compares it with knits.

As a shell, N = A e + B k and M = B^T e + D k with the strains of `knitstudy.mechanics.periodic`; the stiffness (6, 6)
is [[A, B], [B^T, D]], in N/m, N and N m (Jones 1999, Mechanics of Composite Materials, chapters 2 and 4).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from knitstudy.loading.history import DIRECTIONS
from knitstudy.mechanics.membrane_law import StretchLaw
from knitstudy.models.strip import stretch_strip
from knitstudy.study.scene import Scene

ELEMENTS = 24  # Elements in either direction: twice as many change the factor of a square knit by 2e-4


def held_over_free(
    membrane: np.ndarray, length: float, width: float, strain: float, elements: int = ELEMENTS
) -> float:
    """Return the force of a sheet that grips hold across at both ends, over that in free tension at the same strain.

    The sheet of a length and width [m] has forces per width by strains `membrane` (3, 3) [N/m], the first along the
    pull, the second across, without coupling to shear. The strain is the displacement of the grips over the length;
    there are `elements` in either direction.
    Raises ConvergenceError if Newton's method finds no equilibrium.
    """
    law = StretchLaw(np.asarray(membrane, dtype=float))
    sheet = stretch_strip(law, length, width, strain, elements=elements, increments=1)
    (along, coupling), across = law.membrane[0, :2], law.membrane[1, 1]
    return float(sheet["force_per_width"][-1] / ((along - coupling**2 / across) * strain))


MOST = 4  # Number of the largest knits through which a limit is sought

# Scene of one cell of the endless knit, free across, by the series of square knits
# (`measures.cost.SERIES`).
CELLS = {
    "domain-yarns-tie-course": "cell-course",
    "domain-yarns-tie-wale": "cell-wale",
}


def limit(cells: Sequence[int], values: Sequence[float]) -> tuple[float, float]:
    """Return the limit of values as knits grow, and its uncertainty from the choice of knits and law.

    Edges are the 1 / n-th part of a knit of n cells in a row, corners the square of that. Of a + b / n through the
    largest two, three and four knits, and a + b / n + c / n^2 through the largest four, the middle of the least and
    the largest a is the limit, half of their distance its uncertainty. Three knits or more, in rising order.
    """
    part, values = 1 / np.asarray(cells, dtype=float)[-MOST:], np.asarray(values, dtype=float)[-MOST:]
    limits = [np.polyfit(part[-count:], values[-count:], 1)[1] for count in range(2, len(part) + 1)]
    limits.append(np.polyfit(part, values, 2)[2])
    return (min(limits) + max(limits)) / 2, (max(limits) - min(limits)) / 2


def between_grips(history: xr.Dataset, scene: Scene, increment: int) -> float:
    """Return the factor by which the force of a cell grows in a large square knit, whose grips hold it across.

    The cell is tied and free across. The stiffness of the sheet is the mean of the cell's along its path: in free
    tension the sheet has the force and the contraction of the cell at that strain.
    """
    axis = DIRECTIONS.index(scene.load.deformation)
    order = [axis, 1 - axis, 2]
    way = history.isel(increment=slice(None, increment + 1))
    strain = way["strain"].to_numpy()
    mean = np.trapezoid(way["tangent_per_width"].to_numpy(), strain, axis=0) / strain[-1]
    membrane = 0.5 * (mean + mean.T)[np.ix_(order, order)]
    sides = np.array([scene.pattern.wale_spacing, scene.pattern.course_spacing])[order[:2]]
    return held_over_free(membrane, *sides, float(strain[-1]))


# Force per width over strain, free of force in all other components, and Poisson's ratios of both pulls.
MODULI = (
    "course modulus at rest [N/m]",
    "wale modulus at rest [N/m]",
    "shear modulus at rest [N/m]",
    "Poisson's ratio of course tension at rest [1]",
    "Poisson's ratio of wale tension at rest [1]",
)


def moduli(membrane: np.ndarray) -> dict[str, float]:
    """Return `MODULI` from forces per width by strains in the plane (3, 3) [N/m]."""
    compliance = np.linalg.inv(membrane)
    along = np.diag(compliance)
    contractions = (-compliance[1, 0] / along[0], -compliance[0, 1] / along[1])
    return dict(zip(MODULI, (*(1 / along), *contractions), strict=True))
