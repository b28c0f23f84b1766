"""Names of the scenes that the paper's figures, tables and claims take, and the paper's words for their models."""

from __future__ import annotations

from collections.abc import Iterable

from knitstudy.knit.scene.kinds import FidelityModel
from knitstudy.run.catalogue import StageResults, one

# The paper's words
INTERACTIONS = {"tie": "tie constraint", "rough": "rough contact", "isotropic": "isotropic friction"}
MODEL_NAMES = {"rom3d": "3D ROM", "rom2d": "2D ROM", "beam": "beams"}  # beside solids, which are all DNS

# The four cases in which models are compared (Fig. 15): interaction and direction of the load.
CASES = ("tie-course", "tie-wale", "isotropic-course", "isotropic-wale")
# The direct simulation of a case that the others are compared with, in order of preference.
SOLIDS = ("yarns-{case}", "dns-{case}", "dns-{case}-coarse")

# The main reduced models of a case, likewise.
NETWORKS = {
    "rom3d": ("rom3d-{case}", "rom3d-{case}-coarse"),
    "rom2d": ("rom2d-{case}", "rom2d-{case}-coarse"),
}

# Direct simulations of the same case by other elements or on other meshes.
OTHER_SOLIDS = ("yarns-{case}-p3", "dns-{case}", "dns-{case}-medium", "yarns-{case}-coarse")
# Reduced models of a case with another joint, section or spring.
VARIANTS = ("rom3d-*-{case}", "rom2d-*-{case}")

REDUCED = (*NETWORKS["rom3d"], *NETWORKS["rom2d"], *VARIANTS)
BEAM_MODELS = ("beam-{case}", "beam-*-{case}", "beam-{case}-coarse")  # Beams in contact of a case

# Square knits of rising size in course tension.
SQUARES = (
    "domain-*-tie-course-*",
    "domain-*-isotropic-course-*",
    *("yarns-tie-course", "rom3d-tie-course", "rom2d-tie-course", "beam-hertz-patch-isotropic-course"),
)


def model_name(model: FidelityModel) -> str:
    """Return what the paper calls a model; of a plugin's model its meaning."""
    return "DNS" if model.solid else MODEL_NAMES.get(model.name, model.meaning)


def of_case(case: str, names: Iterable[str]) -> tuple[str, ...]:
    """Return names of scenes of a case, for example "tie-course"."""
    return tuple(name.format(case=case) for name in names)


def of_cases(cases: Iterable[str], names: Iterable[str]) -> tuple[str, ...]:
    """Return names of scenes of several cases, case by case."""
    return tuple(name.format(case=case) for case in cases for name in names)


# Geometry of the knit of the four cases
KNIT = one("geometry", *of_cases(("tie-course", "isotropic-course"), SOLIDS))


def solid(stage: str, case: str) -> StageResults:
    """Return the result of the direct simulation of a case that the others are compared with."""
    return one(stage, *of_case(case, SOLIDS))


def of_solid(case: str, *arguments: str) -> dict[str, StageResults]:
    """Return the results of the direct simulation of a case by stage, "dns" for the history."""
    return {name: solid("simulation" if name == "dns" else name, case) for name in arguments}


def network(fidelity: str, case: str, optional: bool = False) -> StageResults:
    """Return the history of the main reduced model of a case, "rom3d" or "rom2d"."""
    return one("simulation", *of_case(case, NETWORKS[fidelity]), optional=optional)
