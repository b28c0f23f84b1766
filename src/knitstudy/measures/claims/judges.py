"""All judges of claims."""

from __future__ import annotations

from collections.abc import Callable

from knitstudy.measures.claims import contact, kinematics, models, stress, unit_cell
from knitstudy.measures.claims.evidence import Evidence, Judgement

JUDGES: dict[str, Callable[[Evidence], Judgement]] = {
    **unit_cell.JUDGES,
    **contact.JUDGES,
    **kinematics.JUDGES,
    **models.JUDGES,
    **stress.JUDGES,
}
"""By the claim's id; claims without a judge are not yet run."""
