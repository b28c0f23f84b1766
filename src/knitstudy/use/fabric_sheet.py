"""The sheet of a fabric: its construction, its shape at rest, and how it stretches, shears and bends, on one page.

All numbers are those of one cell of beams in contact. A coarse path without friction at rest finds the strain at which
the fabric carries a force per width; the path that counts goes there from rest with friction, in even increments, and
back where it is a cycle. The difference of both is an uncertainty: friction holds a fabric anywhere between them.
"""

from __future__ import annotations

import logging
from base64 import b64encode
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from io import BytesIO
from itertools import cycle
from math import isnan, nan
from pathlib import Path
from re import sub
from typing import Any

import jinja2
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.errors import ConfigurationError, ConvergenceError, DataFileError, KnitstudyError
from knitstudy.files import STRAINS, code_version, write_table, write_text
from knitstudy.knit.loading.run import silent
from knitstudy.knit.loading.solve import UNSTABLE
from knitstudy.knit.models.beam import CellOfBeams
from knitstudy.knit.scene.alternatives import OF_BEAMS
from knitstudy.knit.scene.documents import CONFIG
from knitstudy.knit.scene.kinds import unit_of
from knitstudy.knit.scene.scene import Scene, flat, questions
from knitstudy.knit.scene.specimens import Looped
from knitstudy.knit.scene.stitches import is_plain, size_of_repeat
from knitstudy.mechanics.arrays import Floats
from knitstudy.run.plan import Plan
from knitstudy.run.simulations import processes
from knitstudy.run.store import OF_STUDY, BeginProgress, NotKept, Store
from knitstudy.use.decks.fabric import LAWS, write_membrane, write_shell, write_sliding
from knitstudy.use.fabric_law import membrane
from knitstudy.use.measured_curve import PULL, STRAIN, curve_table, force_over_strain, loss_of_cycle
from knitstudy.use.sheet_numbers import (
    NOT_KNOWN,
    PRESS,
    SHEAR,
    SHEARED,
    bending_rows,
    construction_rows,
    load_rows,
    thickness_rows,
    when,
)
from knitstudy.use.style import INK, PERCENT, SINGLE, YARNS, figure, resolution, styled

log = logging.getLogger(__name__)

FORCE = 100.0  # N/m
PRESSURES = (49.0, 1000.0, 4900.0)  # Pa, of KES-FB3, ISO 5084, and the largest one of KES
BOTH = "both ways"  # name of loads with both strains prescribed, before their ratio
FARTHER, BEYOND = 1.1, 1.03  # times the force, and times the strain there: so both starts reach the force
COARSE = [[0.02, 0.005], [0.1, 0.02], [3.97, 0.06]]  # ends of increments of the path that finds the strain
CLOSE = [[0.01, 0.0025], [0.1, 0.01], [0.88, 0.04]]  # ends of increments between plates
EVEN = 15  # increments of a leg of the path that counts
BACK = 0.02  # of the largest strain, where a cycle ends
MEMBRANE, SHELL = "membrane.{}.inp".format, "shell.abaqus.inp"
DECKS = (*map(MEMBRANE, LAWS), SHELL)
STARTS = ("rest_with_friction", "rest")
VERIFIED, ERROR = 0.3, 0.11  # gates.point up to which forces have at most this error (docs/notes/beams.md)

# A load that turns: of bending as well
THERE_AND_BACK: dict[str, Any] = {"load.strain": 0.05, "load.turns": [0.1]}

CYLINDER = (
    "Bending is that of a cylinder: nothing pulls in the plane, the axis stays straight, nothing twists. Widths and "
    "curvatures are those of the flat cell at rest. A moment is positive where its front is to be the longer side."
)
VALUES = tuple(f".{name}" for name in ("youngs_modulus", *OF_BEAMS))  # of yarns, in a note
BANDS = "Uncertainties are at least the difference to a start without friction at rest. A cycle leaves more: see there."
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
        """Write page, tables and decks into a folder, and return their paths; a law that cannot be fitted is a note."""
        folder, notes, files = Path(folder), [*self.notes], ["numbers.csv", "curves.csv"]
        for name, table in zip(files, (self.numbers, self.curves), strict=True):
            write_table(table, folder / name)
        for name in DECKS:  # an earlier sheet's
            (folder / name).unlink(missing_ok=True)
        texts = self.numbers.set_index("quantity")["value"]
        bending = [texts[f"bending stiffness, {way}"] for way in STRAINS[:2]]
        course, wale = pd.to_numeric(bending, errors="coerce")
        try:
            law = membrane(self.histories)
            for dialect in LAWS:
                files.append(MEMBRANE(dialect))
                write_membrane(law, folder / files[-1], dialect, self.scene.name)
            if course > 0 and wale > 0:
                files.append(SHELL)
                write_sliding(law, (course, wale), folder / SHELL, self.scene.name)
        except DataFileError as error:
            notes.append(f"There is no deck of a membrane: {error}.")
        if SHELL not in files:
            what = "is not written" if self.tied is None else "is of tied yarns"
            needs = "yarns that slide need the law of a membrane, and bending stiffnesses above 0"
            notes.append(f"{SHELL} {what}: {needs}; these are {' and '.join(bending)} N m (course, wale).")
            if self.tied is not None:
                files.append(SHELL)
                write_shell(self.scene, folder / SHELL, self.tied)
        picture = BytesIO()
        self.draw().savefig(picture, format="png", dpi=resolution())
        template = Path(__file__).with_name("sheet.html").read_text(encoding="utf-8")
        page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(template)
        shown = {"picture": b64encode(picture.getvalue()).decode(), "files": files, "version": code_version()}
        shown |= {"diameters": _each(2e3 * np.asarray(self.scene.radius))}
        write_text(page.render(vars(self) | {"notes": notes} | shown), folder / "sheet.html")
        return [folder / name for name in ("sheet.html", *files)]

    @styled
    def draw(self) -> Figure:
        """Draw forces per width over strain: cycles in both directions with their loss, both at once, and shear."""
        drawing = figure(2 * SINGLE, 0.85 * SINGLE, layout="constrained")
        one, both, sheared = drawing.subplots(1, 3)
        dashes = cycle(("-", "--", ":", "-."))
        for load, curve in self.curves[self.curves["load"] != PRESS].groupby("load", sort=False):
            alone = load in STRAINS
            axes, dash = (sheared if load == "shear" else one, "-") if alone else (both, next(dashes))
            for way in (load,) if alone else STRAINS[:2]:
                forces = force_over_strain(curve, way)
                loss = loss_of_cycle(forces)
                label = f"{way}, loss {PERCENT * loss.share:.0f} %" if loss else way
                label += "" if alone else load.removeprefix(BOTH)
                colour = YARNS[2] if way == "wale" else INK
                axes.plot(PERCENT * forces.index, forces, dash, color=colour, label=label)
        for axes, title in ((one, "one way, free across"), (both, "both ways"), (sheared, "sheared")):
            axes.set(title=title, xlabel="strain (%)")
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.24))
        one.set_ylabel("force per width (N/m)")
        return drawing


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
    scene = plan.labelled(scene)  # sheets of changed and of nameless scenes keep their places
    cell = cell_of(scene)
    if not isnan(tex) and len(cell.yarns) > 1:
        raise ConfigurationError(
            f"scene {scene.name!r}: tex is {tex:g}, of one yarn; say yarn.tex and yarn_b.tex, or .of"
        )
    starts = STARTS if cell.load.start in STARTS else (cell.load.start,)
    for question in questions(cell):
        log.warning(question)
    store = Store(None if folder is None else Path(folder), (OF_STUDY,), progress or (lambda label: silent))
    maker = _Maker(cell, starts, FARTHER * force, plan, store)
    loads = {way: {"load.deformation": way, "load.ratio": 1.0} for way in STRAINS}
    loads |= {f"{BOTH} 1:{r:g}": {"load.deformation": "biaxial", "load.ratio": r} for r in ratios}
    # Bending takes longest, and begins first; what takes little time fills the gaps at the end.
    each: list[Callable[[_Maker], Any]] = [partial(_Maker.bending, start=start) for start in starts]
    each += [partial(_Maker.history, load=load, keys=keys) for load, keys in loads.items()]
    each += [partial(_Maker.pressed, start=start, pressure=max(pressures)) for start in starts]
    made = iter(maker.side_by_side([*each, _Maker.tied]))
    bent, histories = [next(made) for _ in starts], {load: next(made) for load in loads}
    pressed, tied = [next(made) for _ in starts], next(made)
    other = maker.coarse if len(starts) > 1 else {}
    verified = is_plain(cell.pattern.stitches) and cell.gates.point <= VERIFIED
    curves = {load: [curve_table(of[load]) for of in (histories, other) if of] for load in histories}
    curves[PRESS] = [curve_table(of) for of in pressed]
    for both in curves.values() if verified else ():
        forces = both[0].filter(regex="force|pressure|energy")
        both += [both[0].assign(**factor * forces) for factor in (1 - ERROR, 1 + ERROR)]
    told = cell.tex if isnan(tex) else tex
    maker.notes.insert(0, _of_yarns(cell, told))
    rows = [
        *construction_rows(cell, [of["course"] for of in (histories, other) if of], told),
        *thickness_rows(curves[PRESS], pressures),
        *load_rows(curves, force),
        *bending_rows(bent, ERROR if verified else 0.0, tied),
    ]
    return Sheet(
        scene=scene,
        numbers=pd.DataFrame(rows, columns=["quantity", "value", "uncertainty", "unit", "remark"]),
        curves=pd.concat([of[0].assign(load=load) for load, of in curves.items()]),
        notes=(BANDS if other else DRAWN, KNOWN if verified else UNKNOWN, CYLINDER, *maker.notes),
        histories=histories,
        tied=tied,
    )


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
    """Return the note that names the values of the yarns, those that other values replace left out."""
    replaced = [key for key, others in cell.idle_beside.items() if None not in map(cell.value, others)]
    said = [f"contact.friction {cell.friction:.4g}"]
    for key, value in flat(cell.to_dict()).items():
        if key.endswith(VALUES) and value is not None and key not in replaced:
            said.append(f"{key} {value:.4g} {unit_of(key)}")
    said.append(f"tex {_each(tex)}")
    return f"Uncertainties are not those of the yarn's values: {', '.join(said)}."


def _each(values: Floats | float) -> str:
    """Return a value, or the different values of rows, in words."""
    different = dict.fromkeys(np.atleast_1d(values).tolist())
    return " and ".join(NOT_KNOWN if isnan(value) else f"{value:.4g}" for value in different)


@dataclass(eq=False)
class _Maker:
    """Simulates the paths of a cell, and notes where they end early."""

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
        even = keys | {"load.start": self.starts[0], "solver.increments": EVEN}
        even |= {"load.strain": strain, "load.largest_force": self.force if strain == SHEAR else None}
        if load == "shear" and strain > SHEARED:
            even |= {"load.stops": [SHEARED]}  # no number between two increments
        if load in STRAINS[:2]:
            even |= {"load.turns": [strain], "load.strain": BACK * strain, "solver.increments": 2 * EVEN}
        return self._run(load, even)

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
            self.notes.append(f"Bending of tied yarns is not known: {error}.")
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
        _forked, known = self, dict[str, xr.Dataset]()
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
        """Return a history of the cell with some keys; one that ends early as far as it goes, with a note."""
        name = sub("[^a-z0-9_-]+", "-", f"{self.cell.name}-sheet-{name}")
        scene = (cell or self.cell).vary({"name": name, **keys})
        simulation = self.plan.step("simulation", self.plan.labelled(scene))
        try:
            history: xr.Dataset = self.store.get(simulation)
        except ConvergenceError as error:
            if error.history is None:
                raise
            history = error.history
            last = PERCENT * float(history["strain"][-1])
            self.notes.append(f"The path {name} ended early, at a strain of {last:.3g} %.")
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
