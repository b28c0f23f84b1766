"""The sheet of a fabric: its construction, its shape at rest, and how it stretches, shears and bends, on one page.

All numbers are those of one cell of beams in contact. A coarse path without friction at rest finds the strain at which
the fabric carries a force per width; the path that counts goes there from rest with friction, in even increments, and
back where it is a cycle. The difference of both is an uncertainty: friction holds a fabric anywhere between them.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from math import isnan, nan
from pathlib import Path
from re import sub
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.datasets import STRAINS, file_digest, write_table
from knitstudy.errors import (
    ConfigurationError,
    ConvergenceError,
    DataFileError,
    KnitstudyError,
    MissingPackageError,
    UnwritableError,
    message_of,
)
from knitstudy.files import replacing_together, write_text
from knitstudy.knit.loading.run import silent
from knitstudy.knit.loading.solve import UNSTABLE
from knitstudy.knit.models.beam import CellOfBeams
from knitstudy.knit.models.beam.cell import hidden_wave
from knitstudy.knit.scene.alternatives import OF_BEAMS
from knitstudy.knit.scene.documents import CONFIG
from knitstudy.knit.scene.kinds import unit_of
from knitstudy.knit.scene.scene import Scene, flat, unit_warnings
from knitstudy.knit.scene.sections import INLAY
from knitstudy.knit.scene.specimens import Looped
from knitstudy.knit.scene.stitches import is_plain, size_of_repeat
from knitstudy.measures.construction import yarn_in_a_stitch
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.registry import naming_extra
from knitstudy.run.inputs import SHARE, STEP, Changed, changed, inputs_of
from knitstudy.run.plan import Plan
from knitstudy.run.simulations import processes
from knitstudy.run.store import OF_STUDY, BeginProgress, NotKept, Store
from knitstudy.use.decks.fabric import LAWS, write_membrane, write_sliding
from knitstudy.use.fabric_law import membrane
from knitstudy.use.measured_curve import (
    PULL,
    STRAIN,
    branches,
    curve_table,
    force_over_strain,
)
from knitstudy.use.sheet_numbers import (
    BOTH,
    NOT_KNOWN,
    PERCENT,
    PRESS,
    SHEAR,
    SHEARED,
    bending_rows,
    construction_rows,
    is_slack,
    load_rows,
    thickness_rows,
    when,
)

log = logging.getLogger(__name__)

FORCE = 100.0  # N/m
PRESSURES = (49.0, 1000.0, 4900.0)  # Pa, of KES-FB3, ISO 5084, and the largest one of KES
LIGHT = 0.1  # of that force: where strains change with inputs most
SIZES = ("pattern.loop_length", "pattern.course_spacing")
FARTHER, BEYOND = 1.1, 1.03  # times the force, and times the strain there: so both starts reach the force
COARSE = [[0.02, 0.005], [0.1, 0.02], [3.97, 0.06]]  # ends of increments of the path that finds the strain
# Ends of increments between plates. Pressure rises from nothing as a power of how far plates have closed: increments
# that grow by the same ratio have its work to 4 % at any small pressure, up to a power of 2.
CLOSE = [*(1e-5 * 2 ** (0.5 * np.arange(22))).tolist(), [0.1, 0.01], [0.88, 0.04]]
EVEN = 15  # increments of a leg of the path that counts
BACK = 0.02  # of the largest strain, where a cycle ends
MEMBRANE = "membrane.{}.inp".format
SHELL = "shell.abaqus.inp"
PAGE, NUMBERS = "sheet.html", "numbers.csv"
DECKS = (*map(MEMBRANE, LAWS), SHELL)
ENDED = "incomplete"  # attribute of a history that ended early: where, and why
STARTS = ("rest_with_friction", "rest")
# Wale spacings over those of the scene, course spacings under them, of other loops of the same yarn: friction holds a
# fabric where its knitting has left it, and fabrics come off machines up to a fifth longer or wider than they relax to
OTHERWISE = (1.2, 1 / 1.2)
VERIFIED, ERROR = 0.3, 0.11  # gates.point up to which forces have at most this error (docs/notes/beams.md)

# A load that turns: of bending as well
THERE_AND_BACK: dict[str, Any] = {"load.strain": 0.05, "load.turns": [0.1]}

CYLINDER = (
    "Bending is that of a cylinder: nothing pulls in the plane, the axis stays straight, nothing twists. Widths and "
    "curvatures are those of the flat cell at rest. A moment is positive where its front is to be the longer side."
)
VALUES = tuple(f".{name}" for name in ("youngs_modulus", *OF_BEAMS))  # of yarns, in a note
BANDS = (
    "Uncertainties are at least the difference to a start without friction at rest and, at rest and in course and wale "
    "direction, to loops of the same yarn drawn a fifth wider and narrower. A cycle leaves more: see there."
)
DRAWN = "The fabric starts from its drawn loops (load.start: drawn): there is no other start."
KNOWN = f"Uncertainties are at least the error of the model, {100 * ERROR:g} % of the forces."
UNKNOWN = f"The error of the model comes on top; it is known of knits and purls with gates.point up to {VERIFIED:g}."


@dataclass(frozen=True, eq=False)
class Sheet:
    """What is known of a fabric; `knitstudy.fabric_sheet` makes it."""

    scene: Scene
    numbers: pd.DataFrame  # texts: quantity, value, uncertainty, unit, remark
    curves: pd.DataFrame  # strains, forces per width and energy of every load, one after the other
    notes: tuple[str, ...]
    histories: dict[str, xr.Dataset]  # by load
    tied: xr.Dataset | None  # history of the tied cell, for bending

    def _repr_html_(self) -> str:
        """Notebooks show the table of numbers."""
        return self.numbers.to_html(index=False)

    def write(self, folder: Path | str) -> list[Path]:
        """Write page, tables and decks into a folder, all or none, and return their paths, the page first.

        Without the extra ``pictures`` there is no page, which a warning says.
        A law that cannot be fitted is a note. A warning says where another sheet is replaced.
        Raises DataFileError when the folder cannot be written; an earlier sheet is then as it was.
        """
        folder = Path(folder)
        with replacing_together(folder, stale=(PAGE, *DECKS)) as beside:
            names = self._write(beside)
            earlier, now = folder / NUMBERS, beside / NUMBERS
            if earlier.is_file() and file_digest(earlier) != file_digest(now):
                log.warning("%s: a sheet with other numbers is replaced; -o keeps both", folder)
        return [folder / name for name in names]

    def _write(self, folder: Path) -> list[str]:
        """Write all files into an empty folder, and return their names, the page first."""
        notes = [*self.notes]
        files = [NUMBERS, "curves.csv"]
        for name, table in zip(files, (self.numbers, self.curves), strict=True):
            write_table(table, folder / name)
        texts = self.numbers.set_index("quantity")["value"]
        bending = [texts[f"bending stiffness, {way}"] for way in STRAINS[:2]]
        course, wale = pd.to_numeric(bending, errors="coerce")
        known = (course, wale) if course > 0 and wale > 0 else self.tied
        needs = (
            f"bending stiffnesses of yarns that slide; these are {' and '.join(bending)} N m (course, wale)"
        )
        try:
            law = membrane(self.histories)
            for dialect in LAWS:
                write_membrane(law, folder / MEMBRANE(dialect), dialect, self.scene.name)
                files.append(MEMBRANE(dialect))
            if known is None:
                notes.append(f"{SHELL} is not written: it needs {needs}.")
            else:
                write_sliding(law, known, folder / SHELL, self.scene.name)
                files.append(SHELL)
                if known is self.tied:
                    notes.append(f"{SHELL} bends as tied yarns, since it needs {needs}.")
        except UnwritableError:
            raise
        except DataFileError as error:
            notes.append(f"There is no deck of a membrane or a shell: {error}.")
        try:
            with naming_extra():
                from knitstudy.use.sheet_page import page_of
        except MissingPackageError as error:
            log.warning("%s is not written: %s", PAGE, error)
            return files
        shown = {"notes": notes, "files": files, "diameters": _each(2e3 * np.asarray(self.scene.radius))}
        write_text(page_of(self.curves, vars(self) | shown), folder / PAGE)
        return [PAGE, *files]


def fabric_sheet(
    scene: Scene,
    *,
    tex: float = nan,
    force: float = FORCE,
    ratios: Sequence[float] = (1.0,),
    pressures: Sequence[float] = PRESSURES,
    folder: Path | str | None = None,
    config: Path = CONFIG,
    progress: BeginProgress | None = None,
) -> Sheet:
    """Return the sheet of the fabric of a scene: one to two minutes where nothing is kept.

    Parameters
    ----------
    scene : Scene
        A knit or a cell of any model; its fabric is simulated as a cell of beams that slide with friction. It starts
        from rest unless its drawn loops are free of stress (`load.start: drawn`).
    tex : float
        Linear density of the yarn [g/km] (`knitstudy.measures.construction.tex_of` a density), by default that of the
        scene (`yarn.of`, `yarn.tex`); without it there is no mass.
    force : float
        Force per width up to which it is pulled [N/m].
    ratios : sequence of float
        Wale strains over course strains of the paths on which both are prescribed.
    pressures : sequence of float
        Pressures of plates at which the thickness is given [Pa].
    folder, config, progress
        As of `knitstudy.simulate`: histories are kept in the folder and used again.

    Raises
    ------
    ConfigurationError
        When the scene has no loops, or keys that a cell of beams does not have.
    ConvergenceError
        When the fabric does not find its shape at rest.
    """
    plan = Plan.of(config)
    scene = plan.labelled(scene)  # sheets of changed and of unnamed scenes have folders of their own
    cell = cell_of(scene)
    _require_tex_of_all_yarns(cell, tex, scene.name)
    starts = STARTS if cell.load.start in STARTS else (cell.load.start,)
    friction_at_rest = len(starts) > 1
    for warning in unit_warnings(cell):
        log.warning(warning)
    store = Store(None if folder is None else Path(folder), (OF_STUDY,), progress or (lambda label: silent))
    maker = _Maker(cell, starts, FARTHER * force, plan, store)
    made = _simulated(maker, ratios, max(pressures), LIGHT * force)
    others = [maker.coarse if friction_at_rest else {}, *made.otherwise]
    verified = is_plain(cell.pattern.stitches) and cell.gates.point <= VERIFIED
    curves = _curves(made, others, verified)
    told = cell.tex if isnan(tex) else tex
    maker.notes.insert(0, _of_yarns(cell, told))
    maker.notes.insert(1, _of_inputs(maker, made.with_inputs, LIGHT * force))
    for start, by_load in zip(starts, (made.histories, maker.coarse), strict=False):
        maker.notes += _of_rest(start, by_load["course"])
    known_error = ERROR if verified else 0.0
    notes = (BANDS if friction_at_rest else DRAWN, KNOWN if verified else UNKNOWN, CYLINDER, *maker.notes)
    along_courses = [of["course"] for of in (made.histories, *others) if of]
    rows = [
        *construction_rows(cell, along_courses, told),
        *thickness_rows(curves[PRESS], pressures),
        *load_rows(curves, force, is_slack(made.histories["shear"])),
        *bending_rows(made.bent, known_error, made.tied),
    ]
    return Sheet(
        scene=scene,
        numbers=pd.DataFrame(rows, columns=["quantity", "value", "uncertainty", "unit", "remark"]),
        curves=pd.concat([of[0].assign(load=load) for load, of in curves.items()]),
        notes=notes,
        histories=made.histories,
        tied=made.tied,
    )


def _require_tex_of_all_yarns(cell: CellOfBeams, tex: float, name: str) -> None:
    """Refuse a linear density for two yarns."""
    if not isnan(tex) and len(cell.yarns) > 1:
        raise ConfigurationError(
            f"scene {name!r}: tex is {tex:g}, of one yarn; set yarn.tex and yarn_b.tex, or yarn.of and yarn_b.of"
        )


@dataclass(frozen=True, eq=False)
class _Simulated:
    """Results of all simulations of a sheet."""

    bent: list[Any]  # by start
    histories: dict[str, xr.Dataset]  # by load
    pressed: list[xr.Dataset]  # by start
    with_inputs: list[Changed]  # course strains with changed inputs
    otherwise: list[dict[str, xr.Dataset]]  # histories by load, of loops that are drawn otherwise
    tied: xr.Dataset | None


def _simulated(maker: _Maker, ratios: Sequence[float], pressure: float, light: float) -> _Simulated:
    """Simulate bending, all loads, plates up to a pressure [Pa], and changed inputs at a `light` force [N/m]."""
    cell = maker.cell
    starts = maker.starts
    loads = {way: {"load.deformation": way, "load.ratio": 1.0} for way in STRAINS}
    loads |= {f"{BOTH} 1:{r:g}": {"load.deformation": "biaxial", "load.ratio": r} for r in ratios}
    inputs = _inputs(cell)
    # The length of yarn that tucks, floats and inlays are drawn with is not that of their stitches.
    loops_alone = set("".join(cell.pattern.stitches)) <= {"K", "P"} and INLAY not in cell.yarn_b.rows
    drawings = OTHERWISE if len(starts) > 1 and loops_alone else ()
    # Bending takes longest, and begins first; what takes little time fills the gaps at the end.
    tasks: list[Callable[[_Maker], Any]] = [
        *(partial(_Maker.bending, start=start) for start in starts),
        *(partial(_Maker.history, load=load, keys=keys) for load, keys in loads.items()),
        *(partial(_Maker.pressed, start=start, pressure=pressure) for start in starts),
        *(partial(_Maker.with_input, key=key, force=light) for key in inputs),
        *(partial(_Maker.drawn_otherwise, wider=wider) for wider in drawings),
        _Maker.tied,
    ]
    made = iter(maker.side_by_side(tasks))
    return _Simulated(  # in the order of the tasks
        bent=list(islice(made, len(starts))),
        histories=dict(zip(loads, islice(made, len(loads)), strict=True)),
        pressed=list(islice(made, len(starts))),
        with_inputs=list(islice(made, len(inputs))),
        otherwise=list(islice(made, len(drawings))),
        tied=next(made),
    )


def _curves(
    made: _Simulated, others: Sequence[dict[str, xr.Dataset]], verified: bool
) -> dict[str, list[pd.DataFrame]]:
    """Return curves by load: of the start that counts, of others, and if `verified` with errors of the model."""
    curves = {
        load: [curve_table(of[load]) for of in (made.histories, *others) if load in of]
        for load in made.histories
    }
    curves[PRESS] = [curve_table(of) for of in made.pressed]
    if verified:
        for load, both in curves.items():
            both += _with_errors_of_model(both[0], unlike=load.startswith(BOTH))
    return curves


def _with_errors_of_model(curve: pd.DataFrame, unlike: bool) -> list[pd.DataFrame]:
    """Return a curve with all forces at both ends of the error of beams; `unlike` also in opposite directions."""
    forces = curve.filter(regex="force|pressure|energy")
    wale = forces.columns.str.startswith("wale")
    signs = [(course, across) for course in (-1, 1) for across in ((-1, 1) if unlike else (course,))]
    return [
        curve.assign(**forces * np.where(wale, 1 + across * ERROR, 1 + course * ERROR))
        for course, across in signs
    ]


def cell_of(scene: Scene) -> CellOfBeams:
    """Return the cell of beams of the fabric of a scene; ConfigurationError when that has no loops, or other keys."""
    if not isinstance(scene, Looped):
        wanted = f"specimen is {scene.specimen} but must be made of loops"
        raise ConfigurationError(f"scene {scene.name!r}: {wanted}")
    changes: dict[str, Any] = {"load.turns": [], "load.stops": [], "load.lateral": "free"}
    if not isinstance(scene, CellOfBeams):
        loops, rows = size_of_repeat(scene.pattern.stitches)
        changes |= {"specimen": "cell", "fidelity": "beam", "interaction": "isotropic", "outputs": []}
        changes |= {"knit": f"{scene.knit}-cell", "pattern.loops": loops, "pattern.rows": rows}
    made = scene.vary(changes)
    assert isinstance(made, CellOfBeams)
    return made


def _of_yarns(cell: CellOfBeams, tex: Floats | float) -> str:
    """Return the note that names the values of the yarns, without values that other values replace."""
    values = [f"contact.friction {cell.friction:.4g}"]
    for key, value in flat(cell.to_dict()).items():
        if key.endswith(VALUES) and value is not None and not cell.replaced_by(key):
            values.append(f"{key} {value:.4g} {unit_of(key)}")
    values.append(f"tex {_each(tex)}")
    return f"Uncertainties are not those of the yarn's values: {', '.join(values)}."


def _of_rest(start: str, history: xr.Dataset) -> list[str]:
    """Return notes about the unstable shapes that the relaxation left, or that the cell hides."""
    known = history.attrs
    notes = []
    if known.get("saddles"):
        changes = zip(("width", "height", "thickness"), known["change_from_saddle"], strict=True)
        went = ", ".join(f"{size} {PERCENT * change:+.2g} %" for size, change in changes)
        notes.append(f"From {start}: the first equilibrium is not stable, and the fabric leaves it ({went}).")
    if hides := hidden_wave(known):
        notes.append(f"From {start}: {hides}.")
    return notes


def _inputs(cell: CellOfBeams) -> list[str]:
    """Return the inputs that strains change with most: the yarn in a stitch or what it is drawn for, and the yarn's."""
    known = inputs_of(cell)
    size = next((key for key in SIZES if key in known), None)
    return [key for key in (size, "yarn.diameter", "yarn.bending") if key in known]


def _of_inputs(maker: _Maker, answers: Sequence[Changed], force: float) -> str:
    """Return the note about the inputs that change a strain."""
    curve = curve_table(maker.coarse["course"])

    def strain(force: float) -> float:
        return when(curve, STRAIN("course"), PULL("course"), force)

    effects = [answer.effect(strain(force)) for answer in answers]
    if maker.cell.value("yarn.bending") is None:  # forces are proportional to the modulus
        stiffer = Changed("yarn.youngs_modulus", 1 + STEP, strain(force / (1 + STEP)))
        effects.append(stiffer.effect(strain(force)))
    shares = ", ".join(str(effect) for effect in effects if effect) or NOT_KNOWN
    more = f"Of {PERCENT * SHARE:g} % more of an input"
    return f"{more}, the course strain at {force:g} N/m changes, as a share of itself: {shares}."


def _each(values: Floats | float) -> str:
    """Return a value, or the different values of rows, in words."""
    different = dict.fromkeys(np.atleast_1d(values).tolist())
    return " and ".join(NOT_KNOWN if isnan(value) else f"{value:.4g}" for value in different)


@dataclass(eq=False)
class _Maker:
    """Simulates the paths of a cell, and notes which are partial."""

    cell: CellOfBeams
    starts: tuple[str, ...]  # the one that counts, and the other one
    force: float  # per width, up to which all are pulled [N/m]
    plan: Plan
    store: Store
    coarse: dict[str, xr.Dataset] = field(default_factory=dict)  # histories that found the strains, by load
    notes: list[str] = field(default_factory=list)

    def history(self, load: str, keys: dict[str, Any]) -> xr.Dataset:
        """Return the history of a load that counts, of its keys."""
        way: dict[str, Any] = {"load.strain": 4.0, "load.stops": COARSE}
        if load == "shear":  # no number is of more
            way = {"load.strain": 2 * SHEARED, "load.stops": [SHEARED]}
        find = {"load.largest_force": self.force, "load.start": self.starts[-1], "solver.increments": 1}
        found = self.coarse[load] = self._run(f"{load}-found", keys | way | find)
        along = load if load in STRAINS else "course"
        strain = when(curve_table(found), STRAIN(along), PULL(along), self.force)
        most = SHEAR if load == "shear" else float(found["strain"].max())
        strain = most if isnan(strain) else BEYOND * strain
        made = self._evenly(load, keys, strain)
        if load == "shear" or ENDED in made.attrs:
            return made
        # Friction at rest may hold the fabric at another size, from which the force is reached farther on.
        curve = force_over_strain(curve_table(made), along)
        rising = branches(curve)[0]
        missing = self.force - rising.iloc[-1]
        slope = np.gradient(rising, rising.index)[-1]
        if missing > (1 - 1 / FARTHER) * self.force and slope > 0:
            made = self._evenly(f"{load} farther", keys, strain + missing / slope)
        return made

    def _evenly(self, name: str, keys: dict[str, Any], strain: float) -> xr.Dataset:
        """Return the history of a load to a strain and back, in even increments, from the start that counts."""
        even = keys | {"load.start": self.starts[0], "solver.increments": EVEN}
        even |= {"load.strain": strain, "load.largest_force": self.force if strain == SHEAR else None}
        if keys["load.deformation"] == "shear" and strain > SHEARED:
            even |= {"load.stops": [SHEARED]}  # no number between two increments
        if keys["load.deformation"] in STRAINS[:2]:
            even |= {"load.turns": [strain], "load.strain": BACK * strain, "solver.increments": 2 * EVEN}
        return self._run(name, even)

    def with_input(self, key: str, force: float) -> Changed:
        """Return the course strain at a force per width [N/m] with a changed input."""
        keys = {"load.deformation": "course", "load.ratio": 1.0, "load.strain": 4.0, "load.stops": COARSE}
        keys |= {"load.largest_force": force, "load.start": self.starts[-1], "solver.increments": 1}

        def strain(scene: Scene) -> float:
            history = self.store.get(self.plan.step("simulation", self.plan.labelled(scene.vary(keys))))
            return when(curve_table(history), STRAIN("course"), PULL("course"), force)

        return changed(self.cell, key, strain)

    def drawn_otherwise(self, wider: float) -> dict[str, xr.Dataset]:
        """Return histories from rest with friction, in both directions, of loops that are drawn wider by a factor.

        Nothing, with a note, where there are no such loops of the same length of yarn, or they come to no rest.
        """
        pattern = self.cell.pattern
        drawn = self.store.get(self.plan.step("geometry", self.plan.labelled(self.cell)))
        keys: dict[str, Any] = {
            "pattern.control_points": None,
            "pattern.loop_length": pattern.loop_length
            or yarn_in_a_stitch(drawn, pattern.loops * pattern.rows),
            "pattern.wale_spacing": wider * pattern.wale_spacing,
            "pattern.course_spacing": pattern.course_spacing / wider,
            "load.start": self.starts[0],
        }
        size = f"{1e3 * keys['pattern.wale_spacing']:.3g} x {1e3 * keys['pattern.course_spacing']:.3g} mm"
        way = {"load.ratio": 1.0, "load.strain": 4.0, "load.stops": COARSE, "solver.increments": 1}
        way["load.largest_force"] = self.force
        try:
            return {
                load: self._run(f"{load}-drawn-{wider:.2g}", keys | way | {"load.deformation": load})
                for load in STRAINS[:2]
            }
        except KnitstudyError as error:
            self.notes.append(f"Uncertainties are without loops drawn for {size}: {message_of(error)}.")
            return {}

    def pressed(self, start: str, pressure: float) -> xr.Dataset:
        """Return the history between plates from a start, up to a pressure [Pa]."""
        keys: dict[str, Any] = {"load.deformation": PRESS, "load.ratio": 1.0, "load.largest_force": None}
        keys |= {"load.strain": 0.9, "load.stops": CLOSE, "solver.increments": 1}
        keys |= {"load.largest_pressure": FARTHER * pressure}
        return self._run(f"{PRESS}-{start}", keys | {"load.start": start})

    def tied(self) -> xr.Dataset | None:
        """Return the history of the tied cell at its drawn loops; None, with a note, where it has none."""
        keys = {"fidelity": "spline_yarns", "interaction": "tie", "load.strain": 1e-3, "solver.increments": 1}
        try:  # other models know no shape at rest
            return self._run("tied", keys, self.cell.vary({"load.start": "drawn"}))
        except KnitstudyError as error:
            self.notes.append(f"Bending of tied yarns is not known: {message_of(error)}.")
            return None

    def bending(self, start: str) -> xr.Dataset:
        """Return bending from a start: there and back from the one that counts, from the other one there."""
        name = f"{self.cell.name}-sheet-bending-{start}".replace("_", "-")
        keys = THERE_AND_BACK if start == self.starts[0] else {}
        scene = self.cell.vary({"name": name, "load.start": start, **keys})
        made: xr.Dataset = self.store.get(self.plan.step("bending", self.plan.labelled(scene)))
        if made.attrs["ended"]:
            self.notes.append(f"Bending ended early: {made.attrs['ended']}")
        if "unstable" in made.attrs:
            self.notes.append(f"Bending is unstable ({made.attrs['unstable']}): {UNSTABLE}.")
        return made

    def rest(self, start: str) -> dict[str, xr.Dataset]:
        """Return the shape at rest of a start, and its geometry, by digest: all paths share them."""
        step = self.plan.step("simulation", self.plan.labelled(self.cell.vary({"load.start": start})))
        return {need.digest: self.store.get(need) for need in step.needs.values()}

    def side_by_side(self, each: Sequence[Callable[[_Maker], Any]]) -> list[Any]:
        """Return what methods return, from what is kept or by processes; the first needs only the start that counts."""
        global _forked
        ended: dict[Callable[[_Maker], Any], _Ended] = {}
        _forked = replace(self, store=replace(self.store, makes=False))
        for method in each:
            with suppress(NotKept):
                ended[method] = _alone(method, {})
        missing = [method for method in each if method not in ended]
        self.store.get(self.plan.step("geometry", self.plan.labelled(self.cell)))
        _forked = self
        known = dict[str, xr.Dataset]()
        with processes(len(missing), remedy="take a larger mesh.beam_size") as pool:
            starts = self.starts if missing else ()
            rests = [pool.submit(_alone, partial(_Maker.rest, start=start), {}) for start in starts]
            begun: list[Future[_Ended]] = []
            for number, rest in enumerate(rests, 1):
                known = known | rest.result()[0]
                now = missing[number - 1 : number if number < len(rests) else None]
                begun += [pool.submit(_alone, method, known) for method in now]
            ended |= zip(missing, [future.result() for future in begun], strict=True)
        for method in each:
            self.coarse |= ended[method][1]
            self.notes += ended[method][2]
        return [ended[method][0] for method in each]

    def _run(self, name: str, keys: dict[str, Any], cell: Scene | None = None) -> xr.Dataset:
        """Return the history of the cell with some keys changed; a partial one is used up to its end, with a note."""
        name = sub("[^a-z0-9_-]+", "-", f"{self.cell.name}-sheet-{name}")
        scene = (cell or self.cell).vary({"name": name, **keys})
        simulation = self.plan.step("simulation", self.plan.labelled(scene))
        try:
            history: xr.Dataset = self.store.get(simulation)
        except ConvergenceError as error:
            if error.history is None:
                raise
            history = error.history
            self.notes.append(f"The path {name} {history.attrs.get(ENDED, f'ended early: {error}')}")
        if "unstable" in history.attrs:
            self.notes.append(f"The path {name} is unstable {history.attrs['unstable']}.")
        return history


_forked: _Maker  # what processes take from the one that they are copies of
_Ended = tuple[Any, dict[str, xr.Dataset], list[str]]


def _alone(method: Callable[[_Maker], Any], known: dict[str, xr.Dataset]) -> _Ended:
    """Return what a method returns in a process that knows results, with what it leaves in its `_Maker`."""
    maker = replace(_forked, coarse={}, notes=[])
    maker.store.made |= known
    return method(maker), maker.coarse, maker.notes
