"""The four cases in which models are compared (Fig. 15): ties and isotropic friction, in course and in wale tension.

The scenes of a case go by the names of `run.catalogue`. Models are compared with the reference by the columns of
`comparison`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import pandas as pd
import xarray as xr

from knitstudy.knit.scene.scene import Scene
from knitstudy.measures import response
from knitstudy.measures.reference import (
    HEXAHEDRA,
    INTERACTIONS,
    Reference,
    discretisation,
    is_direct,
    made_of,
    reference_of,
)
from knitstudy.mechanics.beams.laws import LAWS
from knitstudy.run.catalogue import (
    BEAM_MODELS,
    CASES,
    NETWORKS,
    OTHER_SOLIDS,
    REDUCED,
    SOLIDS,
    Datasets,
    Results,
    Scenes,
    of_case,
    of_cases,
)

MODELS = of_cases(CASES, (*SOLIDS, *OTHER_SOLIDS, *BEAM_MODELS, *REDUCED))  # Names of all simulations

# Values of keys that make a reduced model a variant, in words.
WORDS = {
    "printed": "printed joints",
    "pinned": "pinned joints",
    "patch": "yielding joints",
    "centreline": "springs of centrelines",
    "doubled": "doubled segments",
    "straight": "sections of straight rods",
    "resultant": "normals with friction",
    "mean_resultant": "shared normals with friction",
    "mean_normal_resultant": "shared normals",
    "closest_points": "normals of closest points",
}

CARRIED = "springs of other tension"
# Springs by whether their stiffness is given, and by their axes
SPRINGS = {
    (True, "global"): "springs of Table 2",
    (True, "local"): "springs of Table 2, local axes",
    (False, "global"): "springs along x, y, z",
}
TIES = {"pinned": "pinned", "patch": "yielding ties"}  # Ties that are not rigid, by ``beam.tie``
PLAIN = ("rigid", "rigid")  # Section and ties of the simplest model of beams in contact


def label_of(scene: Scene) -> str:
    """Return the name of a model among others of its case: its fidelity, and the keys of a variant."""
    if is_direct(scene):
        return f"{scene.kind.fidelity.label}, {made_of(scene)}"
    if scene.fidelity == "beam":
        words = [LAWS.find(scene.beam.section).label, TIES.get(scene.beam.tie)]
        words.append(WORDS.get(scene.mesh.section_law))
    else:
        keys = (
            "rom.joint",
            "rom.normal",
            "rom.displacement",
            "rom.section",
            "mesh.section_law",
        )
        words = [WORDS.get(scene.value(key)) for key in keys]
        if source := scene.value("rom.stress_from"):
            words.append(f"by principal stress of {source.rpartition('-')[2]} tension")
        words.append(CARRIED if scene.value("rom.springs_from") else None)
        words.append(SPRINGS.get((bool(scene.value("rom.stiffness")), scene.value("rom.axes"))))
    name = scene.kind.fidelity.label
    return ", ".join(filter(None, [name, *words]))


def is_plain(scene: Scene) -> bool:
    """Whether beams touch at a pair of points between rigid sections, with rigid ties."""
    return (scene.beam.section, scene.beam.tie) == PLAIN


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

    `others` are direct simulations with other elements or meshes, `reduced` all reduced models made from `dns`, `main`
    the main ones of these by fidelity ("rom3d", "rom2d"), `beams` the same knit as beams in contact.
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
        meshes = [model for model in direct if discretisation(model.scene) == HEXAHEDRA["one_point"]]
        return min(meshes, key=lambda model: model.scene.mesh.size, default=None)

    def name_of(self, model: Simulation) -> str:
        """Return the name of a model: "DNS" of the main direct simulation."""
        return "DNS" if model is self.dns else model.label


def cases_of(histories: Datasets, scenes: Scenes, reference: pd.DataFrame) -> Iterator[Case]:
    """Yield the cases of which there is a direct simulation; histories and scenes go by the same names."""
    simulated = {name: scenes[name] for name in histories}

    def simulations(case: str, names: Iterable[str], several: bool = True) -> tuple[Simulation, ...]:
        results = Results("simulation", of_case(case, names), several)
        return tuple(Simulation(scene, histories[scene.name]) for scene in results.scenes(simulated))

    for case in CASES:
        for dns in simulations(case, SOLIDS, several=False):
            main = {name: simulations(case, names, several=False) for name, names in NETWORKS.items()}
            yield Case(
                *case.split("-"),
                dns=dns,
                others=tuple(run for run in simulations(case, OTHER_SOLIDS) if run.scene is not dns.scene),
                reduced=simulations(case, REDUCED),
                main={name: models[0] for name, models in main.items() if models},
                beams=simulations(case, BEAM_MODELS),
                reference=reference_of(reference, dns.scene),
            )


OVER_REFERENCE, DISTANCE = "force over the reference's [1]", "L2 distance of force to the reference [1]"
AMPLITUDE = "amplitude of u_z over the reference's [1]"
SHAPE = "correlation of u_z with DNS [1]"

# Columns of uncertainties by the column of the value.
UNCERTAIN = {
    OVER_REFERENCE: "uncertainty of that ratio [1]",
    DISTANCE: "uncertainty of that distance [1]",
    AMPLITUDE: "uncertainty of that amplitude [1]",
}

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

    Ratios are at the largest strain of the reference that the history reaches; the shape of u_z, which has no
    reference, is compared with the direct simulation of the case.
    """
    row = {
        "strain [1]": float(history["strain"][-1]),
        "force [N]": float(history["force"][-1]),
        "secant stiffness [N/m]": response.secant_stiffness(history),
        "largest |u_z| [m]": response.largest_out_of_plane(history),
        SHAPE: response.out_of_plane_correlation(history, dns),
    }
    estimates = {
        OVER_REFERENCE: reference.force_ratio(history),
        DISTANCE: reference.force_distance(history),
        AMPLITUDE: reference.ratio(history, response.RMS_U_Z, response.rms_out_of_plane(history)),
    }
    for column, estimate in estimates.items():
        row |= {column: estimate.value, UNCERTAIN[column]: estimate.uncertainty}
    return row
