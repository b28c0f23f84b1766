"""Kinds of scenes: specimens, interactions and fidelities, each a file that registers itself.

What kind a scene is says which sections it has: a tied scene has no friction, a knit has no angle. A kind of one's own
is registered by a module that the configuration names under ``plugins`` (see config/README.md).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from knitstudy.errors import ConfigurationError
from knitstudy.study.choices import unknown_choice
from knitstudy.study.keys import Section, listed

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
    """

    name: str
    meaning: str
    sections: Sections
    geometry: tuple[str, ...]


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
    """

    name: str
    meaning: str
    friction: Callable[[Scene], float] | None
    keys: type[Section] | None = None

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
    sources: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    tied: bool = True


Kind = TypeVar("Kind", Specimen, Interaction, Fidelity)


class Registry(Generic[Kind]):
    """Kinds by their names; those of the package are found in their folder."""

    def __init__(self, what: str, package: str) -> None:
        self.what, self._package = what, package
        self._kinds: dict[str, Kind] = {}
        self._loaded = False

    def register(self, kind: Kind) -> Kind:
        """Add a kind; ConfigurationError where its name is taken."""
        if kind.name in self._kinds:
            raise ConfigurationError(f"{self.what} {kind.name!r} is registered twice")
        self._kinds[kind.name] = kind
        return kind

    def names(self) -> tuple[str, ...]:
        """Return all names."""
        return tuple(self._all())

    def find(self, name: Any, where: str) -> Kind:
        """Return a kind by its name; ConfigurationError, which `where` begins, where there is none."""
        kinds = self._all()
        if name not in kinds:
            message = unknown_choice(f"{self.what} is", str(name), str(name), list(kinds))
            raise ConfigurationError(f"{where}: {message}")
        return kinds[name]

    def allowed(self) -> str:
        """Return all names with their meanings."""
        return listed([f"{kind.name} ({kind.meaning})" for kind in self._all().values()])

    def _all(self) -> dict[str, Kind]:
        if not self._loaded:
            self._loaded = True
            package = import_module(self._package)
            for module in sorted(iter_modules(package.__path__), key=lambda found: found.name):
                import_module(f"{self._package}.{module.name}")
        return self._kinds


SPECIMENS: Registry[Specimen] = Registry("specimen", "knitstudy.study.specimens")
INTERACTIONS: Registry[Interaction] = Registry("interaction", "knitstudy.study.interactions")
FIDELITIES: Registry[Fidelity] = Registry("fidelity", "knitstudy.study.fidelities")
