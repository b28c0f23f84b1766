"""What a scene is called, of which kind it is, and what is written of it."""

from __future__ import annotations

from knitstudy.study.keys import SceneName, Section, key
from knitstudy.study.kinds import FIDELITIES, INTERACTIONS, SPECIMENS


class Labels(Section):
    """Name and kind of a scene."""

    name: SceneName = key(
        "a name of at most 200 small letters, digits, - and _, that starts with a letter",
        standing="choice",
        source="names files",
        checked="none",
    )

    knit: SceneName = key(
        "the label of the knit or pair; scenes with one label share one geometry (at most 200 small letters, digits,"
        " - and _)",
        standing="choice",
        source="names files",
        checked="none",
    )

    specimen: str = key(
        SPECIMENS.allowed,
        standing="choice",
        source=(
            "the paper simulates knits, whose yarns it does not say to be whole at the upper and the lower edge: of a"
            " cut_knit the outer ones are not; two crossing yarns are a case of verification, a cell stands for an"
            " endless knit"
        ),
        checked="all",
    )

    fidelity: str = key(
        FIDELITIES.allowed,
        standing="choice",
        source="sections 2.3 to 2.6 of the paper: DNS, 3D ROM, 2D ROM; section 3.3: beams in contact",
        checked="all",
    )

    interaction: str = key(
        INTERACTIONS.allowed,
        standing="stated",
        source="section 2.2, Fig. 2 and Table 1: tie constraint, rough contact, isotropic Coulomb friction",
        checked="all three",
    )

    outputs: tuple[str, ...] = key(
        "a list of what is written besides, for example [fields, vtu]",
        standing="choice",
        source="what is written; no result depends on it",
        checked="all",
    )
