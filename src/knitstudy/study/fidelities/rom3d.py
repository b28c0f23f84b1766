"""Spatial reduced model: a network of beams with ties or springs at the contacts (Figs. 5 and 6)."""

from knitstudy.study.kinds import FIDELITIES, Fidelity, Interaction, Sections
from knitstudy.study.sections.gates import Gates
from knitstudy.study.sections.interaction import Tie
from knitstudy.study.sections.mesh import BeamMesh
from knitstudy.study.sections.rom import SpatialJoints, Springs
from knitstudy.study.sections.solver import Newton


def sections(interaction: Interaction) -> Sections:
    """Return the sections of a scene: springs where yarns touch, ties of some size where they are all tied."""
    joints = {"rom": Springs} if interaction.touches else {"tie": Tie, "rom": SpatialJoints}
    return {"mesh": BeamMesh, "solver": Newton, "gates": Gates, **joints}


FIDELITIES.register(
    Fidelity(
        name="rom3d",
        meaning="a spatial network of beams",
        specimens=("knit",),
        sections=sections,
        stage="rom",
        sources=("rom.contacts_from", "rom.springs_from"),
    )
)
