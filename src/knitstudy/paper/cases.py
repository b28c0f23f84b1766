"""The four cases in which models are compared (Fig. 15), and the numbers that the paper prints.

The cases are ties and isotropic friction, in course and in wale tension; their scenes go by the names of
`paper.scene_names`. Printed numbers are from ``resources/reference/paper_tables.csv``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import astuple, dataclass

import numpy as np
import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.knit.scene.scene import Scene
from knitstudy.measures import response
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import HEXAHEDRA, Reference, discretisation, made_of, reference_of
from knitstudy.mechanics.beams.laws import LAWS
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.paper.columns import FORCE, RMS_U_Z, SECANT, STRAIN, U_Z, Rows, Simulation
from knitstudy.paper.scene_names import (
    BEAM_MODELS,
    CASES,
    INTERACTIONS,
    NETWORKS,
    OTHER_SOLIDS,
    REDUCED,
    SOLIDS,
    model_name,
    of_case,
    of_cases,
)
from knitstudy.run.catalogue import StageResults

MODELS = of_cases(CASES, (*SOLIDS, *OTHER_SOLIDS, *BEAM_MODELS, *REDUCED))  # Names of all simulations

# Values of keys that make a reduced model a variant, in words.
WORDS = {
    "printed": "printed joints",
    "pinned": "pinned joints",
    "patch": "yielding joints",
    "centreline": "springs of centrelines",
    "doubled": "doubled segments",
    "resultant": "normals with friction",
    "mean_resultant": "shared normals with friction",
    "mean_normal_resultant": "shared normals",
    "closest_points": "normals of closest points",
}
VARIED = ("rom.joint", "rom.normal", "rom.displacement", "rom.section")  # Those keys
LAWS_OF_SECTIONS = {"rom3d": "straight", "beam": "curved"}  # Of the main models, by fidelity

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
    name = model_name(scene.kind.fidelity)
    if scene.kind.direct:
        return f"{name}, {made_of(scene)}"
    section = scene.value("beam.section")
    words = [LAWS.find(section).label if section else None, TIES.get(scene.value("beam.tie"))]
    words += [WORDS.get(scene.value(key)) for key in VARIED]
    law = scene.value("mesh.section_law")
    words.append(f"sections of {law} rods" if law != LAWS_OF_SECTIONS.get(scene.fidelity, law) else None)
    if source := scene.value("rom.stress_from"):
        words.append(f"by principal stress of {source.rpartition('-')[2]} tension")
    words.append("springs of other tension" if scene.value("rom.springs_from") else None)
    words.append(SPRINGS.get((bool(scene.value("rom.stiffness")), scene.value("rom.axes"))))
    return ", ".join(filter(None, [name, *words]))


def plain(beams: Iterable[Simulation]) -> list[Simulation]:
    """Return the beams that touch at a pair of points between rigid sections, with rigid ties."""
    return [row for row in beams if (row.scene.value("beam.section"), row.scene.value("beam.tie")) == PLAIN]


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
        meshes = [
            model for model in direct if discretisation(model.scene.value("mesh")) == HEXAHEDRA["one_point"]
        ]
        return min(meshes, key=lambda model: model.scene.value("mesh.size"), default=None)

    def name_of(self, model: Simulation) -> str:
        """Return the name of a model: "DNS" of the main direct simulation."""
        return "DNS" if model is self.dns else label_of(model.scene)

    # What tables, figures and claims say of a model beside the reference, at the largest strain that both reach

    def ratio(self, model: Simulation) -> Estimate:
        """Return the force, and so the secant stiffness, over the reference's."""
        return self.reference.force_ratio(model.history)

    def distance(self, model: Simulation) -> Estimate:
        """Return the L2 distance of the force to the reference, relative."""
        return self.reference.force_distance(model.history)

    def amplitude(self, model: Simulation) -> Estimate:
        """Return the root mean square of u_z over the reference's."""
        return self.reference.ratio(model.history, response.RMS_U_Z, model[RMS_U_Z])

    def shape(self, model: Simulation) -> float:
        """Return the correlation of u_z, whose shape has no reference, with the direct simulation."""
        return response.out_of_plane_correlation(model.history, self.dns.history)


def cases_of(rows: Rows, reference: pd.DataFrame) -> Iterator[Case]:
    """Yield the cases of which there is a direct simulation."""
    simulated = {name: row.scene for name, row in rows.items() if "simulation" in row.results}

    def taken(case: str, names: Iterable[str], several: bool = True) -> tuple[Simulation, ...]:
        results = StageResults("simulation", of_case(case, names), several)
        return tuple(rows[scene.name] for scene in results.scenes(simulated))

    for case in CASES:
        for dns in taken(case, SOLIDS, several=False):
            main = {fidelity: taken(case, names, several=False) for fidelity, names in NETWORKS.items()}
            interaction, direction = case.split("-")
            yield Case(
                interaction,
                direction,
                dns=dns,
                others=tuple(model for model in taken(case, OTHER_SOLIDS) if model is not dns),
                reduced=taken(case, REDUCED),
                main={fidelity: models[0] for fidelity, models in main.items() if models},
                beams=taken(case, BEAM_MODELS),
                reference=reference_of(reference, dns.scene),
            )


OVER_REFERENCE, UNCERTAIN = "force over the reference's [1]", "uncertainty of that ratio [1]"
COMPARED = [
    *(STRAIN.head, FORCE.head, SECANT.head, OVER_REFERENCE, UNCERTAIN),
    *("L2 distance of force to the reference [1]", "uncertainty of that distance [1]"),
    *(U_Z.head, "amplitude of u_z over the reference's [1]", "uncertainty of that amplitude [1]"),
    "correlation of u_z with DNS [1]",
]


def comparison(model: Simulation, case: Case) -> dict[str, float]:
    """Return the response of a model at its largest strain and its distance from the reference (`COMPARED`)."""
    ratio, distance, amplitude = (of(model) for of in (case.ratio, case.distance, case.amplitude))
    values = [model[STRAIN], model[FORCE], model[SECANT], *astuple(ratio), *astuple(distance), model[U_Z]]
    return dict(zip(COMPARED, [*values, *astuple(amplitude), case.shape(model)], strict=True))


# Cases of the paper's Table 5 by fidelity, in its order.
REPORTED = {"dns": "dns-tie 3x3", "rom2d": "rom2d 3x3", "rom3d": "rom3d 3x3"}
COLUMNS = ("table", "case", "quantity", "value", "unit", "note")


def reported(paper: pd.DataFrame, table: str, case: str, quantity: str) -> pd.Series:
    """Return the one row of a quantity; DataFileError when the quantity is not there, or more than once."""
    missing = [name for name in COLUMNS if name not in paper]
    if missing:
        raise DataFileError(
            f"table of the paper's numbers: has no column {missing[0]!r}; needed are {COLUMNS}"
        )
    rows = _printed(paper, table, case, quantity)
    if len(rows) != 1:
        raise DataFileError(
            f"table of the paper's numbers: table {table!r}, case {case!r}, quantity {quantity!r} is there "
            f"{len(rows)} times; it must be there once"
        )
    return rows.iloc[0]


def numbers(paper: pd.DataFrame, table: str, case: str, quantity: str) -> Floats:
    """Return numbers that are printed together, for example the angles of a line to x, y and z."""
    row = reported(paper, table, case, quantity)
    try:
        return np.array([float(part) for part in str(row["value"]).split()])
    except ValueError as error:
        raise DataFileError(
            f"table of the paper's numbers: {row['quantity']!r} is {row['value']!r}; it must be numbers"
        ) from error


def number(paper: pd.DataFrame, table: str, case: str, quantity: str) -> float:
    """Return a printed number in its unit."""
    return float(numbers(paper, table, case, quantity)[0])


def angles_of_stress(paper: pd.DataFrame, direction: str) -> Floats:
    """Return the angles of the maximum principal stress in segments 1 to 6 to x, y and z (6, 3) in Table 4 [deg]."""
    quantities = [f"segments 1..6 angle to {axis}" for axis in "xyz"]
    return np.stack([numbers(paper, "4", f"mps-{direction}", name) for name in quantities], axis=-1)


def angles_by_geometry(paper: pd.DataFrame) -> Floats:
    """Return the angles of segments 1 to 6 by geometry to x, y and z (6, 3) in Table 4 [deg]."""
    segments = ("1", "2 and 3", "2 and 3", "4 and 5", "4 and 5", "6")
    return np.stack([numbers(paper, "4", "rom2d", f"segment {each} angles to x y z") for each in segments])


def number_if_printed(paper: pd.DataFrame, table: str, case: str, quantity: str) -> float:
    """Return a number in its unit, nan where the paper prints none."""
    return number(paper, table, case, quantity) if len(_printed(paper, table, case, quantity)) else np.nan


def _printed(paper: pd.DataFrame, table: str, case: str, quantity: str) -> pd.DataFrame:
    rows = paper[paper["quantity"] == quantity]
    return rows[(rows["table"].astype(str) == table) & (rows["case"] == case)]
