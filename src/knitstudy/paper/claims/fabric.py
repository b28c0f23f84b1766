"""Claims about the loop (G1 to G3), the knit's size (S1 to S5), and stress in the yarns (M1 to M5)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property

import numpy as np
import xarray as xr

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.models.rom2d.build import heights
from knitstudy.knit.yarns.joints import contacts_of_crossings
from knitstudy.measures import response
from knitstudy.measures.centre_cell import (
    LEGS,
    SEGMENT,
    angle_to_x,
    angles_to_axes,
    crossing_error,
    honeycomb_segments,
    loop_of,
)
from knitstudy.measures.estimate import Estimate, all_hold
from knitstudy.measures.reference import HEXAHEDRA, made_of, physics_of, transferred_uncertainty
from knitstudy.measures.response import memory_growth
from knitstudy.measures.stress_flow import Flow, flows_of
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.paper.cases import angles_by_geometry, angles_of_stress
from knitstudy.paper.claims import (
    CLAIMS,
    COMPARABLE,
    GOOD,
    MUCH,
    TREND,
    UNDECIDABLE,
    NotRun,
    Remark,
    Row,
    at_least,
    at_most,
    by_meanings,
    comparable,
    holds,
)
from knitstudy.paper.claims.evidence import Evidence
from knitstudy.paper.columns import DOF, Simulation
from knitstudy.paper.scene_names import INTERACTIONS
from knitstudy.paper.square_knits import (
    FACTOR,
    FACTOR_MULTIPLIED,
    MULTIPLIED,
    SIZES,
    SMALLEST,
    TIED,
    TOUCHING,
    series_of,
)

CONTACT_BAR = 1e-3  # Claim G1: largest |D - 2R - c0| over R at which yarns count as touching at points
# Claim S2: share by which the growth of the factor changes with the reach of contact, and with the order of elimination
# while that avoids wide cuts (docs/notes/performance.md)
COUNTED = 0.08
LENGTH_BAR = 0.02  # Claim G2: relative change of length that counts as hardly any
TIED_KNITS, LARGE = (
    "domain-yarns-tie-course",
    6,
)  # Claim S5: series, and least cells in a row of its largest knit
OF_SIZE = (  # Claim S5: quantity, what is compared, its unit, and the factor to that unit
    (response.FORCE, "force a row", "N", 1.0),
    (response.LARGEST_U_Z, "largest |u_z|", "mm", 1e3),
)
CELLS = ("pattern.loops", "pattern.rows")  # Claim S5: keys in which knits of several sizes differ
ALONG = 20.0  # Claims M3, M5: angle up to which a ligament lies along the principal stress [deg]


@CLAIMS.add("G1")
def penetration(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the yarns penetrate each other before the optimisation, and only touch after it."""
    geometry = evidence.geometry
    radius = float(evidence.geometry["radius"])
    before, after = (
        float(geometry["penetration"].sel(state=state)) / radius for state in ("before", "after")
    )
    error = float(crossing_error(geometry).sel(state="after")) / radius
    yield holds("deepest penetration after", f"{after:.3f} R", "none", after == 0)
    yield holds("deepest penetration before", f"{before:.3f} R", "severe", before > 0)
    yield at_most("largest |D - 2R - c0| at a crossing", error, "0", CONTACT_BAR, text=f"{error:.1e} R")
    yield Remark(
        f"with a clearance c0 of {float(geometry['clearance']):g} R; the initial loop is not printed, so its "
        "penetration is this study's own"
    )


@CLAIMS.add("G2")
def length(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the yarn of a loop hardly changes its length; the rows beside it are of its Bezier curves."""
    before, after = (
        loop_of(evidence.geometry, state).curve.segment_lengths() for state in ("before", "after")
    )
    change = after / before - 1
    total = after.sum() / before.sum() - 1
    yield at_most("change of a loop", abs(total), "hardly any", LENGTH_BAR, text=f"{total:+.2%}")
    yield Row("largest change of a Bezier curve", f"{max(change, key=abs):+.2%}")
    yield Row("least change of a Bezier curve", f"{min(change, key=abs):+.2%}")
    yield Remark(f"arc lengths; a change of up to {LENGTH_BAR:.0%} counts as hardly any")


@CLAIMS.add("G3")
def heights_of_contacts(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the contact zones of the undeformed knit differ little in height."""
    height = evidence.contact("isotropic")["centroid"].to_numpy()[:, 2]
    drawn = contacts_of_crossings(evidence.fabric)["centroid"].to_numpy()[:, 2]
    spread, by_geometry = np.ptp(height), np.ptp(drawn)
    over = float(spread / evidence.diameter)
    text = f"{over:.3f} d, {1e3 * spread:.3f} mm"
    yield at_most("range of the heights of contact zones", over, "small", GOOD, sense=1.0, text=text)
    yield Row("the same of crossings by geometry", f"{1e3 * by_geometry:.3f} mm")
    yield Remark("centroids on the undeformed yarns", (evidence.direct["isotropic"],))


@CLAIMS.add("S1")
def growth_of_ties(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that degrees of freedom of tied knits are the paper's at 3 x 3 cells and at 30 x 30 cells."""
    few, many = (evidence.counted(TIED, n, DOF.head) for n in (SIZES[0], SIZES[-1]))
    three = evidence.printed("5", "dns-tie 3x3", "degrees of freedom")
    thirty = evidence.printed("fig12a", "c30w30 tie", "degrees of freedom")
    name = "degrees of freedom, {0} x {0} cells"
    yield comparable(name.format(30), many, thirty, f"{many:,.0f}", f"some {thirty:,.0f}")
    yield comparable(name.format(3), few, three, f"{few:,.0f}", f"{three:,.0f}")
    yield Row("exponent in cells in a row", f"{np.log10(many / few):.2f}", f"{np.log10(thirty / three):.2f}")
    yield Remark("counted without a solution")


@CLAIMS.add("S2")
def memory_of_contact(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the factor of knits in contact grows from 3 x 3 to 30 x 30 cells as the memory in Table 3."""
    printed = [evidence.printed("3", f"c{n}w{n}", "memory") for n in SIZES]
    grows = printed[-1] / printed[0]
    shown = [Row("exponent in cells in a row, Table 3", "", f"{_exponent(printed):.2f}")]
    for column, how in ((FACTOR, "by penalties"), (FACTOR_MULTIPLIED, "with multipliers")):
        memory = [evidence.counted(TOUCHING, n, column) for n in SIZES]
        factor = memory[-1] / memory[0]
        name = f"factor of 30 x 30 over that of 3 x 3 cells, contact {how}"
        growth = Estimate(factor, COUNTED * factor)
        yield comparable(name, growth, grows, f"{factor:.0f} ± {growth.uncertainty:.0f}", f"{grows:.0f}")
        shown.append(Row(f"exponent in cells in a row, contact {how}", f"{_exponent(memory):.2f}"))
        for end in (0, -1):
            name = f"factor, {SIZES[end]} x {SIZES[end]} cells, contact {how}"
            shown.append(Row(name, f"{memory[end]:,.0f} MB", f"{printed[end]:,.0f} MB"))
    yield from shown
    yield from _of_runs(evidence)
    yield Remark(
        "entries of the factor after nested dissection, 8 bytes each, counted without a solution; the order in which "
        "the paper's solver eliminates unknowns is not printed"
    )


def _of_runs(evidence: Evidence) -> Iterator[Row]:
    """Yield the exponent of the resident memory of runs of hexahedra in contact, where the study has them."""
    friction = INTERACTIONS["isotropic"]
    simulated = (row for row in evidence.rows.values() if "simulation" in row.results)
    for series in series_of(simulated):
        if series.model.startswith(HEXAHEDRA["one_point"]) and series.interaction == friction:
            exponent = series.growth([memory_growth(row.history) for row in series.rows])
            sizes = ", ".join(map(str, series.cells))
            yield Row(
                f"exponent of the memory of runs, iterative solver, {sizes} cells in a row", f"{exponent}"
            )


def _exponent(values: Sequence[float]) -> float:
    """Return the exponent of a power law of values at `SIZES` in cells in a row."""
    return float(np.polyfit(np.log(SIZES), np.log(values), 1)[0])


@CLAIMS.add("S4")
def exponentially(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that an exponential leaves much less of the unknowns of Table 3 than a power law of the cells in a row."""
    printed = [evidence.printed("3", f"c{n}w{n}", "degrees of freedom") for n in SIZES]
    left = _left(printed)
    name = "what an exponential leaves of log(unknowns), Table 3"
    texts = [f"{each:.3f}" for each in left]
    yield at_most(name, left[0], "less than a power", left[1] / MUCH, sense=left[1], text=texts[0])
    yield Row("what a power law leaves", texts[1])
    yield Row("exponent of the power law", f"{np.polyfit(np.log(SIZES), np.log(printed), 1)[0]:.2f}")
    if evidence.counted_unknowns is not None:
        ours = (f"{each:.3f}" for each in _left([evidence.counted(TIED, n, DOF.head) for n in SIZES]))
        yield Row("the same of this study's hexahedra, exponential; power law", "; ".join(ours))
    yield Remark("Table 3 is the paper's own")


def _left(unknowns: Sequence[float]) -> tuple[float, float]:
    """Return the root mean square of what an exponential, and a power law, leave of the logarithm of unknowns."""
    fits = (np.polyfit(x, np.log(unknowns), 1, full=True)[1] for x in (SIZES, np.log(SIZES)))
    exponential, power = (float(np.sqrt(squares[0] / len(SIZES))) for squares in fits)
    return exponential, power


@CLAIMS.add("S5")
def size_dependence(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that force a row and largest |u_z| of tied knits in course tension depend on the number of cells."""
    knits = _knits_by_cells(evidence)
    three, largest = knits[SMALLEST], max(knits)
    known = evidence.reference_for(three.scene.name)
    strain = response.common_strain(row.history for row in knits.values())
    if not known.strains(response.FORCE, strain):
        raise NotRun("there is no reference of 3 x 3 cells")
    shown = []
    for quantity, name, unit, scale in OF_SIZE:
        at = max(known.strains(quantity, strain))
        values = {
            cells: transferred_uncertainty(known, three.history, row.history).at(quantity, at)
            for cells, row in knits.items()
        }
        if quantity == response.FORCE:  # all rows carry it
            values = {
                cells: Estimate(of.value / cells, of.uncertainty / cells) for cells, of in values.items()
            }
        ends = (values[SMALLEST], values[largest])
        less, more = sorted(ends, key=lambda estimate: estimate.value)
        ratio = f"{name}, larger over smaller of {SMALLEST} and {largest} cells in a row"
        yield at_least(ratio, more.over(less), "significant", COMPARABLE, sense=1 + GOOD)
        for cells, of in values.items():
            scaled = Estimate(scale * of.value, scale * of.uncertainty)
            shown.append(Row(f"{name}, {cells} x {cells} cells", f"{scaled} {unit}"))
    yield from shown
    yield Remark("course tension, ties", tuple(row.scene.name for row in knits.values()))


def _knits_by_cells(evidence: Evidence) -> dict[int, Simulation]:
    """Return tied knits in course tension by their cells in a row, the smallest first; `NotRun` without large ones."""
    series = next((each for each in series_of(evidence.rows.values()) if each.stem == TIED_KNITS), None)
    knits = {} if series is None else dict(zip(series.cells.tolist(), series.rows, strict=True))
    if SMALLEST not in knits or max(knits) < LARGE:
        raise NotRun(f"the study has no tied knits of {SMALLEST} and of {LARGE} or more cells in a row")
    physics = [physics_of(row.scene) | dict.fromkeys(CELLS) for row in knits.values()]
    if any(each != physics[0] for each in physics):
        raise NotRun("the knits differ by more than their number of cells")
    return knits


@CLAIMS.add("S3", worst_first=True)
def unknowns_of_contact(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that contact takes more degrees of freedom than ties, with its multipliers counted."""
    counts = {
        n: tuple(evidence.counted(TOUCHING, n, column) for column in (DOF.head, MULTIPLIED))
        for n in (SIZES[0], SIZES[-1])
    }
    ties = {
        3: evidence.printed("5", "dns-tie 3x3", "degrees of freedom"),
        30: evidence.printed("fig12a", "c30w30 tie", "degrees of freedom"),
    }
    contact = {n: evidence.printed("3", f"c{n}w{n}", "degrees of freedom") for n in ties}
    for n, (solid, multiplied) in counts.items():
        name = f"degrees of freedom, contact over ties, {n} x {n} cells"
        ratio, paper = multiplied / solid, contact[n] / ties[n]
        yield comparable(name, ratio, paper, f"{ratio:.2f}", f"{paper:.2f}", direction=ratio > 1)
    few = SIZES[0]
    touching = few * (few - 2)  # cells; outer rows are tied
    ours, theirs = (counts[few][1] - counts[few][0]) / touching, (contact[few] - ties[few]) / touching
    times = f"{theirs:,.0f} = {theirs / ours:.4g} x {ours:,.0f}"
    yield Row("contact variables a cell in contact", f"{ours:,.0f}", times)
    yield Remark(
        "three multipliers at every surface node of one yarn of each pair in contact; penalties add none. The paper "
        "does not say which variables it counts"
    )


# ---- Maximum principal stress in the segments of a cell


class Stressed:
    """Stresses with isotropic friction in both tensions, of the deciding discretisation first, and the drawn knit."""

    def __init__(self, evidence: Evidence) -> None:
        self.evidence = evidence
        self.knit = evidence.fabric
        self.rows = {
            case.direction: [row for row in (case.dns, *case.others) if "stress" in row.results]
            for case in evidence.cases
            if case.interaction == "isotropic"
        }
        if len(self.rows) < 2 or not all(self.rows.values()):
            raise NotRun("the study has no stresses with isotropic friction in course and in wale tension")

    def datasets(self, way: str) -> list[xr.Dataset]:
        """Return the stresses in a tension."""
        return [row.results["stress"] for row in self.rows[way]]

    @cached_property
    def angles(self) -> dict[str, dict[str, Estimate]]:
        """Angle to x of the maximum principal stress by tension and kind of segment [deg]."""
        return {way: {kind: angle_to_x(self.datasets(way), kind) for kind in self.drawn} for way in self.rows}

    @cached_property
    def drawn(self) -> dict[str, float]:
        """Angle to x of every segment by geometry [deg]."""
        lines = honeycomb_segments(contacts_of_crossings(self.knit))
        return {kind: float(angles_to_axes(line)[:, 0].mean()) for kind, line in lines.items()}

    def printed(self, way: str) -> Floats:
        """Return the angles to x of segments 1 to 6 in Table 4 (6,) [deg]."""
        angles: Floats = angles_of_stress(self.evidence.paper, way)[:, 0]
        return angles

    def remark(self, note: str = "") -> Remark:
        """Return a note with the origins of the uncertainty, and the scenes."""
        others = {made_of(row.scene) for rows in self.rows.values() for row in rows[1:]}
        beside = f", {', '.join(sorted(others))} beside it" if others else ""
        scenes = tuple(row.scene.name for rows in self.rows.values() for row in rows)
        return Remark(f"{note}uncertainty by equivalent segments{beside}", scenes)


@CLAIMS.add("M1")
def directions(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the maximum principal stress of legs turns from the yarn to the load, as far as in Table 4."""
    stressed = Stressed(evidence)
    shown = []
    for way in stressed.rows:
        towards = -1 if way == "course" else 1
        turns, theirs = [], []
        for kind in LEGS:
            angle = stressed.angles[way][kind]
            line = stressed.drawn[kind]
            paper = stressed.printed(way)[SEGMENT[kind] - 1]
            turns.append(_turn(angle, line, towards))
            theirs.append(towards * (paper - line))
            place = f"segment {SEGMENT[kind]}, {way} tension ({line:.0f}° by geometry)"
            shown.append(Row(place, f"{angle}°", f"{paper:g}°"))
        turned = [turn.above(0.0) for turn in turns]
        ours = f"{sum(each is True for each in turned)} of {len(turns)}"
        name = f"segments turned to the load, {way} tension"
        yield holds(name, ours, f"{len(turns)}", all_hold(turned))
        mean = Estimate(
            *(float(np.mean([getattr(turn, of) for turn in turns])) for of in ("value", "uncertainty"))
        )
        paper = float(np.mean(theirs))
        name = f"mean turn of these, {way} tension"
        yield comparable(name, mean, paper, f"{mean}°", f"{paper:.0f}°", direction=mean.above(0.0))
    yield from shown
    yield stressed.remark()


def _turn(angle: Estimate, line: float, towards: int) -> Estimate:
    return angle.of(lambda value: towards * (value - line))


@CLAIMS.add("M2")
def compressed(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the honeycomb by principal stress is compressed along wales in course tension, stretched in wale."""
    stressed = Stressed(evidence)
    for way in stressed.rows:
        ratio = height_ratio(stressed.knit, stressed.datasets(way))
        angles = stressed.printed(way)
        # By the angles of Table 4, through the same formula
        printed = _height(stressed.knit, [angles[1:3].mean(), angles[3:5].mean()])
        sense = ratio.below(1.0) if way == "course" else ratio.above(1.0)
        name = f"height over that by geometry, {way} tension"
        yield comparable(name, ratio, printed, f"{ratio}", f"{printed:.2f}", direction=sense)
    yield stressed.remark(f"distances along x are kept; comparable: a factor of {COMPARABLE:g}; ")


def height_ratio(knit: Fabric, stresses: Sequence[xr.Dataset]) -> Estimate:
    """Return the height of a row by principal stress over that of the knit; the first discretisation decides."""
    pairs = [[angle_to_x(stresses, kind) for kind in LEGS[i : i + 2]] for i in (0, 2)]
    value = np.array([np.mean([angle.value for angle in pair]) for pair in pairs])
    off = np.array([max(angle.uncertainty for angle in pair) for pair in pairs])
    # No line is steeper than 90 degrees.
    ratio, *ends = (_height(knit, np.minimum(value + sign * off, 90 - 1e-6)) for sign in (0, -1, 1))
    return Estimate(ratio, max(abs(end - ratio) for end in ends))


def _height(knit: Fabric, angles: Sequence[float]) -> float:
    """Return the height of a row over that of the knit by the angles of both pairs of legs to x [deg]."""
    return float(heights(knit, contacts_of_crossings(knit), *angles).course / knit.cell[1])


@CLAIMS.add("M3")
def ligaments(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that legs by geometry lie between principal stresses of both tensions, and all segments along these."""
    stressed = Stressed(evidence)
    angles, drawn = stressed.angles, stressed.drawn
    between = [
        all_hold((angles["course"][kind].below(drawn[kind]), angles["wale"][kind].above(drawn[kind])))
        for kind in LEGS
    ]
    lines = angles_by_geometry(evidence.paper)[:, 0]
    near, shown = [], []
    for way in stressed.rows:
        for kind, line in drawn.items():
            apart = _apart(angles[way][kind], line)
            number = SEGMENT[kind]
            theirs = f"{abs(stressed.printed(way)[number - 1] - lines[number - 1]):.0f}°"
            near.append(apart.below(ALONG))
            shown.append(
                (apart.value, Row(f"segment {number} to the stress, {way} tension", f"{apart}°", theirs))
            )
    ours = f"{sum(along is True for along in near)} of {len(near)}"
    name = f"segments within {ALONG:g}° of the stress"
    yield holds(name, ours, "consistent", all_hold(between), all_hold(near))
    for _, row in sorted(shown, key=lambda entry: entry[0], reverse=True):
        yield row
    yield stressed.remark()


def _apart(angle: Estimate, line: float) -> Estimate:
    return angle.of(lambda value: abs(value - line))


# ---- Stress along the yarns


def _flows(evidence: Evidence) -> Iterator[tuple[str, str, dict[str, Flow]]]:
    """Yield tension, scene, and flow of stress by its meaning, with friction in course and in wale tension."""
    for way in ("course", "wale"):
        pulled = evidence.pulled_in(way)
        row = pulled.row("isotropic", "stress")
        radius = 0.5 * evidence.diameter
        flows = flows_of(row.results["stress"], row.history, pulled.contact("isotropic"), radius)
        if not all(flow.weight.sum() > 0 for flow in flows.values()):
            raise NotRun("no stress belongs to a segment between contact zones")
        yield way, pulled.direct["isotropic"], flows


def _of_flows(evidence: Evidence, test: Callable[[str, Flow], Row]) -> Iterator[Row | Remark]:
    """Yield a test of the flow of stress in both tensions, open where the meanings of the flow decide it otherwise."""
    scenes, found = [], []
    for way, scene, flows in _flows(evidence):
        found += by_meanings([test(f"{way} tension, {meaning}", flow) for meaning, flow in flows.items()])
        scenes.append(scene)
    yield from found
    undecided = any(row.grade == UNDECIDABLE for row in found)
    note = "missing is whether Fig. 13 shows means of sections or points of the yarn" if undecided else ""
    yield Remark(note, tuple(scenes))


@CLAIMS.add("M4", worst_first=True)
def deflected(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that near contacts the maximum principal stress leaves the yarn's direction further than elsewhere."""

    def test(label: str, flow: Flow) -> Row:
        near, far = flow.mean_angle(flow.at_contact), flow.mean_angle(flow.away)
        if np.isnan(near + far):
            raise NotRun("nothing of the yarns lies at a contact, or nothing away from all crossings")
        ratio = near / far if far else np.inf
        text = f"{ratio:.2f} ({near:.1f}° over {far:.1f}°)"
        name = f"angle of the stress to the yarn, at contacts over elsewhere, {label}"
        return at_least(name, ratio, "deflected", COMPARABLE, sense=1.0, text=text)

    yield from _of_flows(evidence, test)


@CLAIMS.add("M5", worst_first=True)
def along_loops(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that most of the maximum principal stress lies along the yarns."""

    def test(label: str, flow: Flow) -> Row:
        share = flow.share_within(ALONG)
        name = f"share of the stress within {ALONG:g}° of the yarn, {label}"
        return at_least(name, share, "most", TREND, sense=0.5, text=f"{share:.0%}")

    yield from _of_flows(evidence, test)
    lines = angles_by_geometry(evidence.paper)[:, 0]
    for way in ("course", "wale"):
        apart = np.abs(angles_of_stress(evidence.paper, way)[:, 0] - lines)
        yield Row(
            f"segments of Table 4 within {ALONG:g}° of the loop, {way} tension",
            "",
            f"{(apart <= ALONG).mean():.0%}",
        )
