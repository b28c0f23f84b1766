"""Direct numerical simulation: solid yarns."""

from knitstudy.study.kinds import FIDELITIES, Fidelity, Interaction, Sections
from knitstudy.study.sections.gates import HexahedralGates
from knitstudy.study.sections.interaction import SolidContact, Tie
from knitstudy.study.sections.mesh import SolidMesh
from knitstudy.study.sections.solver import HexahedralNewton


def sections(interaction: Interaction) -> Sections:
    """Return the sections of a scene: those of contact where yarns are not all tied."""
    contact = {"contact": interaction.contact(SolidContact)} if interaction.touches else {}
    return {"mesh": SolidMesh, "tie": Tie, **contact, "solver": HexahedralNewton, "gates": HexahedralGates}


FIDELITIES.register(
    Fidelity(
        name="dns",
        meaning="solid yarns",
        specimens=("knit", "pair"),
        sections=sections,
        stage="dns",
        solids="knitstudy.models.hexahedra",
        stress="knitstudy.models.stress",
        outputs=("fields", "vtu", "deck"),
    )
)
