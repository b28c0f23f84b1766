"""Planar reduced model: a honeycomb of beams (Fig. 4)."""

from knitstudy.study.kinds import FIDELITIES, Fidelity, Interaction, Sections
from knitstudy.study.sections.gates import Gates
from knitstudy.study.sections.rom import PlanarJoints
from knitstudy.study.sections.solver import Newton


def sections(interaction: Interaction) -> Sections:
    """Return the sections of a scene: yarns are joined whatever the interaction."""
    return {"solver": Newton, "gates": Gates, "rom": PlanarJoints}


FIDELITIES.register(
    Fidelity(
        name="rom2d",
        meaning="a planar honeycomb of beams",
        specimens=("knit",),
        sections=sections,
        stage="rom",
        sources=("rom.contacts_from", "rom.stress_from"),
    )
)
