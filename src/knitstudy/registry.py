"""How the package grows: things of one kind by their names, each in a file of its own that registers it.

Files of the package are found in the folder of their kind. Those from outside are modules that the configuration names
under ``plugins``; importing one registers what is in it.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Generic, TypeVar

from knitstudy.errors import ConfigurationError

MANY = 20  # Names beyond which a message does not list them all once it has a near one


Entry = TypeVar("Entry")  # What a registry holds: an object or a class with a `name`


class Registry(Generic[Entry]):
    """Entries by their names.

    Parameters
    ----------
    what : str
        What an entry is, or the key that names one; begins messages.
    package : str, optional
        Dotted name of the package whose modules register entries; they are imported when one is asked for.
    """

    def __init__(self, what: str, package: str | None = None) -> None:
        self.what, self._package = what, package
        self._entries: dict[str, Entry] = {}
        self._modules: dict[str, str] = {}

    def register(self, entry: Entry) -> Entry:
        """Add an entry of the calling module and return it: a decorator of classes as well.

        Raises ConfigurationError if another entry has the same name.
        """
        if entry.name in self._entries:
            raise ConfigurationError(f"{self.what} {entry.name!r} is registered twice")
        self._entries[entry.name] = entry
        self._modules[entry.name] = sys._getframe(1).f_globals["__name__"]
        return entry

    def all(self) -> dict[str, Entry]:
        """Return all entries by name."""
        if self._package is not None:
            name, self._package = self._package, None
            for module in sorted(iter_modules(import_module(name).__path__), key=lambda found: found.name):
                import_module(f"{name}.{module.name}")
        return self._entries

    def names(self) -> tuple[str, ...]:
        """Return all names."""
        return tuple(self.all())

    def find(self, name: str, where: str = "") -> Entry:
        """Return an entry; a name that does not exist raises a ConfigurationError, whose message `where` begins."""
        return find(self.what, self.all(), name, where)

    def module(self, name: str) -> str:
        """Return the dotted name of the module that registers an entry."""
        self.find(name)
        return self._modules[name]


def find(what: str, entries: Mapping[str, Entry], name: str, where: str = "") -> Entry:
    """Return the entry of a name; `where` begins the message of the ConfigurationError if there is none."""
    if name not in entries:
        message = unknown_choice(f"unknown {what}", str(name), str(name), list(entries))
        raise ConfigurationError(f"{where}: {message}" if where else message)
    return entries[name]


def meanings(entries: Mapping[str, Entry]) -> str:
    """Return all names with what they mean, where entries say it."""
    said = {name: getattr(entry, "meaning", "") for name, entry in entries.items()}
    return listed([f"{name} ({meaning})" if meaning else name for name, meaning in sorted(said.items())])


def load_plugins(modules: Iterable[str]) -> None:
    """Import modules from outside of the package, or of the working folder, which register what is in them.

    A module that cannot be imported raises a ConfigurationError.
    """
    here = str(Path.cwd())
    for name in modules:
        if here not in sys.path:
            sys.path.append(here)
        try:
            import_module(name)
        except Exception as error:  # whatever it is that a module of someone else's raises
            said = " ".join(str(error).split())
            kind = "" if isinstance(error, ImportError) else f"{type(error).__name__}: "
            raise ConfigurationError(f"plugins: {name!r} cannot be imported: {kind}{said}") from error


def listed(names: Sequence[str]) -> str:
    """Return names with commas and an "or" between."""
    return " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def unknown_choice(what: str, full_name: str, name: str, allowed: Sequence[str]) -> str:
    """Return a message for a name that does not exist: the nearest one that does, and all unless they are many."""
    near = difflib.get_close_matches(name, allowed, n=1)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    if near and len(allowed) > MANY:
        return f"{what} {full_name!r}{hint}; {len(allowed)} names are allowed"
    return f"{what} {full_name!r}{hint}; allowed are {', '.join(allowed) if allowed else 'none'}"
