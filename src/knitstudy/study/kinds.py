"""Kinds of scenes: specimens, interactions and fidelities, each a file that registers itself.

What kind a scene is says which sections it has: a tied scene has no friction, a knit has no angle. A kind of one's own
is registered by a module that the configuration names under ``plugins`` (see config/README.md).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any

from knitstudy.registry import Registry
from knitstudy.study.keys import Section

if TYPE_CHECKING:
    from knitstudy.study.scene import Scene

Sections = Mapping[str, type[Section]]


@dataclass(frozen=True)
class Specimen:
    """What is simulated.

    Attributes
    ----------
    name, meaning : str
    sections : mapping of str to subclass of Section
    geometry : tuple of str
        Sections and dotted keys that its geometry depends on.
    stage : str
        Stage that simulates it whatever the model; empty where that is the model's.
    outputs : tuple of str or None
        What a scene may ask to be written besides; None where that is the model's.
    requires : mapping of str to value
        Dotted keys that have one value alone there, of scenes that have them.
    """

    name: str
    meaning: str
    sections: Sections
    geometry: tuple[str, ...]
    stage: str = ""
    outputs: tuple[str, ...] | None = None
    requires: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Interaction:
    """How yarns act on each other.

    Attributes
    ----------
    name, meaning : str
    friction : callable or None
        Coefficient of friction of a scene, inf where nothing slips; None where yarns are tied instead.
    keys : subclass of Section or None
        What the section ``contact`` has beside the keys of the fidelity.
    solids : str
        Module of the contact of solid yarns, with a function as `knitstudy.models.yarn_contact` has; only scenes that
        ask for it depend on its code.
    """

    name: str
    meaning: str
    friction: Callable[[Scene], float] | None
    keys: type[Section] | None = None
    solids: str = "knitstudy.models.yarn_contact"

    @property
    def touches(self) -> bool:
        """Whether yarns are in contact, but for those that stay tied."""
        return self.friction is not None

    def contact(self, base: type[Section]) -> type[Section]:
        """Return the section ``contact`` of a fidelity that asks for the keys of `base`."""
        return base if self.keys is None else _joined(self.keys, base)


@cache
def _joined(keys: type[Section], base: type[Section]) -> type[Section]:
    return type(base.__name__, (keys, base), {"__doc__": base.__doc__})


@dataclass(frozen=True)
class Fidelity:
    """A model of a specimen.

    Attributes
    ----------
    name, meaning : str
    specimens : tuple of str
        What it can model.
    sections : callable
        Sections that a scene with some `Interaction` has, beside those of its specimen and of its yarn.
    stage : str
        Stage that simulates it.
    solids : str
        Module of solid yarns, with a function ``discretise``; empty for beams.
    stress : str
        Module of the stress in them, with a function ``cell_stress`` as `knitstudy.models.stress` says.
    sources : tuple of str
        Dotted keys that name direct simulations which it takes something from.
    outputs : tuple of str
        What a scene may ask to be written besides.
    tied : bool
        Whether it can model yarns that are all tied.
    """

    name: str
    meaning: str
    specimens: tuple[str, ...]
    sections: Callable[[Interaction], Sections]
    stage: str
    solids: str = ""
    stress: str = ""
    sources: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    tied: bool = True


SPECIMENS: Registry[Specimen] = Registry("specimen", "knitstudy.study.specimens")
INTERACTIONS: Registry[Interaction] = Registry("interaction", "knitstudy.study.interactions")
FIDELITIES: Registry[Fidelity] = Registry("fidelity", "knitstudy.study.fidelities")
