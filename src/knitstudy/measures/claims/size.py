"""The claim about the size of the domain: S1 of ``resources/reference/paper_claims.csv``."""

from __future__ import annotations

from knitstudy.measures.claims.evidence import NOT_RUN, Evidence, Judgement, verdict
from knitstudy.measures.claims.rule import BEFORE, OF_COSTS, Rule
from knitstudy.measures.cost import memory_growth
from knitstudy.measures.discretisation import HEXAHEDRA
from knitstudy.measures.domain import SMALLEST, Series, contact_over_ties, series_of
from knitstudy.measures.printed import number

AS_AN_AREA = 0.1
"""How far exponents of degrees of freedom may be from 2."""

SHARE = 0.9
"""Of the paper's factor that contact costs over ties in degrees of freedom."""


def judge_size(evidence: Evidence) -> Judgement:
    """S1: degrees of freedom grow with the area of the knit, and contact costs more of them than ties do."""
    scenes = {name: evidence.scenes[name] for name in evidence.every}
    series = [each for each in series_of(scenes.values()) if _is_papers(each)]
    kinds = {each.scenes[0].interaction for each in series}
    if not {"tie", "isotropic"} <= kinds:
        return Judgement(
            "", NOT_RUN, "the study has no square knits of rising size with ties and with friction"
        )
    said, grows = [], []
    for each in series:
        histories = [evidence.every[scene.name] for scene in each.scenes]
        dof = each.growth([history.attrs["dof"] for history in histories])
        memory = each.growth([memory_growth(history) for history in histories])
        grows.append(abs(dof.exponent - 2) <= AS_AN_AREA)
        said.append(
            f"{each.interaction} of {', '.join(map(str, each.cells))} cells in a row: exponent {dof.exponent:.2f} of "
            f"degrees of freedom, {memory.exponent:.2f} of memory"
        )
    factors = {
        quantity: next(iter(contact_over_ties(series, evidence.every, quantity).values()))
        for quantity in ("dof", "memory_growth")
    }
    smallest = min(cells for cells in factors["dof"] if cells >= SMALLEST)
    paper = number(evidence.paper, "3", "c3w3", "degrees of freedom") / number(
        evidence.paper, "5", "dns-tie 3x3", "degrees of freedom"
    )
    said.append(
        f"contact over ties at {smallest} x {smallest}: {factors['dof'][smallest]:.2f} in degrees of freedom (paper "
        f"{paper:.2f}), {factors['memory_growth'][smallest]:.2f} in memory"
    )
    holds = all(grows) and factors["dof"][smallest] >= SHARE * paper
    return Judgement("; ".join(said), verdict(holds), "contact by penalties adds no degrees of freedom")


RULES = {
    "S1": Rule(
        judge_size,
        f"exponents of degrees of freedom in cells in a row within {AS_AN_AREA:g} of 2, with ties and with friction, "
        f"and contact over ties at the smallest size {SHARE:.0%} of the paper's factor in degrees of freedom or more",
        BEFORE,
        ("fig12a_domain_size", "table3_domain_size"),
        OF_COSTS,
    )
}


def _is_papers(series: Series) -> bool:
    return series.model.startswith(HEXAHEDRA["one_point"])
