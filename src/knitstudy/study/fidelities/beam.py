"""The knit as beams in contact (Fig. 12b). Tied beams are a spatial reduced model."""

from knitstudy.study.kinds import FIDELITIES, Fidelity, Interaction, Sections
from knitstudy.study.sections.beam import Beam
from knitstudy.study.sections.gates import Gates
from knitstudy.study.sections.interaction import Tie, TiedEdges
from knitstudy.study.sections.mesh import BeamMesh
from knitstudy.study.sections.solver import Newton


def sections(interaction: Interaction) -> Sections:
    """Return the sections of a scene."""
    return {
        "mesh": BeamMesh,
        "tie": Tie,
        "contact": interaction.contact(TiedEdges),
        "solver": Newton,
        "gates": Gates,
        "beam": Beam,
    }


FIDELITIES.register(
    Fidelity(
        name="beam",
        meaning="beams in contact",
        specimens=("knit",),
        sections=sections,
        stage="beams",
        tied=False,
    )
)
