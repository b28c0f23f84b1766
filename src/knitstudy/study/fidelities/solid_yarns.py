"""Solid yarns as polynomials over the section times splines along the yarn: few unknowns, no elements across."""

from knitstudy.study.kinds import FIDELITIES, Fidelity, Interaction, Sections
from knitstudy.study.sections.gates import SolidGates
from knitstudy.study.sections.interaction import Tie
from knitstudy.study.sections.polynomial_contact import PolynomialContact
from knitstudy.study.sections.polynomial_mesh import PolynomialMesh
from knitstudy.study.sections.solver import SolidNewton


def sections(interaction: Interaction) -> Sections:
    """Return the sections of a scene: those of contact where yarns are not all tied."""
    contact = {"contact": interaction.contact(PolynomialContact)} if interaction.touches else {}
    return {"mesh": PolynomialMesh, "tie": Tie, **contact, "solver": SolidNewton, "gates": SolidGates}


FIDELITIES.register(
    Fidelity(
        name="solid_yarns",
        meaning="solid yarns of polynomials",
        specimens=("knit", "cut_knit", "pair", "cell"),
        sections=sections,
        stage="dns",
        solids="knitstudy.models.spline_yarns",
        stress="knitstudy.models.stress",
        outputs=("fields", "vtu"),
    )
)
