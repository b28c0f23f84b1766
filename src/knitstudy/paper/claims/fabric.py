"""Claims about the loop (G1, G2), the size of the knit (S1 to S3), and sweeps of the loop (K9, K10)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import stdtrit

from knitstudy.measures.centre_cell import crossing_error, loop_of
from knitstudy.measures.cost import Series, memory_growth, series_of
from knitstudy.measures.reference import HEXAHEDRA, INTERACTIONS
from knitstudy.paper.claims.evidence import Evidence, Judgement, NotRun
from knitstudy.paper.claims.scale import UNDECIDABLE, Row, at_most, comparable, holds, trend
from knitstudy.paper.sweeps import HELD, SPACING, Sweep, sweeps_of
from knitstudy.paper.unknowns import counted_solids

CONTACT_BAR = 1e-3  # Claim G1: largest |D - 2R - c0| over R at which yarns count as touching at points
LENGTH_BAR = 0.02  # Claim G2: relative change of length that counts as hardly any
# Claims S1, S3: scenes with hexahedra of the paper's size
PAPERS_MESH, IN_CONTACT = "dns-tie-course", "dns-isotropic-course"
FEWEST = 5  # Claims K9 and K10: least number of values of a sweep


def judge_penetration(evidence: Evidence) -> Judgement:
    """G1: the yarns penetrate each other before the optimisation, and only touch after it."""
    geometry, radius = evidence.geometry, float(evidence.geometry["radius"])
    before, after = (
        float(geometry["penetration"].sel(state=state)) / radius for state in ("before", "after")
    )
    error = float(crossing_error(geometry).sel(state="after")) / radius
    return Judgement(
        (
            holds("deepest penetration after", f"{after:.3f} R", "none", after == 0),
            holds("deepest penetration before", f"{before:.3f} R", "severe", before > 0),
            at_most("largest |D - 2R - c0| at a crossing", error, "0", CONTACT_BAR, text=f"{error:.1e} R"),
        ),
        f"with a clearance c0 of {float(geometry['clearance']):g} R; the initial loop is not printed, so its "
        "penetration is this study's own",
    )


def judge_length(evidence: Evidence) -> Judgement:
    """G2: the yarn of a loop hardly changes its length; the rows beside it are of its Bezier curves."""
    before, after = (
        loop_of(evidence.geometry, state).curve.segment_lengths() for state in ("before", "after")
    )
    change, total = after / before - 1, after.sum() / before.sum() - 1
    return Judgement(
        (
            at_most("change of a loop", abs(total), "hardly any", LENGTH_BAR, text=f"{total:+.2%}"),
            Row("largest change of a Bezier curve", f"{max(change, key=abs):+.2%}"),
            Row("least change of a Bezier curve", f"{min(change, key=abs):+.2%}"),
        ),
        f"arc lengths; a change of up to {LENGTH_BAR:.0%} counts as hardly any",
    )


def judge_ties_growth(evidence: Evidence) -> Judgement:
    """S1: degrees of freedom of tied knits are the paper's at 3 x 3 cells and at 30 x 30 cells."""
    scene = (evidence.base or evidence).scenes.get(PAPERS_MESH)
    if scene is None:
        raise NotRun(f"the study has no {PAPERS_MESH}, whose mesh is the paper's")
    law = counted_solids(evidence.fabric, scene, evidence.paper)[0].unknowns
    three, thirty = (
        evidence.printed(*place, "degrees of freedom")
        for place in (("5", "dns-tie 3x3"), ("fig12a", "c30w30 tie"))
    )
    ours, theirs = (f"{np.log10(many / few):.2f}" for few, many in ((law(3), law(30)), (three, thirty)))
    name = "degrees of freedom, {0} x {0} cells"
    return Judgement(
        (
            comparable(name.format(30), law(30), thirty, f"{law(30):,.0f}", f"some {thirty:,.0f}"),
            comparable(name.format(3), law(3), three, f"{law(3):,.0f}", f"{three:,.0f}"),
            Row("exponent in cells in a row", ours, theirs),
        ),
        "counted without a solution",
    )


def judge_contact_memory(evidence: Evidence) -> Judgement:
    """S2: memory of knits in contact grows from 3 x 3 to 30 x 30 cells as in Table 3."""
    series = _series(evidence, "isotropic")
    exponent = series.growth([memory_growth(evidence.histories[scene.name]) for scene in series.scenes])
    sizes = (3, 6, 8, 20, 30)
    printed = [evidence.printed("3", f"c{n}w{n}", "memory") for n in sizes]
    wanted = float(np.polyfit(np.log(sizes), np.log(printed), 1)[0])
    near = float(np.log(printed[1] / printed[0]) / np.log(2))
    # 95 % by Student's t: memory scatters from run to run, and few sizes are fitted
    interval = replace(exponent, uncertainty=float(stdtrit(series.freedom, 0.975)) * exponent.uncertainty)
    factor, grows = interval.of(lambda value: 10**value), printed[-1] / printed[0]
    name, cells = "memory of 30 x 30 over that of 3 x 3 cells", ", ".join(map(str, series.cells))
    return Judgement(
        (
            comparable(name, factor, grows, f"{factor.value:.0f} ± {factor.uncertainty:.0f}", f"{grows:.0f}"),
            Row(
                f"exponent of {cells} cells in a row", f"{exponent}", f"{wanted:.2f}; of 3 and 6: {near:.2f}"
            ),
        ),
        "extrapolated by the exponent; memory scatters by a fifth from run to run (docs/notes/performance.md): "
        "repeated runs, or knits of 8 x 8 cells and more, decide",
    )


def judge_contact_unknowns(evidence: Evidence) -> Judgement:
    """S3: contact takes more degrees of freedom than ties."""
    try:
        dof = [evidence.histories[name].attrs["dof"] for name in (PAPERS_MESH, IN_CONTACT)]
    except KeyError as missing:
        raise NotRun(f"the study has no {missing.args[0]}") from None
    contact, ties = (
        evidence.printed(*place, "degrees of freedom") for place in (("3", "c3w3"), ("5", "dns-tie 3x3"))
    )
    ratio, name = dof[1] / dof[0], "degrees of freedom, contact over ties"
    row = comparable(
        name, ratio, contact / ties, f"{ratio:.2f}", f"{contact / ties:.2f}", direction=ratio > 1
    )
    if ratio == 1:
        row = Row(name, row.ours, row.paper, UNDECIDABLE)
    return Judgement(
        (row,), "contact by penalties adds no degrees of freedom: missing is what the paper counts"
    )


def _series(evidence: Evidence, interaction: str) -> Series:
    """Return the square knits of one-point hexahedra with an interaction."""
    for series in series_of(evidence.scenes[name] for name in evidence.histories):
        if series.model.startswith(HEXAHEDRA["one_point"]) and series.scenes[0].interaction == interaction:
            return series
    raise NotRun(
        f"the study has no square knits of hexahedra of rising size with {INTERACTIONS[interaction]}"
    )


def judge_sweep(key: str, sign: int, evidence: Evidence) -> Judgement:
    """K9, K10: u_z grows (sign 1) with course spacing, falls (-1) with the diameter of the yarn."""
    held = {
        sweep.interaction: sweep
        for sweep in sweeps_of(key, evidence.histories, evidence.scenes, evidence.reference)
        if sweep.main and sweep.keep == evidence.held and len(sweep.points) >= FEWEST
    }
    if "isotropic" not in held:
        raise NotRun(
            f"the study has no sweep of {key} with {FEWEST} values, {HELD[evidence.held]} and friction"
        )
    claimed, rows = "grows" if sign > 0 else "falls", []
    for kind in sorted(held):
        u_z = [point.u_z for point in held[kind].points]
        row = trend(f"|u_z| {claimed}, {HELD[evidence.held]}, {INTERACTIONS[kind]}", u_z, sign, claimed)
        rows.append(row if kind == "isotropic" else Row(row.quantity, row.ours))
    first, *_, last = held["isotropic"].points
    rows.append(Row("from end to end", f"{1e3 * first.u_z.value:.3f} to {1e3 * last.u_z.value:.3f} mm"))
    rows += [row for kind in sorted(held) for row in _values(key, held[kind])]
    return Judgement(tuple(rows), "", tuple(point.scene.name for point in held["isotropic"].points))


def _values(key: str, sweep: Sweep) -> list[Row]:
    """Return the values of a sweep."""
    form, scale, unit = (".2f", 1.0, "c") if key == SPACING else (".4g", 1e3, "mm")
    kind = INTERACTIONS[sweep.interaction]
    off = max(point.u_z.uncertainty / point.u_z.value for point in sweep.points)
    values = [
        Row(f"at {scale * point.value:{form}} {unit}, {kind}", f"{1e3 * point.u_z.value:.3f} mm")
        for point in sweep.points
    ]
    return [*values, Row(f"uncertainty, {kind}", f"{off:.1%}")]
