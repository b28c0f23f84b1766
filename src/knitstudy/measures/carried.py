"""What a direct simulation says of a problem without a reference: as uncertain as its discretisation is elsewhere."""

from __future__ import annotations

import xarray as xr

from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import FORCE, LARGEST_U_Z, QUANTITIES, at_strain, common_strain

CARRIED = (FORCE, LARGEST_U_Z)
"""Quantities of which it speaks."""


def carried_over(known: Reference, base: xr.Dataset, history: xr.Dataset) -> Reference:
    """Return force and largest |u_z| of a history with the uncertainty that its discretisation has where it is known.

    That is by how much the base is off the reference, and the uncertainty of this, added, over the reference: it is
    taken to be the same with another value of an input.

    Parameters
    ----------
    known : Reference
        Of the problem of `base`.
    base, history : Dataset
        Histories of one discretisation and one interaction, of which inputs differ; they may be the same.

    Returns
    -------
    Reference
        At those strains of the reference that both reach; nothing where it knows nothing.
    """
    reached, found = common_strain([base, history]), {}
    for quantity in CARRIED:
        _, values = QUANTITIES[quantity]
        here, there = (values(each, each) for each in (history, base))
        for strain in known.strains(quantity, reached):
            true = known.at(quantity, strain)
            off = (abs(at_strain(base, strain, there) - true.value) + true.uncertainty) / true.value
            value = at_strain(history, strain, here)
            found[quantity, strain] = Estimate(value, off * value)
    return Reference(found)
