"""The four cases in which models are compared (Fig. 15), and the columns of a comparison with the reference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd
import xarray as xr

from knitstudy.measures.catalogue import (
    BEAM_MODELS,
    CASES,
    NETWORKS,
    OTHER_SOLIDS,
    SOLIDS,
    of_case,
    one,
    reduced_models,
    several,
)
from knitstudy.measures.discretisation import (
    HEXAHEDRA,
    INTERACTIONS,
    NAMES,
    discretisation,
    is_direct,
    made_of,
)
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.measures.response import (
    RMS_U_Z,
    largest_out_of_plane,
    out_of_plane_correlation,
    rms_out_of_plane,
    secant_stiffness,
)
from knitstudy.study.scene import Scene

# ---- A model beside the reference, by the columns that tables have in common


OVER_REFERENCE, DISTANCE = "force over the reference's [1]", "L2 distance of force to the reference [1]"
AMPLITUDE = "amplitude of u_z over the reference's [1]"
SHAPE = "correlation of u_z with DNS [1]"

UNCERTAIN = {
    OVER_REFERENCE: "uncertainty of that ratio [1]",
    DISTANCE: "uncertainty of that distance [1]",
    AMPLITUDE: "uncertainty of that amplitude [1]",
}
"""Columns of the uncertainties that the reference brings, by what they belong to."""

COMPARED = [
    "strain [1]",
    "force [N]",
    "secant stiffness [N/m]",
    OVER_REFERENCE,
    UNCERTAIN[OVER_REFERENCE],
    DISTANCE,
    UNCERTAIN[DISTANCE],
    "largest |u_z| [m]",
    AMPLITUDE,
    UNCERTAIN[AMPLITUDE],
    SHAPE,
]


def comparison(history: xr.Dataset, dns: xr.Dataset, reference: Reference) -> dict[str, float]:
    """Return what a model does at its largest strain and how far from the reference it is, by column.

    Ratios are at the largest strain that both reach. The reference is of numbers: shapes of u_z are compared with the
    direct simulation.

    Parameters
    ----------
    history : Dataset
        Of the model (see docs/files.md).
    dns : Dataset
        Of the direct simulation of its case.
    reference : Reference
        Of the problem.
    """
    row = {
        "strain [1]": float(history["strain"][-1]),
        "force [N]": float(history["force"][-1]),
        "secant stiffness [N/m]": secant_stiffness(history),
        "largest |u_z| [m]": largest_out_of_plane(history),
        SHAPE: out_of_plane_correlation(history, dns),
    }
    estimates = {
        OVER_REFERENCE: reference.force_ratio(history),
        DISTANCE: reference.force_distance(history),
        AMPLITUDE: reference.ratio(history, RMS_U_Z, rms_out_of_plane(history)),
    }
    for column, estimate in estimates.items():
        row |= {column: estimate.value, UNCERTAIN[column]: estimate.uncertainty}
    return row


# ---- The four cases that models are compared in: ties and isotropic friction, in course and in wale tension (Fig. 15)


VARIANTS = {
    "printed": "printed joints",
    "pinned": "pinned joints",
    "patch": "yielding joints",
    "zones": "springs by crossing",
    "centreline": "springs of centrelines",
    "doubled": "doubled segments",
    "straight": "sections of straight rods",
}
"""What a value of a reduced model's keys is called where it makes a variant."""

CARRIED, GIVEN, ALONG_AXES = "springs of other tension", "springs of Table 2", "springs along x, y, z"

SECTIONS = {"rigid": "rigid", "hertz": "Hertzian"}
"""What beams in contact are made of, by ``beam.section``."""

TIES = {"pinned": "pinned", "patch": "yielding ties"}
"""What ties of beams in contact are called, by ``beam.tie``, that are not rigid."""


PLAIN = ("rigid", "rigid")
"""Contact, section and ties of the model that ingredients are added to."""


@dataclass(frozen=True)
class Simulation:
    """A simulation: its scene and its history."""

    scene: Scene
    history: xr.Dataset

    @property
    def label(self) -> str:
        """What it is called beside the other models of a case."""
        return label_of(self.scene)


@dataclass(frozen=True)
class Case:
    """A direct simulation, other models of the same problem, and the reference that all are compared with.

    Attributes
    ----------
    interaction, direction : str
    dns : Simulation
    others : tuple of Simulation
        Direct simulations of the same by other elements, or on other meshes.
    reduced : tuple of Simulation
        All reduced models made from it.
    main : mapping of str to Simulation
        Those that are no variants, by fidelity, "rom3d" and "rom2d".
    beams : tuple of Simulation
        The same knit as beams in contact.
    reference : Reference
        Of the problem; it may know nothing.
    """

    interaction: str
    direction: str
    dns: Simulation
    others: tuple[Simulation, ...]
    reduced: tuple[Simulation, ...]
    main: Mapping[str, Simulation]
    beams: tuple[Simulation, ...]
    reference: Reference

    @property
    def label(self) -> str:
        """Interaction and direction in words."""
        return f"{INTERACTIONS[self.interaction]}, {self.direction}"

    @property
    def by_hexahedra(self) -> Simulation | None:
        """The direct simulation by the paper's element, on the finest of its meshes, if there is one."""
        direct = (self.dns, *self.others)
        found = [model for model in direct if discretisation(model.scene) == HEXAHEDRA["one_point"]]
        return min(found, key=lambda model: model.scene.mesh.size, default=None)

    def name_of(self, model: Simulation) -> str:
        """Return what one of the models is called: "DNS" the main direct simulation."""
        return "DNS" if model is self.dns else model.label


def cases_of(
    every: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], reference: pd.DataFrame
) -> Iterator[Case]:
    """Yield the cases of which there is a direct simulation.

    Parameters
    ----------
    every : mapping of str to Dataset
        Histories of knits by scene (see docs/files.md).
    scenes : mapping of str to Scene
        Their scenes by the same names, in the order of the families.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    """
    known = {name: scene for name, scene in scenes.items() if name in every}

    def first(case: str, names: Sequence[str]) -> list[Simulation]:
        return [
            Simulation(scene, every[scene.name]) for scene in one("", *of_case(case, names)).scenes(known)
        ]

    def matching(patterns: Sequence[str]) -> tuple[Simulation, ...]:
        found = several("", *patterns).scenes(known)
        return tuple(Simulation(scene, every[scene.name]) for scene in found)

    for case in CASES:
        for dns in first(case, SOLIDS):
            interaction, direction = case.split("-")
            others = matching(of_case(case, OTHER_SOLIDS))
            yield Case(
                interaction=interaction,
                direction=direction,
                dns=dns,
                others=tuple(each for each in others if each.scene.name != dns.scene.name),
                reduced=matching(reduced_models(case)),
                main={name: model for name, names in NETWORKS.items() for model in first(case, names)},
                beams=matching(of_case(case, BEAM_MODELS)),
                reference=reference_of(reference, dns.scene),
            )


def label_of(scene: Scene) -> str:
    """Return what a model is called beside others of its case: its fidelity, and what makes it a variant."""
    name = NAMES.get(scene.fidelity) or scene.kind.fidelity.meaning
    if is_direct(scene):
        return f"{NAMES['dns']}, {made_of(scene)}"
    if scene.fidelity == "beam":
        words = [name, "point contact", SECTIONS[scene.beam.section]]
        words += [TIES[scene.beam.tie]] if scene.beam.tie in TIES else []
        return ", ".join(words + [VARIANTS[law] for law in [scene.mesh.section_law] if law in VARIANTS])
    keys = ("rom.joint", "rom.springs", "rom.displacement", "rom.section", "mesh.section_law")
    words = [VARIANTS[value] for value in map(scene.value, keys) if value in VARIANTS]
    if scene.value("rom.stress_from"):
        words.append(f"by principal stress of {scene.rom.stress_from}")
    if scene.value("rom.springs_from"):
        words.append(CARRIED)
    if scene.value("rom.stiffness"):
        words.append(GIVEN)
    elif scene.value("rom.axes") == "global":
        words.append(ALONG_AXES)
    return ", ".join([name, *words])


def is_plain(scene: Scene) -> bool:
    """Whether beams touch at a pair of points between rigid sections, and ties hold sections as the paper's do."""
    return (scene.beam.section, scene.beam.tie) == PLAIN
