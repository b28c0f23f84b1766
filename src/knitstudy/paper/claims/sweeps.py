"""Claims about Fig. 11: sweeps of spacing and diameter (K9, K10), and what the paper explains them by (K16, K17).

Explanations are judged by networks of beams in which one thing at a time is changed (``benchmarks/mechanisms.py``).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import pandas as pd

from knitstudy.measures.estimate import Estimate
from knitstudy.paper.claims import (
    CLAIMS,
    COMPARABLE,
    CONTRADICTED,
    DIRECTION,
    GRADES,
    REPRODUCED,
    UNDECIDABLE,
    NotRun,
    Remark,
    Row,
    holds,
    trend,
    worst,
)
from knitstudy.paper.claims.evidence import Evidence
from knitstudy.paper.scene_names import INTERACTIONS
from knitstudy.paper.sweeps import ALONG, DIAMETER, HELD, SPACING, Sweep, sweeps_of

FEWEST = 5  # Least number of values of a sweep
ALIKE = 0.005  # Relative uncertainty of networks: pairs within 1 % count half
U_Z, SPIN = "largest |u_z| [m]", "mean spin [deg]"  # Columns of ``resources/reference/mechanisms.csv``
DECIDES = "isotropic", "rigid"  # Interaction and joints of the network that decides


@CLAIMS.add("K9", key=SPACING, sign=1)
@CLAIMS.add("K10", key=DIAMETER, sign=-1)
def sweep(evidence: Evidence, key: str, sign: int) -> Iterator[Row | Remark]:
    """Yield that u_z grows (sign 1) with course spacing, falls (-1) with the diameter of the yarn."""
    held = _of_reading(evidence, key, evidence.held)
    if "isotropic" not in held:
        raise NotRun(
            f"the study has no sweep of {key} with {FEWEST} values, {HELD[evidence.held]} and friction"
        )
    test = partial(_trend_of, sign=sign)
    main = test(held["isotropic"], evidence.held)
    # The paper does not print what is held: meanings that disagree leave the claim open.
    meanings = _other_meanings(evidence, key) if evidence.base is None else {}
    others = [test(of, keep) for keep, of in meanings.items()]
    grades = {row.grade for row in (main, *others)}
    note = ""
    if CONTRADICTED in grades and grades & {REPRODUCED, DIRECTION}:
        main = replace(main, grade=UNDECIDABLE)
        note = "missing is what the paper holds fixed"
    yield main
    others += [test(held[kind], evidence.held) for kind in sorted(held) if kind != "isotropic"]
    yield from (Row(row.quantity, row.ours) for row in others)
    points = held["isotropic"].points
    ends = (f"{1e3 * points[end].u_z.value:.3f}" for end in (0, -1))
    yield Row("from end to end", f"{' to '.join(ends)} mm")
    for kind in sorted(held):
        yield from _values(_swept(key, evidence.held)[0], held[kind])
    yield Remark(note, tuple(point.scene.name for point in points))


def _other_meanings(evidence: Evidence, key: str) -> dict[str, Sweep]:
    """Return the sweeps with friction of other readings of what is held fixed."""
    readings = {keep: _of_reading(evidence, key, keep) for keep in HELD if keep != evidence.held}
    return {keep: sweeps["isotropic"] for keep, sweeps in readings.items() if "isotropic" in sweeps}


def _trend_of(sweep: Sweep, keep: str, sign: int) -> Row:
    """Return whether u_z grows (sign 1) or falls (-1) along a sweep."""
    claimed = "grows" if sign > 0 else "falls"
    u_z = [point.u_z for point in sweep.points]
    name = f"|u_z| {claimed}, {HELD[keep]}, {INTERACTIONS[sweep.interaction]}"
    return trend(name, u_z, sign, claimed)


def _swept(key: str, keep: str) -> tuple[str, str]:
    """Return the key that is swept under a reading of what is held fixed (`HELD`), and the pattern's ``keep``."""
    return (ALONG, "shape") if (key, keep) == (SPACING, ALONG) else (key, keep)


def _of_reading(evidence: Evidence, key: str, keep: str) -> dict[str, Sweep]:
    """Return the sweeps of a key by interaction, of a reading of what is held fixed."""
    key, keep = _swept(key, keep)
    return {
        sweep.interaction: sweep
        for sweep in sweeps_of(key, evidence.rows, evidence.reference)
        if sweep.main and sweep.keep == keep and len(sweep.points) >= FEWEST
    }


def _values(key: str, sweep: Sweep) -> Iterator[Row]:
    """Yield the values of a sweep."""
    form, scale, unit = (".2f", 1.0, "c") if key == SPACING else (".4g", 1e3, "mm")
    kind = INTERACTIONS[sweep.interaction]
    for point in sweep.points:
        yield Row(f"at {scale * point.value:{form}} {unit}, {kind}", f"{1e3 * point.u_z.value:.3f} mm")
    off = max(point.u_z.uncertainty / point.u_z.value for point in sweep.points)
    yield Row(f"uncertainty, {kind}", f"{off:.1%}")


# ---- What the paper explains Fig. 11 by


def _networks(
    evidence: Evidence, sweep: str, by: str = "value", interaction: str = DECIDES[0]
) -> pd.DataFrame:
    """Return the networks of a sweep in rising order of a column."""
    table = evidence.mechanisms
    if table is None:
        raise NotRun("the study has no networks in which one thing at a time is changed: `make mechanisms`")
    here = (table["sweep"] == sweep) & (table["interaction"] == interaction) & (table["joint"] == DECIDES[1])
    if here.sum() < FEWEST:
        raise NotRun(f"there are {here.sum()} networks of {sweep}; needed are {FEWEST}")
    return table[here].sort_values(by)


def _trend(quantity: str, values: pd.Series, sign: int, claimed: str) -> Row:
    return trend(quantity, [Estimate(value, ALIKE * value) for value in values], sign, claimed, half=False)


@CLAIMS.add("K16")
def moment_axis(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that |u_z| grows with one of two levers at one spacing, and not with the spacing at one lever."""
    tests = {}
    for lever in ("inner", "outer"):
        grows = _networks(evidence, "levers, spacing fixed", f"{lever} lever [m]")[U_Z]
        alone = _networks(evidence, f"spacing, {lever} lever fixed", "course spacing [m]")[U_Z]
        tests[lever] = [
            _trend(f"|u_z| grows with the {lever} lever at one spacing", grows, 1, "grows"),
            _trend(f"|u_z| does not grow with the spacing at one {lever} lever", alone, -1, "does not"),
        ]
    best = max(tests, key=lambda lever: GRADES.index(worst(tests[lever])))
    yield from tests.pop(best)
    for rows in tests.values():
        yield from (row.shown for row in rows)
    drawn = _networks(evidence, "spacing, drawn shape")[U_Z]
    gate = _trend("|u_z| grows with the spacing, drawn shape held", drawn, 1, "grows")
    yield gate.shown if gate.margin >= 1 else replace(gate, grade=UNDECIDABLE)
    yield Remark(
        "networks with friction and rigid arms; levers: between contacts of a side (inner), and of rows (outer)"
    )


@CLAIMS.add("K17")
def moment_of_inertia(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that a stiffer yarn of the same diameter spins less, and moves less far out of the plane."""
    together = "bending and torsion"
    for column, what in ((U_Z, "|u_z|"), (SPIN, "spin")):
        values = _networks(evidence, together)[column]
        yield _trend(f"{what} falls, friction", values, -1, "falls")
        share = values.iloc[-1] / values.iloc[0]
        bar = 1 / COMPARABLE
        name = f"{what} of the stiffest over that of the least stiff yarn, friction"
        yield holds(name, f"{share:.2f}", f"< {bar:.2f}", True, share <= bar, bar / share)
    for kind, sweep in (("isotropic", "torsion alone"), ("isotropic", "bending alone"), ("tie", together)):
        of = _networks(evidence, sweep, interaction=kind)
        shares = (f"{of[column].iloc[-1] / of[column].iloc[0]:.2f}" for column in (U_Z, SPIN))
        yield Row(f"the same of |u_z|; spin, {INTERACTIONS[kind]}, {sweep}", "; ".join(shares))
    yield Remark("networks of beams with rigid arms; stiffness of yarns of 1.2 to 1.95 mm at 1.8 mm")
