"""A window of solid yarns in a knit of beams: contact of a few cells of a large knit."""

from knitstudy.study.kinds import FIDELITIES, Fidelity, Interaction, Sections
from knitstudy.study.sections.interaction import Tie
from knitstudy.study.sections.polynomial_contact import PolynomialContact
from knitstudy.study.sections.solver import Newton
from knitstudy.study.sections.window import Window, WindowGates, WindowMesh


def sections(interaction: Interaction) -> Sections:
    """Return the sections of a scene: those of contact where yarns are not all tied."""
    contact = {"contact": interaction.contact(PolynomialContact)} if interaction.touches else {}
    return {
        "mesh": WindowMesh,
        "tie": Tie,
        **contact,
        "solver": Newton,
        "gates": WindowGates,
        "window": Window,
    }


FIDELITIES.register(
    Fidelity(
        name="window",
        meaning="solid yarns of polynomials in a few cells of a network of beams",
        specimens=("knit",),
        sections=sections,
        stage="window",
        sources=("window.springs_from",),
    )
)
