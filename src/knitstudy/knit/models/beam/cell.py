"""A cell of an endless fabric of beams: forces per width at large strains, from the drawn shape or from rest.

The rows of the fabric are chains of beams that go on as their own images; the last yarn, the image of the first, is
left out. Yarns touch each other and their images anywhere (`mechanics.line_contact`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from knitstudy.errors import CoarseIncrement, ConfigurationError, ConvergenceError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.loading.gates import require_fine_beams, require_sound
from knitstudy.knit.loading.history import Recorder, cell_path
from knitstudy.knit.loading.overlap import Repeats
from knitstudy.knit.loading.solve import Problem, Reported, settings_of
from knitstudy.knit.models.beam import CellOfBeams
from knitstudy.knit.models.beam.contact import STRIDE, YarnContact, contact_of, require_verified_contact
from knitstudy.knit.models.beam.rows import Rows, cell_rows
from knitstudy.knit.yarns.network import section_of
from knitstudy.mechanics.beams.beam import BeamState, LineHistory, SectionLaw
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.cells.beams import EndlessBeams, EndlessState
from knitstudy.mechanics.cells.lattice import Lattice
from knitstudy.mechanics.cells.plates import PressedBeams
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.increment import Increment, PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace

HELD: Ints = np.arange(3)  # the displacements of the first node: nothing else holds the whole in its place
BETWEEN_PLATES = HELD[:2]  # that along z is free between plates

# Variables of a shape at rest that do not follow from it: fields of `LineHistory`
KEPT = {"touching": "key", "touching_friction": "traction", "touching_stored": "stored"}

# Attributes of a shape at rest that its histories have as well; see `rest`
STABILITY = (
    "lowest_stiffness",
    "saddles",
    "saddle_stiffness",
    "change_from_saddle",
    "lowest_wave_stiffness",
    "lowest_wave",
)

STRAIGHT = 1e-6  # of curvatures summed over nodes, times the length: of rounding


def hidden_wave(known: Mapping[str, Any]) -> str:
    """Return in words that a cell hides an instability of its shape at rest, by attributes of that shape; "" if not.

    Examples
    --------
    >>> hidden_wave({"lowest_wave_stiffness": 0.2, "lowest_wave": (1, 4)})
    ''
    """
    if known.get("lowest_wave_stiffness", 0.0) >= 0:
        return ""
    loops, rows = known["lowest_wave"]
    return (
        f"the shape at rest is unstable in waves of {loops} loops and {rows} rows, which its cell is too short for: "
        f"with pattern.loops {loops} and pattern.rows {rows} the fabric finds another shape"
    )


@dataclass(frozen=True, eq=False)
class OfYarns:
    """Stiffness of beams of several yarns."""

    sections: Sequence[SectionLaw]
    kind: Ints  # (E,), which of them a beam has

    def stiffness(self, chord: Floats) -> Floats:
        """Return the law C (E, 6, 6) of elements with the reference chords (E, 3) [m], see `SectionLaw`."""
        C = np.empty((len(chord), 6, 6))
        for number, section in enumerate(self.sections):
            C[self.kind == number] = section.stiffness(chord[self.kind == number])
        return C


@dataclass(frozen=True, eq=False)
class BeamCell:
    """A cell put together, which reports strains and forces per width."""

    rows: Rows
    model: EndlessBeams
    plates: PressedBeams | None = None  # around the model

    def record(self, increment: Increment) -> Reported:
        """Return columns of the history."""
        state = self._state(increment)
        lattice = self.model.lattice
        contact = self.model.contact
        points = self.model.at_points(state)
        vectors = self.model.vectors(state)
        near = contact.pairs(points.position, vectors, near=True)
        nearest = float((near.distance - contact.repulsion.between(near).diameter).min(initial=np.inf))
        force = increment.response.force[self.model.lattice_unknowns]
        pressed = {}
        if self.plates is not None:
            area = abs(float(np.cross(*vectors)[2]))
            pressed = {
                "thickness": self.plates.thickness - increment.state.closed,
                "pressure": increment.response.force[-1] / area,
            }
        return pressed | {
            "centreline_displacement": state.beams.position - self.rows.stations.position,
            "cell_strain": state.lattice / lattice.lengths,
            "force_per_width": force * lattice.lengths / lattice.area,
            "smallest_gap": nearest if np.isfinite(nearest) else np.nan,
        }, {}

    def _state(self, increment: Increment) -> EndlessState:
        """Return the state of the cell without plates."""
        return (self.plates or self.model).cell_state(increment.state)

    def require_verified_contact(self, limit: float, increment: Increment, recorder: Recorder) -> None:
        """Refuse a state beyond the verified law of contact; raises as `require_verified_law`."""
        model = self.model
        state = self._state(increment)
        internal = model.internal_energy(increment.response)
        require_verified_contact(
            limit, increment, model.contact, model.at_points(state), model.vectors(state), internal
        )


def build(scene: CellOfBeams, fabric: Fabric, rest: xr.Dataset | None = None) -> Problem:
    """Return the cell of a scene as a problem, from a shape at rest if one is given.

    Raises ConfigurationError if the scene starts from a shape that is not given; MeshError if beams are too long for
    the bends of the yarns.
    """
    if (rest is None) != (scene.load.start == "drawn"):
        given = "none" if rest is None else "one"
        raise ConfigurationError(
            f"load.start of scene {scene.name} is {scene.load.start}, but {given} is given of shapes at rest"
        )
    rows = cell_rows(scene, fabric)
    contact = contact_of(scene)
    require_fine_beams(scene.gates.polygon, scene.mesh.beam_size, rows.polygon)
    settings = settings_of(scene.solver, touches=True, stride=STRIDE * scene.yarn.diameter)
    vectors = fabric.periods if rest is None else rest["lattice_vectors"].to_numpy()
    model = endless_beams(rows, Lattice(vectors), contact, scene.mesh.section_law)
    if rest is None:  # drawn yarns may touch
        held = np.append(HELD, model.lattice_unknowns)
        what = f"the drawn cell of scene {scene.name}"
        model = model.starting_at(balanced(what, model, held, replace(settings, increments=1)).state)
    else:
        model = model.starting_at(state_at_rest(rest, model))
    pressed = PressedBeams(model) if scene.load.deformation == "press" else None
    lengths = model.lattice.lengths
    held = HELD
    whole = pressed or model
    if pressed is not None:
        lengths = np.append(lengths, pressed.thickness)
        held = BETWEEN_PLATES
    motion, prescribed = cell_path(scene.load, lengths, held, whole.size)
    cell = BeamCell(rows, model, pressed)
    return Problem(
        scene=scene,
        model=whole,
        prescribed=prescribed,
        settings=settings,
        motion=motion,
        driven=(whole.size + np.arange(-3, 0))[None],
        stations=rows.stations,
        observer=cell,
        repeats=Repeats(rows.period, vectors),
        checks=(
            partial(require_sound, gates=scene.gates, yarn=scene.yarn, internal=model.internal_energy),
            partial(cell.require_verified_contact, scene.gates.point),
        ),
        attributes={
            "dof": whole.size,
            "elements": len(rows.ends),
            "deformation": scene.load.deformation,
            "start": scene.load.start,
            **size_of_cell(vectors),
            **({} if rest is None else {name: rest.attrs[name] for name in STABILITY if name in rest.attrs}),
            **contact.attributes(model.contact.repulsion.onset),
        },
    )


def balanced(
    what: str,
    model: EndlessBeams | PressedBeams,
    held: Ints,
    settings: Settings,
    report: Callable[[float], None] = lambda load: None,  # called with every load factor
    begin: Increment | None = None,
    check: Callable[[Increment], None] = lambda increment: None,  # raises CoarseIncrement
) -> Increment:
    """Return the last increment of the path of a cell to equilibrium, with some unknowns held.

    Raises ConvergenceError if it does not converge, or if a check accepts none however short increments are.
    """
    path = PrescribedDisplacement(held, np.zeros(len(held)))
    increments = trace(model, path, settings, LU(), resume=begin)
    last = begin
    try:
        increment = next(increments, None)
        while increment is not None:
            try:
                check(increment)
            except CoarseIncrement as error:
                increment = increments.send(str(error))
                continue
            last = increment
            report(last.load)
            increment = next(increments, None)
    except ConvergenceError as error:
        raise ConvergenceError(f"{what} does not converge: {error}") from None
    assert last is not None, "a path has at least the increment in which it begins"
    return last


def size_of_cell(vectors: Floats) -> dict[str, float]:
    """Return the width and the height of a cell with lattice vectors (2, 3) as attributes of its history [m]."""
    return {"cell_width": float(np.linalg.norm(vectors[0])), "cell_height": float(np.linalg.norm(vectors[1]))}


def state_at_rest(rest: xr.Dataset, model: EndlessBeams) -> EndlessState:
    """Return the state of a model that a shape at rest describes."""
    beams = BeamState(rest["centreline"].to_numpy(), rest["rotation"].to_numpy())
    state = EndlessState(beams, np.zeros(3), LineHistory.none(), np.zeros(model.size))
    carried = {field: rest[name].to_numpy() for name, field in KEPT.items()}
    history = model.contact.restored_history(model.at_points(state), model.vectors(state), **carried)
    return replace(state, contact=history)


def endless_beams(
    rows: Rows,
    lattice: Lattice,
    contact: YarnContact,
    section_law: str,
    drawn_for: float | None = None,  # diameter at which a relaxation begins [m]
) -> EndlessBeams:
    """Return the beams of the rows and their contact."""
    yarn, stations = contact.yarn, rows.stations
    kind = contact.yarn_of(stations.yarn) if contact.yarn_of else np.zeros_like(stations.yarn)
    share = np.array([getattr(each, "set", 1.0) for each in contact.yarns])[kind, None]
    natural = (share - 1.0) * rows.curvature if np.any(share != 1) else 0.0
    sections = [
        section_of(each, section_law, rows.curvature[kind == k], pressed=contact.pressed)
        for k, each in enumerate(contact.yarns)
    ]
    section = OfYarns(sections, kind) if len(sections) > 1 else sections[0]
    inner = BeamModel(rows.nodes, rows.ends, section, yarn.radius, natural=natural)
    line = contact.along(stations.yarn, stations.arc_length, rows.period)
    thinner = 0.0 if drawn_for is None else yarn.diameter - drawn_for
    bends = np.bincount(stations.yarn, np.linalg.norm(rows.curvature, axis=1)) * rows.period
    straight = np.where(bends > STRAIGHT, 0.0, rows.period)[stations.yarn]
    ramps = drawn_for is not None
    return EndlessBeams(inner, rows.owner, rows.image, lattice, *line, ramps, thinner, straight)
