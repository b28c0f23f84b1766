"""The shape at rest of a cell of beams: no force acts on its edges, and no small motion takes it anywhere else.

An equilibrium may be a saddle: an upright domino is in equilibrium, and falls. The relaxation therefore computes the
lowest mode of every equilibrium (`core.stability`). If the mode is unstable, the cell is pushed along it to both sides
and flows to an equilibrium on either side; the one of less energy is tested next, until one is stable.

The shape of a fabric does not depend on how many repeats a cell has: the shape of one repeat is computed, and a cell of
several repeats consists of copies of it. The copies keep this shape if one repeat is stable against waves over several
repeats. Otherwise the larger cell leaves its saddle as well; a cell that is shorter than the wave cannot show it, and a
warning says so.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
import xarray as xr

from knitstudy.errors import ConvergenceError
from knitstudy.knit.geometry.columns import REST
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.loading.gates import require_apart
from knitstudy.knit.loading.overlap import largest_overlap
from knitstudy.knit.loading.run import IN_MEMORY, ReportProgress, Run
from knitstudy.knit.models.beam import CellOfBeams
from knitstudy.knit.models.beam.cell import (
    BETWEEN_PLATES,
    HELD,
    KEPT,
    balanced,
    endless_beams,
    hidden_wave,
    size_of_cell,
)
from knitstudy.knit.models.beam.contact import STRIDE, YarnContact, contact_of
from knitstudy.knit.models.beam.rows import Rows, divided, repeats_of
from knitstudy.mechanics.beams.beam import BeamState, LineHistory
from knitstudy.mechanics.cells.beams import EndlessBeams, EndlessState
from knitstudy.mechanics.cells.lattice import Lattice
from knitstudy.mechanics.cells.plates import PressedBeams
from knitstudy.mechanics.cells.tiling import Tiling
from knitstudy.mechanics.cells.waves import Wave, Waves
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.increment import Increment, Settings
from knitstudy.mechanics.core.stability import Mode, lowest_mode

log = logging.getLogger(__name__)

NEARER = (
    "Draw the loops nearer to their shape at rest: smaller values of pattern.course_spacing and pattern.wale_spacing "
    "usually help"
)
FAR = "Loops may be drawn too far from their shape at rest"
# Increments of the relaxation, if none fails. Friction depends on the path: sizes of acrylic rib are within 0.3 % of
# those in 80; 20 leave 2 % of the width and 6 % of the height, and with a friction of 0.3 10 and 15 %.
INCREMENTS = 40
WASTE = 4000  # iterations without progress in the relaxation: loops of lace snap into place one by one
PUSH = 0.06  # over the diameter, along a mode that gives way: more than rounding, less than a stride
MOST_SADDLES = 20  # in one relaxation
# Failed iterations from which on a viscous flow leads on: Newton's method alone would go back to a saddle
FLOWS = -1
# Unknowns of a cell with all that it touches, beyond which waves are not asked for: their tangent takes 0.6 GB and 9 s
MOST_UNKNOWNS = 100_000


def relax(scene: CellOfBeams, geometry: xr.Dataset, run: Run = IN_MEMORY, plates: float = 0.0) -> xr.Dataset:
    """Return the shape in which no force acts on the edges of the cell, and the friction that holds it there.

    A `run` reports its progress, and has no restart file. Two `plates` press the cell with a force [N], 0 for none.

    From the drawn shape, the natural curvature of the yarns grows from that of the drawn one to its own, and their
    diameter from that for which the loops are drawn. With friction the relaxation leads to one shape; without it a
    slack fabric has several. `load.start` says whether friction is removed at the end.
    Raises ConvergenceError if the relaxation does not converge, or leads from saddle to saddle; other errors as
    `build`.
    """
    fabric = fabric_of(geometry)
    repeats = repeats_of(scene)
    rows = divided(fabric, scene.mesh.beam_size * scene.yarn.radius, repeats)
    contact = contact_of(scene)
    law = scene.mesh.section_law
    of_scene = f"of scene {scene.name}"
    cell = RelaxingCell.of(rows, contact, law, drawn_for=2 * fabric.radius)
    relaxation = _Relaxation(scene, plates / float(repeats.prod()), run.progress)
    removes_friction = contact.friction > 0 and scene.load.start == "rest"
    last = relaxation.balance(cell, f"relaxation {of_scene}", share=0.5 if removes_friction else 1.0)
    if removes_friction:
        stopped = relaxation.whole(cell).cell_state(last.state)
        cell = RelaxingCell.of(rows, replace(contact, friction=0.0), law)
        cell = cell.starting_at(replace(stopped, contact=LineHistory.none()))
        last = relaxation.balance(cell, f"relaxation without friction {of_scene}", done=0.5, share=0.5)
    increments = last.index
    state = relaxation.stable(cell, last)
    stitches = np.array([scene.pattern.loops, scene.pattern.rows])
    wave = None if plates else cell.lowest_wave(state, stitches // repeats)
    if repeats.prod() > 1:
        cell, state = cell.tiled(state, repeats)
        if wave is not None and wave.unstable:
            state = relaxation.stable(cell, standing(cell.model, state))
            wave = cell.lowest_wave(state, stitches)
    stability = relaxation.stability(wave)
    if hides := hidden_wave(stability):
        log.warning("scene %r: %s", scene.name, hides)
    model = cell.model
    vectors = model.vectors(state)
    values = {
        "centreline": state.beams.position,
        "rotation": state.beams.rotation,
        "lattice_vectors": vectors,
    } | {variable: getattr(state.contact, name) for variable, name in KEPT.items()}
    return xr.Dataset(REST.variables(values)).assign_attrs(
        **size_of_cell(vectors),
        **stability,
        strain_from_drawn=(state.lattice / model.lattice.lengths).tolist(),
        increments=increments,
    )


@dataclass(frozen=True, eq=False)
class RelaxingCell:
    """A cell of rows, and its model."""

    rows: Rows
    contact: YarnContact
    section_law: str
    model: EndlessBeams

    @classmethod
    def of(
        cls, rows: Rows, contact: YarnContact, section_law: str, drawn_for: float | None = None
    ) -> RelaxingCell:
        """Return the cell of rows, with loops `drawn_for` a diameter [m] that grows during relaxation."""
        model = endless_beams(rows, Lattice(rows.vectors), contact, section_law, drawn_for)
        return cls(rows, contact, section_law, model)

    def starting_at(self, state: EndlessState) -> RelaxingCell:
        """Return the cell with another state in which its load begins."""
        return replace(self, model=self.model.starting_at(state))

    def tiled(self, state: EndlessState, counts: Ints) -> tuple[RelaxingCell, EndlessState]:
        """Return the cell of so many cells (2,) along courses and wales, and its state of copies of one."""
        tiling = Tiling.of(self.rows.stations.yarn, counts)
        larger = RelaxingCell.of(self.rows.tiled(tiling), self.contact, self.section_law)
        model = larger.model
        stretched = counts[:, None] * self.model.vectors(state) - model.lattice.vectors
        tiled = EndlessState(
            beams=BeamState(
                tiling.positions(state.beams.position, self.model.vectors(state)),
                state.beams.rotation[tiling.place],
            ),
            lattice=np.linalg.lstsq(model.moves.reshape(6, 3), stretched.ravel())[0].astype(float),
            contact=LineHistory.none(),
            moved=np.zeros(model.size),
        )
        if self.contact.friction:
            kept = state.contact
            rubbing = Tiling.of(self.model.points.yarn, counts).friction(kept.key, kept.traction, kept.stored)
            at_points, vectors = model.at_points(tiled), model.vectors(tiled)
            tiled = replace(tiled, contact=model.contact.restored_history(at_points, vectors, *rubbing))
        return larger.starting_at(tiled), tiled

    def lowest_wave(self, state: EndlessState, stitches: Ints) -> Wave | None:
        """Return the wave over several cells against which a state is stiff the least; None of very large cells.

        Its length is in loops and rows, of which the cell has so many `stitches` (2,).
        """
        counts = 2 * self._farthest(state) + 1
        if self.model.size * counts.prod() > MOST_UNKNOWNS:
            log.info("a cell of %d unknowns is too large to check it for waves over several", self.model.size)
            return None
        larger, tiled = self.tiled(state, counts)
        tiling = Tiling.of(self.rows.stations.yarn, counts)
        nodes = slice(6 * self.model.nodes)
        neutral = self.neutral(state)[nodes]
        wave = Waves(tangent(larger.model, tiled), self.model.scale[nodes], tiling, neutral).lowest()
        return replace(wave, length=wave.length * stitches)

    def neutral(self, state: EndlessState) -> Floats:
        """Return motions (size, k) that cost nothing: yarns slide that do not rub and are straight without forces."""
        if self.contact.friction or any(getattr(yarn, "set", 1.0) for yarn in self.contact.yarns):
            return np.zeros((self.model.size, 0))
        return self.model.sliding(state)

    def _farthest(self, state: EndlessState) -> Ints:
        """Return how many cells away (2,), along courses and wales, yarns may act on each other."""
        model = self.model
        pairs = model.contact.pairs(model.at_points(state).position, model.vectors(state), near=True)
        # A point of contact follows stations beside it, and its yarn's direction there, over the next edge as well.
        return np.abs(pairs.image).max(axis=0, initial=1) + np.array([1, 0])


def tangent(model: EndlessBeams | PressedBeams, state: Any) -> sp.spmatrix:
    """Return the tangent (size, size) in a state, without the drag that holds loose yarns within an increment.

    Yarns stick: where friction is at its limit the tangent of sliding is not symmetric, and says nothing of stability.
    """
    return model.sticking().respond(state, stiffness=True).stiffness - sp.diags(model.drag)


@dataclass
class _Relaxation:
    """The relaxation of a cell, with the lowest modes and sizes of the equilibria on its path."""

    scene: CellOfBeams
    plates: float  # force with which they press one repeat, 0 without plates [N]
    progress: ReportProgress
    modes: list[Mode] = field(default_factory=list)  # of every equilibrium; only the last one is stable
    sizes: list[Floats] = field(default_factory=list)  # width and height over the drawn ones, thickness [m]

    @property
    def held(self) -> Ints:
        """Unknowns (k,) that hold the whole in its place."""
        return BETWEEN_PLATES if self.plates else HELD

    @property
    def settings(self) -> Settings:
        """Accuracy and limits."""
        return Settings(
            INCREMENTS,
            self.scene.solver.residual_tolerance,
            self.scene.solver.correction_tolerance,
            predictor=0,  # yarns that did not touch have come far in an increment for nothing
            stride=STRIDE * self.scene.yarn.diameter,
            waste=WASTE,
            remedy=NEARER,
        )

    def whole(self, cell: RelaxingCell) -> EndlessBeams | PressedBeams:
        """Return the model of a cell, between the plates if there are any."""
        return PressedBeams(cell.model, self.plates) if self.plates else cell.model

    def balance(self, cell: RelaxingCell, what: str, done: float = 0.0, share: float = 1.0) -> Increment:
        """Return the last increment of the path; progress goes from `done` by a `share` of the whole relaxation."""

        def report(load: float) -> None:
            self.progress(done + share * load, "")

        def check(increment: Increment) -> None:
            self._require_apart(cell, increment)

        return balanced(what, self.whole(cell), self.held, self.settings, report, check=check)

    def _require_apart(self, cell: RelaxingCell, increment: Increment) -> None:
        """Refuse an increment after which yarns overlap too much; raises as `gates.require_apart`."""
        model = cell.model
        state = self.whole(cell).cell_state(increment.state)
        grown = model.diameter(state) / model.contact.repulsion.diameter
        rows = cell.rows
        overlap = largest_overlap(
            rows.stations, state.beams.position, grown * self.scene.radius, rows.period, model.vectors(state)
        )
        require_apart(overlap, increment.index, self.scene.gates.overlap, FAR)

    def stable(self, cell: RelaxingCell, last: Increment) -> EndlessState:
        """Return the first stable state after an equilibrium.

        Raises ConvergenceError if there is none.
        """
        model = cell.model
        whole = self.whole(cell)
        free = np.ones(whole.size, dtype=bool)
        free[self.held] = False
        for _ in range(MOST_SADDLES):
            state = whole.cell_state(last.state)
            neutral = None if self.plates else around_first_node(cell.neutral(state))
            mode = lowest_mode(tangent(whole, last.state), whole.scale, free, neutral)
            self.modes.append(mode)
            thickness = np.ptp(state.beams.position[:, 2]) + self.scene.yarn.diameter
            self.sizes.append(np.append(1 + state.lattice[:2] / model.lattice.lengths[:2], thickness))
            if not mode.unstable:
                return state
            log.info("scene %r: a saddle, %.3g N/m in its lowest mode", self.scene.name, mode.stiffness)
            last = self._below(cell, last.state, mode)
        raise ConvergenceError(
            f"relaxation of scene {self.scene.name} does not converge: it leads from saddle to saddle, "
            f"{MOST_SADDLES} times. The fabric is too slack for one shape at rest. Use load.start "
            "rest_with_friction with a larger contact.friction, or a shorter pattern.loop_length"
        )

    def _below(self, cell: RelaxingCell, saddle: Any, mode: Mode) -> Increment:
        """Return the equilibrium of less energy of the two that flows from either side of a saddle reach.

        Raises ConvergenceError if neither side reaches an equilibrium.
        """
        model = self.whole(cell)
        settings = replace(self.settings, increments=1, vain=FLOWS)
        found: list[Increment] = []
        errors: list[ConvergenceError] = []
        for side in (1, -1):
            pushed = model.advance(saddle, side * PUSH * self.scene.yarn.diameter * mode.motion)
            try:
                reached = balanced(
                    f"relaxation of scene {self.scene.name} from a saddle",
                    model,
                    self.held,
                    settings,
                    begin=standing(model, pushed),
                )
                self._require_apart(cell, reached)
                found.append(reached)
            except ConvergenceError as error:
                errors.append(error)
        if not found:
            raise errors[0]
        return min(found, key=_elastic_energy)

    def stability(self, wave: Wave | None) -> dict[str, Any]:
        """Return attributes of the shape at rest: its stability, and the saddles on the path to it."""
        left = [mode.stiffness for mode in self.modes if mode.unstable]
        known: dict[str, Any] = {
            "lowest_stiffness": self.modes[-1].stiffness,
            "saddles": len(left),
        }
        if left:
            known |= {"saddle_stiffness": min(left)}
            known |= {"change_from_saddle": (self.sizes[-1] / self.sizes[0] - 1).tolist()}
        if wave is not None:
            known |= {"lowest_wave_stiffness": wave.stiffness, "lowest_wave": wave.length.tolist()}
        return known


def _elastic_energy(increment: Increment) -> float:
    """Return the energy of yarns and of their contact [J]."""
    return increment.response.energy["internal"] + increment.response.energy["penalty"]


def around_first_node(motions: Floats) -> Floats:
    """Return motions (size, k) with a translation of the whole that leaves the first node in its place."""
    around = motions.copy()
    for component in range(3):
        around[component:-3:6] -= motions[component]
    return around


def standing(model: EndlessBeams | PressedBeams, state: Any) -> Increment:
    """Return the increment from which a path begins in a state."""
    return Increment(0, 0.0, state, model.respond(state, stiffness=False), size=1.0)
