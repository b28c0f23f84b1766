"""The scene: one validated, frozen description of one simulation.

It is the only thing that a stage is parametrised by. A scene that exists is valid: constructing one with a
value that is not allowed raises ConfigurationError. All quantities are SI; the type of a field that has a
dimension names its unit.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from dataclasses import dataclass, fields
from typing import Annotated, Any, get_type_hints

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.study.scene_checks import FULL, check_keys_together
from knitstudy.study.schema import scene_schema, unknown_choice, validate

Metres = Annotated[float, "m"]
Pascals = Annotated[float, "Pa"]
KilogramsPerCubicMetre = Annotated[float, "kg/m3"]


@dataclass(frozen=True, eq=False)
class Pattern:
    """Size and shape of the knit: ``rows`` rows of interlocks between ``rows`` + 1 yarns of ``loops`` loops.

    ``control_points`` (P, 3) in m describe one loop from sinker centre to sinker centre before optimisation;
    ``clearance`` is the gap c0 wanted at every crossing, in yarn radii.
    """

    loops: int
    rows: int
    course_spacing: Metres
    wale_spacing: Metres
    control_points: Annotated[np.ndarray, "m"]
    clearance: float

    def __post_init__(self):
        points = np.array(self.control_points, dtype=float)
        points.setflags(write=False)
        object.__setattr__(self, "control_points", points)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pattern) and _plain(self) == _plain(other)

    def __hash__(self) -> int:
        return hash(_digest(_plain(self)))


@dataclass(frozen=True)
class Yarn:
    """Circular yarn of one isotropic material."""

    diameter: Metres
    youngs_modulus: Pascals
    poisson_ratio: float
    density: KilogramsPerCubicMetre
    material: str

    @property
    def radius(self) -> float:
        """Yarn radius in m."""
        return self.diameter / 2


@dataclass(frozen=True)
class Pair:
    """Two straight yarns of ``length`` that cross at ``angle`` (degrees) in their middles.

    Held and driven are, by ``support``, the nodes of both "ends", or the surface of the half turned away from the
    other yarn, the "back".
    """

    angle: float
    length: Metres
    support: str


@dataclass(frozen=True)
class Geometry:
    """Optimisation of the loop: weights of Eqs. (1) and (3), what may move, and samples a Bezier curve.

    ``free`` lists for every control point the components that may move: "", "z", "yz", "xyz" and so on.
    """

    alpha: float
    beta: float
    gamma: float
    beta_0: float
    free: tuple[str, ...]
    samples: int

    def __post_init__(self):
        object.__setattr__(self, "free", tuple(self.free))


@dataclass(frozen=True)
class Load:
    """What drives a specimen: a strain of a knit, or a path of a pair's upper yarn.

    A knit is pulled in ``direction`` to an engineering ``strain``; ``lateral``: driven ends fixed or free in the
    other components; ``stops``: strains at which an increment has to end. The grips of a pair's upper yarn go from
    where they are to the displacements of ``path`` one after another, in straight legs that take equal shares of
    the load factor.
    """

    direction: str
    strain: float
    lateral: str
    stops: tuple[float, ...]
    path: Annotated[tuple[tuple[float, float, float], ...], "m"]

    def __post_init__(self):
        object.__setattr__(self, "stops", tuple(map(float, self.stops)))
        object.__setattr__(self, "path", tuple(tuple(map(float, leg)) for leg in self.path))


@dataclass(frozen=True)
class Mesh:
    """Element sizes (solids at crossings, their growth on legs, and beams) and the solid element."""

    size: Metres
    growth: float
    element: str
    beam_size: Metres


@dataclass(frozen=True)
class Tie:
    """Tied interaction: points nearer than ``tolerance`` facet sizes are tied."""

    tolerance: float


@dataclass(frozen=True)
class Contact:
    """Contact with friction (Table 1): stiffnesses over E / h, and how it is integrated and enforced.

    A ``penetration`` deeper than this share of h is removed by at most so many ``augmentations`` an increment.
    ``points`` are Gauss points along each side of a facet; ``tied_edges`` says which crossings stay tied (Fig. 3):
    of the "outer" interlock rows in course tension and columns in wale tension, or "none".
    """

    friction: float
    normal_stiffness: float
    tangential_stiffness: float
    penetration: float
    augmentations: int
    points: int
    tied_edges: str


@dataclass(frozen=True)
class Solver:
    """Newton's method: first number of increments, tolerances, coefficients and linear solver.

    ``hourglass`` is relative to the shear modulus, the viscosity ``stabilisation`` to Young's modulus.
    """

    increments: int
    residual_tolerance: float
    correction_tolerance: float
    hourglass: float
    stabilisation: float
    linear: str


@dataclass(frozen=True)
class Rom:
    """Reduced order model: the DNS scene that its joints come from (None in other scenes) and their kind.

    ``springs_from`` is another DNS scene whose springs are used; ``springs`` are averaged or of each crossing's own
    "zones", secants of the relative ``displacement`` of interfaces or centrelines along the ``axes`` of the contact
    or the global ones, or have the given ``stiffness`` along x, y and z; ``section`` is that of a segment of the planar
    model which two yarns share.
    """

    contacts_from: str | None
    joint: str
    springs_from: str | None
    springs: str
    stiffness: Annotated[tuple[float, ...], "N/m"]
    axes: str
    displacement: str
    section: str

    def __post_init__(self):
        object.__setattr__(self, "stiffness", tuple(map(float, self.stiffness)))


@dataclass(frozen=True)
class Beam:
    """Beams in contact: at a "point" of every crossing or along a "line", of "rigid" or "hertz" sections; kind of ties.

    ``stiffness`` is the penalty of rigid sections, over E R of a point and over E of a line.
    """

    contact: str
    section: str
    tie: str
    stiffness: float


@dataclass(frozen=True)
class Scene:
    """One simulation; ``to_dict`` and ``from_dict`` translate to and from plain nested mappings."""

    name: str
    knit: str
    specimen: str
    fidelity: str
    interaction: str
    pattern: Pattern
    pair: Pair
    yarn: Yarn
    geometry: Geometry
    load: Load
    mesh: Mesh
    tie: Tie
    contact: Contact
    solver: Solver
    rom: Rom
    beam: Beam
    outputs: tuple[str, ...]

    def __post_init__(self):
        object.__setattr__(self, "outputs", tuple(self.outputs))
        where = f"scene {self.name!r}"
        validate(self.to_dict(), scene_schema(), where)
        check_keys_together(self, where)

    @classmethod
    def from_dict(cls, document: dict, where: str = "scene") -> Scene:
        """Build a scene from a nested mapping of all its keys.

        Raises
        ------
        ConfigurationError
            When a key is unknown, missing or has a value that is not allowed; ``where`` begins the message.
        """
        validate(document, scene_schema(), where)
        return _build(cls, document)

    def to_dict(self) -> dict:
        """Return the scene as nested mappings of numbers, text and lists."""
        return _plain(self)

    def replace(self, key: str, value: Any) -> Scene:
        """Return a scene with one key changed, for example ``scene.replace("solver.increments", 4)``."""
        document = self.to_dict()
        set_dotted(document, key, value, f"scene {self.name!r}")
        return Scene.from_dict(document, f"scene {self.name!r}")

    def scaled(self, length: float = 1.0, stiffness: float = 1.0) -> Scene:
        """Return the same scene in other units: lengths times ``length``, moduli times ``stiffness``.

        The density is left alone: no result of a quasi-static scene depends on it.
        """
        return _scaled(self, {"m": length, "Pa": stiffness, "N/m": stiffness * length})

    @property
    def geometry_inputs(self) -> dict[str, Any]:
        """All that the geometry depends on, by dotted key: of a knit pattern, yarn diameter and optimisation."""
        document = self.to_dict()
        if self.specimen == "pair":
            keys = [("pair", "angle"), ("pair", "length"), ("pattern", "clearance")]
        else:
            keys = [(section, key) for section in ("pattern", "geometry") for key in document[section]]
        inputs = {
            f"{section}.{key}": document[section][key] for section, key in [*keys, ("yarn", "diameter")]
        }
        return {"specimen": self.specimen} | inputs

    @property
    def geometry_key(self) -> str:
        """Hash of all that the geometry depends on."""
        return _digest(self.geometry_inputs)

    @property
    def hash(self) -> str:
        """Hash of everything that determines the result: no labels, outputs or groups that it does not use."""
        left_out = {"name", "knit", "outputs"}
        left_out |= {"pair"} if self.specimen == "knit" else {"geometry"}
        left_out |= {"contact"} if self.interaction == "tie" else set()
        left_out |= {"beam"} if self.fidelity != "beam" else set()
        left_out |= {"rom"} if self.fidelity in FULL else set()
        document = self.to_dict()
        return _digest({key: document[key] for key in document if key not in left_out})


def set_dotted(document: dict, key: str, value: Any, where: str) -> None:
    """Set a nested key by its dotted name, in place; ConfigurationError when there is no such group."""
    *groups, last = key.split(".")
    schema = scene_schema()
    for group in groups:
        schema = schema.get("properties", {})
        if schema.get(group, {}).get("type") != "object":
            allowed = sorted(name for name, entry in schema.items() if entry.get("type") == "object")
            raise ConfigurationError(f"{where}: {unknown_choice('unknown key', key, group, allowed)}")
        schema = schema[group]
        document = document.setdefault(group, {})
    document[last] = value


def _build(cls: type, document: dict) -> Any:
    """Build a dataclass and the sections inside it from a valid document."""
    types = get_type_hints(cls)
    values = dict(document)
    for name, value in document.items():
        if dataclasses.is_dataclass(types[name]):
            values[name] = _build(types[name], value)
        elif types[name] is float:  # 905 and 905.0 are one value, with one hash
            values[name] = float(value)
    return cls(**values)


def _plain(value: Any) -> Any:
    """Return a dataclass, array or tuple as mappings, lists, numbers and text."""
    if dataclasses.is_dataclass(value):
        return {item.name: _plain(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


def _scaled(section: Any, factors: dict[str, float]) -> Any:
    """Return a section with every quantity times the factor of its unit, sections inside it included."""
    types = get_type_hints(type(section), include_extras=True)
    changes = {}
    for item in fields(section):
        value = getattr(section, item.name)
        unit = getattr(types[item.name], "__metadata__", (None,))[0]
        if dataclasses.is_dataclass(value):
            changes[item.name] = _scaled(value, factors)
        elif unit in factors:
            changes[item.name] = _times(value, factors[unit])
    return dataclasses.replace(section, **changes)


def _times(value: Any, factor: float) -> Any:
    """Return a number, array or nested tuple of numbers times a factor."""
    return tuple(_times(item, factor) for item in value) if isinstance(value, tuple) else value * factor


def _digest(document: Any) -> str:
    """Return a short hash of plain data; numbers enter with all their digits."""
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:16]
