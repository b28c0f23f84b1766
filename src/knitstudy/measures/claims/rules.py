"""All rules by which claims are judged."""

from __future__ import annotations

from knitstudy.measures.claims import contact, kinematics, models, unit_cell
from knitstudy.measures.claims.rule import Rule

RULES: dict[str, Rule] = {
    **unit_cell.RULES,
    **contact.RULES,
    **kinematics.RULES,
    **models.RULES,
}
"""By the claim's id."""
