"""Pins that yield as the tied patches of two yarns do (`mechanics.rod_patch`)."""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.rod_patch import local_compliance
from knitstudy.networks.rom.points import JointPoints
from knitstudy.study.sections.yarn import Yarn

SMALLEST, LARGEST = 0.1, 0.6
"""Radius of a patch over that of the yarn: waves to resolve a smaller one are many, a larger one is not local."""


def patch_stiffness(knit: Knit, points: JointPoints, contacts: xr.Dataset, yarn: Yarn) -> np.ndarray:
    """Return the stiffness matrices (K, 3, 3) [N/m] of the tied patches of all crossings.

    Tied areas are alike in size: their mean is taken. The two yarns yield one after the other, each along the contact
    normal, along itself and across.

    Raises
    ------
    DataFileError
        If the contacts have no ties, or of a size that this is not for.
    """
    tied = contacts["tied"].to_numpy() > 0 if "tied" in contacts else np.ones(len(points.yarn), dtype=bool)
    area = contacts["area"].to_numpy()[tied].mean() if tied.any() else 0.0
    size = round(float(np.sqrt(area / np.pi)) / yarn.radius, 3)
    if not SMALLEST <= size <= LARGEST:
        raise DataFileError(
            f"ties have a radius of {size:g} yarn radii, but rom.joint 'patch' needs {SMALLEST} to {LARGEST}: use "
            "such a tie.radius, contacts of a dns scene with ties of such a size, or rom.joint 'pinned'"
        )
    normal = contacts["normal"].to_numpy()
    compliance = np.zeros((len(normal), 3, 3))
    for number, centreline in enumerate(knit.centrelines):
        crossing, side = np.nonzero(points.yarn == number)
        frame = _frames(normal[crossing], centreline.tangent(points.arc_length[crossing, side]))
        each = frame.swapaxes(1, 2) @ (np.array(local_compliance(size, yarn.poisson_ratio))[:, None] * frame)
        np.add.at(compliance, crossing, each)
    return yarn.youngs_modulus * yarn.radius * np.linalg.inv(compliance)


def _frames(normal: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Rows (k, 3, 3): normal, along the yarn in the tangent plane, across both."""
    across = np.cross(normal, tangent)
    across /= np.linalg.norm(across, axis=1)[:, None]
    return np.stack([normal, np.cross(across, normal), across], axis=1)
