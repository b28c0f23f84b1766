"""The four cases in which models are compared (Fig. 15): ties and isotropic friction, in course and in wale tension.

The scenes of a case go by the names of `measures.catalogue`. Models are compared with the reference by the columns of
`comparison`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase

import pandas as pd
import xarray as xr

from knitstudy.measures.catalogue import BEAM_MODELS, NETWORKS, OTHER_SOLIDS, SOLIDS, VARIANTS, of_case
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

CASES = ("tie-course", "tie-wale", "isotropic-course", "isotropic-wale")
"""Interaction and direction, as in the names of scenes."""

MODELS = tuple(
    name
    for case in CASES
    for name in of_case(
        case, (*SOLIDS, *OTHER_SOLIDS, *VARIANTS, *BEAM_MODELS, *NETWORKS["rom3d"], *NETWORKS["rom2d"])
    )
)
"""Names of all simulations of the four cases."""

# ---- names of models ----

WORDS = {
    "printed": "printed joints",
    "pinned": "pinned joints",
    "patch": "yielding joints",
    "zones": "springs by crossing",
    "centreline": "springs of centrelines",
    "doubled": "doubled segments",
    "straight": "sections of straight rods",
}
"""Values of keys that make a reduced model a variant, in words."""

CARRIED, GIVEN, ALONG_AXES = "springs of other tension", "springs of Table 2", "springs along x, y, z"

SECTIONS = {"rigid": "rigid", "hertz": "Hertzian"}
"""Sections of beams in contact, by ``beam.section``."""

TIES = {"pinned": "pinned", "patch": "yielding ties"}
"""Ties of beams in contact that are not rigid, by ``beam.tie``."""

PLAIN = ("rigid", "rigid")
"""Section and ties of the simplest model of beams in contact."""


def label_of(scene: Scene) -> str:
    """Return the name of a model beside others of its case: its fidelity, and what makes it a variant."""
    name = NAMES.get(scene.fidelity) or scene.kind.fidelity.meaning
    if is_direct(scene):
        return f"{NAMES['dns']}, {made_of(scene)}"
    if scene.fidelity == "beam":
        words = [name, "point contact", SECTIONS[scene.beam.section]]
        words += [TIES[scene.beam.tie]] if scene.beam.tie in TIES else []
        return ", ".join(words + [WORDS[law] for law in [scene.mesh.section_law] if law in WORDS])
    keys = ("rom.joint", "rom.springs", "rom.displacement", "rom.section", "mesh.section_law")
    words = [WORDS[value] for value in map(scene.value, keys) if value in WORDS]
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
    """Whether beams touch at a pair of points between rigid sections, with rigid ties."""
    return (scene.beam.section, scene.beam.tie) == PLAIN


# ---- cases ----


@dataclass(frozen=True)
class Simulation:
    """A scene and its history."""

    scene: Scene
    history: xr.Dataset

    @property
    def label(self) -> str:
        """Name of the model (`label_of`)."""
        return label_of(self.scene)


@dataclass(frozen=True)
class Case:
    """A direct simulation, other models of the same problem, and the reference that all are compared with.

    Attributes
    ----------
    interaction, direction : str
    dns : Simulation
    others : tuple of Simulation
        Direct simulations with other elements or meshes.
    reduced : tuple of Simulation
        All reduced models made from `dns`.
    main : mapping of str to Simulation
        The main reduced models by fidelity, "rom3d" and "rom2d".
    beams : tuple of Simulation
        The same knit as beams in contact.
    reference : Reference
        Reference of the problem; it may be empty.
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
        """The direct simulation with one-point hexahedra, the paper's element, on the finest mesh."""
        direct = (self.dns, *self.others)
        found = [model for model in direct if discretisation(model.scene) == HEXAHEDRA["one_point"]]
        return min(found, key=lambda model: model.scene.mesh.size, default=None)

    def name_of(self, model: Simulation) -> str:
        """Return the name of a model: "DNS" of the main direct simulation."""
        return "DNS" if model is self.dns else model.label


def first_of(names: Iterable[str], known: Iterable[str]) -> str | None:
    """Return the first of several names of scenes that is known, if there is one."""
    return next((name for name in names if name in known), None)


def cases_of(
    histories: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], reference: pd.DataFrame
) -> Iterator[Case]:
    """Yield the cases of which there is a direct simulation.

    Parameters
    ----------
    histories : mapping of str to Dataset
        By scene.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    """
    every = [Simulation(scenes[name], history) for name, history in histories.items()]
    models = {model.scene.name: model for model in every}
    for case in CASES:
        name = first_of(of_case(case, SOLIDS), models)
        if name is None:
            continue

        def matching(patterns: Iterable[str], case: str = case, but: str = name) -> tuple[Simulation, ...]:
            wanted = of_case(case, patterns)
            return tuple(
                model
                for model in every
                if model.scene.name != but and any(fnmatchcase(model.scene.name, each) for each in wanted)
            )

        main = {fidelity: first_of(of_case(case, names), models) for fidelity, names in NETWORKS.items()}
        yield Case(
            *case.split("-"),
            dns=models[name],
            others=matching(OTHER_SOLIDS),
            reduced=tuple(model for model in every if model.scene.value("rom.contacts_from") == name),
            main={fidelity: models[each] for fidelity, each in main.items() if each},
            beams=matching(BEAM_MODELS),
            reference=reference_of(reference, scenes[name]),
        )


# ---- comparison with the reference ----

OVER_REFERENCE, DISTANCE = "force over the reference's [1]", "L2 distance of force to the reference [1]"
AMPLITUDE = "amplitude of u_z over the reference's [1]"
SHAPE = "correlation of u_z with DNS [1]"

UNCERTAIN = {
    OVER_REFERENCE: "uncertainty of that ratio [1]",
    DISTANCE: "uncertainty of that distance [1]",
    AMPLITUDE: "uncertainty of that amplitude [1]",
}
"""Columns of uncertainties by the column of the value."""

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
    """Return the response of a model at its largest strain and its distance from the reference, by column.

    Ratios are at the largest strain of the reference that the history reaches. The shape of u_z, of which there is no
    reference, is compared with the direct simulation of the case.
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
