"""Variations of inputs, all rules by claim, and claims judged at other values of inputs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.measures.catalogue import Scenes
from knitstudy.measures.claims import contact, fabric, models
from knitstudy.measures.claims.evidence import NOT_RUN, OPEN, Evidence, Judge, Judgement, withholding
from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.measures.reference import TRANSFERRED, reference_of, transferred_uncertainty
from knitstudy.measures.response import QUANTITIES
from knitstudy.measures.sweeps import DIAMETER, SPACING
from knitstudy.study.keys import Description, describe
from knitstudy.study.kinds import Labels, all_sections
from knitstudy.study.scene import Scene

# Knits in which one input is changed at a time: "inputs-{what}-{interaction}-course".

# Inputs that are changed one at a time, by key, in words.
INPUTS = {
    "contact.friction": "coefficient of friction",
    "contact.tied_edges": "rows that stay tied",
    "specimen": "specimen",
    "pattern.clearance": "clearance of the yarns",
    "tie.radius": "radius of a tie",
    "yarn.youngs_modulus": "Young's modulus",
    "yarn.poisson_ratio": "Poisson's ratio",
    "yarn.material": "material law",
    "load.lateral": "driven ends sideways",
}

# Names of the scenes with all inputs as usual, by interaction, and of those with one input changed.
BASE, CHANGED = "yarns-{}-course", re.compile(r"inputs-(.+)-(tie|rough|isotropic)-course")
COEFFICIENT, WITHOUT_LIMIT = "contact.friction", "rough"  # Rough contact is one more value


@dataclass(frozen=True)
class Variation:
    """One key of `INPUTS` at another value than usual; the base, whose key is empty, has all inputs as usual.

    `scenes` go by interaction: those of the base for interactions that the input does not concern. `varied` are the
    interactions whose scenes are not those of the base.
    """

    key: str
    value: Any
    scenes: Scenes
    varied: tuple[str, ...] = ()

    @property
    def described(self) -> Description:
        """Unit, standing and source of the input."""
        section, dot, field = self.key.partition(".")
        return describe(all_sections()[section][field], field) if dot else describe(Labels, section)


def variations(scenes: Iterable[Scene]) -> list[Variation]:
    """Return the base and every other value of every input, in the order of `INPUTS` and of the values.

    Raises ConfigurationError if a scene of a varied input changes none of them.
    """
    scenes = {scene.name: scene for scene in scenes}
    base = {kind: scenes[BASE.format(kind)] for kind in INTERACTIONS if BASE.format(kind) in scenes}
    changed: dict[str, dict[str, Scene]] = {}
    for name, scene in scenes.items():
        if (parts := CHANGED.fullmatch(name)) and parts[2] in base:
            changed.setdefault(parts[1], {})[parts[2]] = scene
    found = [_variation(base, changes) for changes in changed.values()]
    if any(each.key == COEFFICIENT for each in found) and "rough" in base:
        found.append(Variation(COEFFICIENT, WITHOUT_LIMIT, {"isotropic": base["rough"]}, ("isotropic",)))
    order = list(INPUTS)
    found.sort(key=lambda each: (order.index(each.key), each.value == WITHOUT_LIMIT, each.value))
    return [Variation("", None, base), *found] if found else []


def _variation(base: Scenes, changed: Scenes) -> Variation:
    kind, scene = next(iter(changed.items()))
    key = next((key for key in INPUTS if scene.value(key) != base[kind].value(key)), None)
    if key is None:
        raise ConfigurationError(
            f"scene {scene.name!r} changes none of {', '.join(INPUTS)}: give it another name"
        )
    return Variation(key, scene.value(key), {**base, **changed}, tuple(k for k in base if k in changed))


_JUDGES: dict[str, Judge] = {
    "G1": fabric.judge_penetration,
    "G2": fabric.judge_length,
    "S1": fabric.judge_size,
    "K1": contact.judge_no_contact,
    "K2": contact.judge_zones,
    "K3": contact.judge_slope,
    "K4": contact.judge_motion,
    "K5": contact.judge_stiffness_order,
    "K6": contact.judge_motion_order,
    "K7": contact.judge_smaller_friction,
    "K8": contact.judge_kinematics,
    "K9": partial(fabric.judge_sweep, SPACING, 1),
    "K10": partial(fabric.judge_sweep, DIAMETER, -1),
    "K11": contact.judge_untied_rows,
    "E1": contact.judge_stabilisation,
    "M1": fabric.judge_directions,
    "M2": fabric.judge_heights,
    "R1": models.judge_forces,
    "R2": models.judge_out_of_plane,
    "R3": models.judge_motion_order,
    "R4": models.judge_springs,
    "R5": models.judge_cost,
    "R6": models.judge_cost_with_friction,
    "B1": models.judge_beams,
}

RULES = {claim: withholding(judge) for claim, judge in _JUDGES.items()}  # The function that judges, by claim
# Claims that histories and contacts of a knit in course tension decide. K7 is K5 with all frictions.
CLAIMS = ("K1", "K2", "K3", "K4", "K5", "K6", "K8", "K11", "E1")


@dataclass(frozen=True)
class Finding:
    """Responses and judgements at one value of one input.

    `values` at full strain and their relative `changes` from the base go by quantity and interaction, judgements by
    claim; `turned` are the claims with another verdict than the base's, where the base decides.
    """

    variation: Variation
    values: Mapping[tuple[str, str], float]
    changes: Mapping[tuple[str, str], float]
    judged: Mapping[str, Judgement]
    turned: tuple[str, ...]


def findings(evidence: Evidence) -> list[Finding]:
    """Return the findings at every value of every input (`variations`) among the histories, the base first.

    The reference knows the base alone. All are therefore judged by their own histories, with the uncertainty of their
    discretisation at the base (`transferred_uncertainty`), so that verdicts differ by the input only. The geometry
    gives the diameter of the yarn, which is the same in all.
    """
    histories, result = evidence.histories, []
    found = variations(evidence.scenes[name] for name in histories)
    untied = next((each for each in found if (each.key, each.value) == ("contact.tied_edges", "none")), None)
    for each in found:
        base = found[0].scenes
        direct = {kind: scene.name for kind, scene in each.scenes.items()}
        estimates = {
            kind: transferred_uncertainty(
                reference_of(evidence.reference, base[kind]), histories[base[kind].name], histories[name]
            )
            for kind, name in direct.items()
        }
        if each is found[0] and untied and "isotropic" in untied.scenes:
            direct["untied"] = untied.scenes["isotropic"].name
        here = replace(evidence, direct=direct, estimates=estimates)
        judged = {claim: RULES[claim](here) for claim in CLAIMS}
        judged = {claim: of for claim, of in judged.items() if of.verdict != NOT_RUN}
        values = {
            (quantity, kind): float(QUANTITIES[quantity][1](history, history)[-1])
            for quantity in TRANSFERRED
            for kind in each.varied or base
            for history in [histories[direct[kind]]]
        }
        first = result[0] if result else Finding(each, {}, {}, {}, ())
        changes = {place: value / first.values[place] - 1 for place, value in values.items() if first.values}
        decided = {claim: of.verdict for claim, of in first.judged.items() if of.verdict != OPEN}
        turned = tuple(
            claim for claim in judged if judged[claim].verdict != decided.get(claim, judged[claim].verdict)
        )
        result.append(Finding(each, values, changes, judged, turned))
    return result


def hanging(found: Iterable[Finding]) -> dict[str, tuple[str, ...]]:
    """Return by input the claims with another verdict than the base's at one of its values."""
    hang: dict[str, dict[str, None]] = {}
    for each in found:
        if each.variation.key:
            hang.setdefault(each.variation.key, {}).update(dict.fromkeys(each.turned))
    return {key: tuple(claim for claim in CLAIMS if claim in claims) for key, claims in hang.items()}
