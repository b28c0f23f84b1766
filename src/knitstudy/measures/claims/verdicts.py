"""All rules by claim, and what claims come to at other values of inputs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.claims import contact, fabric, models
from knitstudy.measures.claims.evidence import NOT_RUN, OPEN, Evidence, Judgement, Rule
from knitstudy.measures.reference import TRANSFERRED, Reference, reference_of, transferred_uncertainty
from knitstudy.measures.response import QUANTITIES
from knitstudy.measures.variations import Variation, variations
from knitstudy.study.scene import Scene

# ---- All rules by which claims are judged


RULES: dict[str, Rule] = {
    **fabric.UNIT_CELL_RULES,
    **contact.CONTACT_RULES,
    **contact.KINEMATICS_RULES,
    **models.MODEL_RULES,
    **fabric.STRESS_RULES,
    **fabric.SIZE_RULES,
    **fabric.SWEEP_RULES,
}
"""By the claim's id."""


# ---- Claims judged at other values of inputs: what one changed input does to force, motion and verdicts


CLAIMS = ("K1", "K2", "K3", "K4", "K5", "K6", "K8", "K11", "E1")
"""What histories and contacts of a knit in course tension can decide. K7 is K5 at all coefficients of friction."""


@dataclass(frozen=True)
class Finding:
    """What comes out at one value of one input.

    Attributes
    ----------
    variation : Variation
    values : mapping of (str, str) to float
        By quantity and interaction, at full strain, in its unit; of scenes that are not the base's.
    changes : mapping of (str, str) to float
        The same over the base's, less one.
    judged : mapping of str to Judgement
        By claim, as far as the scenes decide it.
    turned : tuple of str
        Claims whose verdict is not the base's, where the base decides.
    """

    variation: Variation
    values: Mapping[tuple[str, str], float]
    changes: Mapping[tuple[str, str], float]
    judged: Mapping[str, Judgement]
    turned: tuple[str, ...]


def findings(
    scenes: Iterable[Scene],
    histories: Mapping[str, xr.Dataset],
    contacts: Mapping[str, xr.Dataset],
    geometry: xr.Dataset,
    paper: pd.DataFrame,
    reference: pd.DataFrame,
) -> list[Finding]:
    """Return what comes out with every value of every input (`measures.variations`), the base first.

    The reference knows the base alone. So the base, too, is judged by its own histories, with the uncertainty that
    they have for it (`measures.reference`): verdicts differ for nothing but the input.

    Parameters
    ----------
    scenes : iterable of Scene
    histories, contacts : mapping of str to Dataset
        Of all of them, by scene.
    geometry : Dataset
        Of one of them, for the diameter of the yarn: it is the same in all.
    paper, reference : DataFrame
        ``resources/reference/paper_tables.csv`` and ``reference.csv``.
    """
    found = variations(scenes)
    if not found:
        return []
    base = found[0]
    known = {kind: reference_of(reference, scene) for kind, scene in base.scenes.items()}
    untied = next((each for each in found if (each.key, each.value) == ("contact.tied_edges", "none")), None)
    result: list[Finding] = []
    for each in found:
        estimates = {
            kind: transferred_uncertainty(
                known[kind], histories[base.scenes[kind].name], histories[scene.name]
            )
            for kind, scene in each.scenes.items()
        }
        compared = dict(each.scenes)
        if each is base and untied and "isotropic" in untied.scenes:
            compared["untied"] = untied.scenes["isotropic"]
        judged = _judged(compared, histories, contacts, geometry, paper, reference, estimates)
        first = result[0] if result else None
        values = {
            (quantity, kind): _at_full_strain(histories[each.scenes[kind].name], quantity)
            for quantity in TRANSFERRED
            for kind in each.varied or base.scenes
        }
        result.append(
            Finding(
                each,
                values,
                {place: value / first.values[place] - 1 for place, value in values.items()} if first else {},
                judged,
                tuple(
                    claim for claim in judged if first and _differs(judged[claim], first.judged.get(claim))
                ),
            )
        )
    return result


def hanging(found: Iterable[Finding]) -> dict[str, tuple[str, ...]]:
    """Return by input the claims whose verdict is not the base's at one of its values."""
    hang: dict[str, dict[str, None]] = {}
    for each in found:
        if each.variation.key:
            hang.setdefault(each.variation.key, {}).update(dict.fromkeys(each.turned))
    return {key: tuple(claim for claim in CLAIMS if claim in claims) for key, claims in hang.items()}


def _judged(
    compared: Mapping[str, Scene],
    histories: Mapping[str, xr.Dataset],
    contacts: Mapping[str, xr.Dataset],
    geometry: xr.Dataset,
    paper: pd.DataFrame,
    reference: pd.DataFrame,
    estimates: Mapping[str, Reference],
) -> dict[str, Judgement]:
    """Judge the claims that some scenes, by what `Evidence` calls them, can decide."""
    evidence = Evidence(
        geometry,
        compared,
        paper,
        reference,
        direct={name: histories[scene.name] for name, scene in compared.items()},
        contacts={name: contacts[scene.name] for name, scene in compared.items() if scene.name in contacts},
        estimates=estimates,
    )
    judged = {claim: RULES[claim].judge(evidence) for claim in CLAIMS}
    return {claim: each for claim, each in judged.items() if each.verdict != NOT_RUN}


def _differs(one: Judgement, other: Judgement | None) -> bool:
    return other is not None and other.verdict != OPEN and one.verdict != other.verdict


def _at_full_strain(history: xr.Dataset, quantity: str) -> float:
    """Return a quantity of a history at its largest strain."""
    _, values = QUANTITIES[quantity]
    return float(np.asarray(values(history, history))[-1])
