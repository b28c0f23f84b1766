"""Claims about Fig. 11: sweeps of spacing and diameter (K9, K10), and what the paper explains them by (K16, K17).

Explanations are judged by solid yarns, and by networks of beams (``benchmarks/mechanisms.py``), in which one thing at a
time is changed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import combinations, product

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.estimate import Estimate
from knitstudy.paper.claims import (
    CLAIMS,
    COMPARABLE,
    CONTRADICTED,
    GRADES,
    REPRODUCED,
    UNDECIDABLE,
    NotRun,
    Remark,
    Row,
    by_meanings,
    disagree,
    holds,
    trend,
    worst,
)
from knitstudy.paper.claims.evidence import Evidence, joined
from knitstudy.paper.columns import U_Z as LARGEST
from knitstudy.paper.columns import Column
from knitstudy.paper.scene_names import INTERACTIONS
from knitstudy.paper.sweeps import ALONG, DIAMETER, HELD, SPACING, Sweep, sweeps_of

FEWEST = 5  # Least number of values of a sweep
ALIKE = 0.005  # Relative uncertainty of networks: pairs within 1 % count half
U_Z, SPIN = "largest |u_z| [m]", "mean spin [deg]"  # Columns of ``resources/reference/mechanisms.csv``
MISSING = "missing is what the paper holds fixed"


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
    # The paper does not print what is held: meanings that disagree leave the claim open, unless a reading decides it.
    decides = evidence.base is not None and evidence.held != evidence.base.held
    meanings = {} if decides else _other_meanings(evidence, key)
    others = [test(of, keep) for keep, of in meanings.items()]
    note = MISSING if disagree(row.grade for row in (main, *others)) else ""
    yield by_meanings([main, *others])[0]
    others += [test(held[kind], evidence.held) for kind in sorted(held) if kind != "isotropic"]
    yield from (Row(row.quantity, row.ours) for row in others)
    points = held["isotropic"].points
    ends = (f"{1e3 * points[end].u_z.value:.3f}" for end in (0, -1))
    yield Row("from end to end", f"{' to '.join(ends)} mm")
    yield _choices(held["isotropic"], evidence.held, sign)
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


def _choices(sweep: Sweep, keep: str, sign: int) -> Row:
    """Return in how many choices of enough values of a sweep u_z grows (sign 1) or falls (-1) as claimed."""
    sizes = range(FEWEST, len(sweep.points) + 1)
    choices = [points for size in sizes for points in combinations(sweep.points, size)]
    reproduced = [_trend_of(replace(sweep, points=some), keep, sign).grade == REPRODUCED for some in choices]
    text = f"{sum(reproduced)} of {len(choices)}"
    return Row("choices of five or more of these values that reproduce it", text)


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

TOGETHER, FRICTION = "bending and torsion", "isotropic"
# Scenes of solid yarns that are stiffer and no thicker: what is stiffer, and the sweep of networks beside them
STIFFER = {"both": TOGETHER, "torsion": "torsion alone", "bending": "bending and stretching"}
INERTIA = re.compile(rf"inertia-({'|'.join(STIFFER)})-d(\d+)-(.*)")
ISOTROPIC = "inertia-both-d180"  # the yarn of the base, which every sweep has


def _mean_spin(contacts: xr.Dataset) -> float:
    """Return the mean angle by which sections at free crossings have spun about their yarns [deg]; ties have all."""
    free = contacts["tied"].to_numpy() == 0
    spun = np.abs(contacts["spin"].to_numpy()[-1])
    return float(np.degrees(spun[free if free.any() else ...].mean()))


MEAN_SPIN = Column("mean spin", "deg", _mean_spin, of="contacts")


def _solids(evidence: Evidence, stiffer: str, interaction: str, end: str = "") -> pd.DataFrame:
    """Return the solid yarns of a sweep of `STIFFER` in rising order of their stiffness, by scene.

    `end` is that of the names of scenes of another discretisation.
    """
    case = f"{interaction}-course{end}"
    places = {name: INERTIA.fullmatch(name) for name in evidence.rows}
    diameters = {
        name: place[2]
        for name, place in places.items()
        if place and place[3] == case and (place[1] == stiffer or name == f"{ISOTROPIC}-{case}")
    }
    run = [name for name in diameters if evidence.has(name) and evidence.has(name, "contacts")]
    names = sorted(run, key=diameters.__getitem__)
    columns = {U_Z: LARGEST, SPIN: MEAN_SPIN}
    values = {head: [evidence.rows[name][column] for name in names] for head, column in columns.items()}
    return pd.DataFrame(values, index=names, columns=[*columns])


def _networks(evidence: Evidence, sweep: str, by: str = "value", interaction: str = FRICTION) -> pd.DataFrame:
    """Return the networks of a sweep in rising order of a column; as printed, those with pinned joints."""
    table = evidence.mechanisms
    if table is None:
        raise NotRun("the study has no networks in which one thing at a time is changed: `make mechanisms`")
    joint = "pinned" if evidence.as_printed else "rigid"
    here = (table["sweep"] == sweep) & (table["interaction"] == interaction) & (table["joint"] == joint)
    if here.sum() < FEWEST:
        raise NotRun(f"there are {here.sum()} networks of {sweep} with {joint} joints; needed are {FEWEST}")
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
    drawn, *others = (
        _trend(
            f"|u_z| grows with the spacing, {HELD[keep]}",
            _networks(evidence, f"spacing, {HELD[keep]}")[U_Z],
            1,
            "grows",
        )
        for keep in ("shape", "wale_spacing", "length")
    )
    # What grows by one meaning alone is explained by one meaning alone, and the paper prints none.
    open_ = {row.grade == CONTRADICTED for row in (drawn, *others)} == {True, False}
    explained = drawn.margin >= 1 and not open_
    yield drawn.shown if explained else replace(drawn, grade=UNDECIDABLE)
    yield from (row.shown for row in others)
    yield Remark(
        joined(
            MISSING if open_ else "",
            f"networks with friction and {_joints(evidence)}; levers: between contacts of a side (inner), and of "
            "rows (outer)",
        )
    )


def _joints(evidence: Evidence) -> str:
    """Return in words how networks are joined."""
    return "pinned joints, as printed" if evidence.as_printed else "rigid arms"


@CLAIMS.add("K17")
def moment_of_inertia(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that a stiffer yarn of the same diameter spins less, and moves less far out of the plane.

    Solids decide where they are run: the springs of networks hold yarns together that open and slip in contact.
    """
    solids, finer = (_solids(evidence, "both", FRICTION, end) for end in ("", "-p3"))
    if len(solids) < FEWEST and evidence.base is not None:
        raise NotRun("no stiffer yarns are run under this reading")
    by_networks = [*_stiffer(_networks(evidence, TOGETHER), "networks")]
    note = ""
    if len(solids) >= FEWEST:
        by_solids, by_finer = [*_stiffer(solids, "solids")], [*_stiffer(finer, "solids, next degree")]
        if by_finer and worst(by_finer) != worst(by_solids):
            note = "missing is agreement of the discretisations"
            by_solids = [
                row if row.grade == other.grade else replace(row, grade=UNDECIDABLE)
                for row, other in zip(by_solids, by_finer, strict=True)
            ]
        yield from by_solids
        yield from (row.shown for row in (*by_finer, *by_networks))
    else:
        yield from by_networks
    for kind, (stiffer, sweep) in product((FRICTION, "tie"), STIFFER.items()):
        of_solids = _solids(evidence, stiffer, kind)
        if (kind, sweep) != (FRICTION, TOGETHER):
            if len(of_solids) > 1:
                yield _shares(of_solids, kind, sweep, "solids")
            yield _shares(_networks(evidence, sweep, interaction=kind), kind, sweep, "networks")
    yield _shares(_networks(evidence, "bending alone"), FRICTION, "bending alone", "networks")
    yield Remark(
        joined(
            note,
            f"stiffness of yarns of 1.2 to 1.95 mm at 1.8 mm; networks of beams with {_joints(evidence)}",
        ),
        tuple(solids.index) if len(solids) >= FEWEST else (),
    )


def _stiffer(values: pd.DataFrame, model: str) -> Iterator[Row]:
    """Yield whether motion and spin fall, in rising order of the stiffness, and by how much; nothing of few yarns."""
    if len(values) < FEWEST:
        return
    for column, what in ((U_Z, "|u_z|"), (SPIN, "spin")):
        yield _trend(f"{what} falls, friction, {model}", values[column], -1, "falls")
        share = values[column].iloc[-1] / values[column].iloc[0]
        bar = 1 / COMPARABLE
        name = f"{what} of the stiffest over that of the least stiff yarn, friction, {model}"
        yield holds(name, f"{share:.2f}", f"< {bar:.2f}", True, share <= bar, bar / share)


def _shares(values: pd.DataFrame, interaction: str, sweep: str, model: str) -> Row:
    """Return motion and spin of the stiffest over those of the least stiff yarn."""
    shares = (f"{values[column].iloc[-1] / values[column].iloc[0]:.2f}" for column in (U_Z, SPIN))
    return Row(f"the same of |u_z|; spin, {INTERACTIONS[interaction]}, {sweep}, {model}", "; ".join(shares))
