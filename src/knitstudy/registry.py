"""How the package grows: things of one kind by their names, each in a file of its own that registers it.

Files of the package are found in the folder of their kind. Those from outside are plugins: entry points of the group
``knitstudy.plugins`` or modules, which the configuration or the command names; importing one registers its entries.

An optional package is a subpackage that no other one imports: knitstudy works without its folder. The
`OptionalPackage` in its ``__init__`` lists what it adds.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules, resolve_name
from traceback import walk_tb
from typing import Any, Generic, TypeVar

from knitstudy.errors import ConfigurationError, MissingPackageError, message_of

MANY = 20  # Names beyond which a message does not list them all
NEAR = 3  # Names that a message offers at most in the place of a wrong one

PLUGINS = "knitstudy.plugins"  # Group of entry points

PICTURES, STUDY = "pictures", "study"

EXTRAS = {
    "jinja2": PICTURES,
    "matplotlib": PICTURES,
    "meshio": PICTURES,
    "pyvista": PICTURES,
    "vtkmodules": PICTURES,
    "snakemake": STUDY,
    "snakemake_interface_logger_plugins": STUDY,
}
"""Extras of knitstudy that install what simulations do not need, by the names of modules."""

_imported: dict[str, str] = {}  # The modules of plugins, by the names that asked for them


Entry = TypeVar("Entry")  # Entry of a registry: an object or a class with a `name`


class Registry(Generic[Entry]):
    """Entries by their names.

    Parameters
    ----------
    what : str
        Kind of the entries, or the key that names one; prefix of error messages.
    package : str, optional
        Dotted name of the package whose modules, or of the module that, register entries; imported when one is asked
        for. By default, or if it is empty, entries come from plugins alone.
    """

    def __init__(self, what: str, package: str = "") -> None:
        self.what, self._package = what, package
        self._entries: dict[str, Entry] = {}

    def register(self, entry: Entry) -> Entry:
        """Add an entry and return it: a decorator of classes as well.

        Raises ConfigurationError if another entry has the same name.
        """
        name: str = entry.name  # type: ignore[attr-defined]  # of an object, or of a class
        if name in self._entries:
            raise ConfigurationError(f"{self.what} {name!r} is registered twice")
        self._entries[name] = entry
        return entry

    def all(self) -> dict[str, Entry]:
        """Return all entries, in the order of their names, whatever module has been imported first."""
        if self._package:
            name = self._package
            self._package = ""
            modules = iter_modules(getattr(import_module(name), "__path__", []))
            for module in sorted(modules, key=lambda entry: entry.name):
                import_module(f"{name}.{module.name}")
        return dict(sorted(self._entries.items()))

    def names(self) -> tuple[str, ...]:
        """Return all names."""
        return tuple(self.all())

    def find(self, name: str, where: str = "") -> Entry:
        """Return an entry; a name that does not exist raises a ConfigurationError, with the prefix `where`.

        Where a module has the name of the entry, no other module is imported.
        """
        module = f"{self._package}.{name}"
        if name not in self._entries and self._package and str(name).isidentifier():
            with suppress(ModuleNotFoundError):  # there is no package
                if find_spec(module):
                    import_module(module)
        return find(self.what, self._entries if name in self._entries else self.all(), name, where)


@dataclass(frozen=True)
class OptionalPackage:
    """What an optional package adds, as dotted names; their modules are imported when they are needed.

    The package's ``__init__`` holds it under the name ``OPTIONAL_PACKAGE``.
    """

    # Subcommands by name: ``module:function``, and the line of the help
    commands: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    # Functions that write files for other programs, ``module:function`` by the name of their stage
    exports: Mapping[str, str] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)  # ``module:name`` of public names of the package
    figures: str = ""  # package whose modules register figures
    tables: str = ""  # package whose modules register tables
    report: str = ""  # module of the report


@cache
def optional_packages() -> tuple[OptionalPackage, ...]:
    """Return the optional packages that are installed, in alphabetical order."""
    package = __name__.partition(".")[0]
    folders = sorted(entry.name for entry in iter_modules(import_module(package).__path__) if entry.ispkg)
    modules = (import_module(f"{package}.{name}") for name in folders)
    return tuple(module.OPTIONAL_PACKAGE for module in modules if hasattr(module, "OPTIONAL_PACKAGE"))


def find(what: str, entries: Mapping[str, Entry], name: str, where: str = "") -> Entry:
    """Return the entry of a name; `where` is the prefix of the ConfigurationError if there is none."""
    if name not in entries:
        message = unknown_choice(f"unknown {what}", str(name), str(name), list(entries))
        raise ConfigurationError(f"{where}: {message}" if where else message)
    return entries[name]


def meanings(entries: Mapping[str, Entry]) -> str:
    """Return all names, with their meanings where entries have one."""
    by_name = {name: getattr(entry, "meaning", "") for name, entry in entries.items()}
    return listed([f"{name} ({meaning})" if meaning else name for name, meaning in sorted(by_name.items())])


def remedy_of_missing(module: str | None) -> str:
    """Return the command that installs a module which is not there; an empty text if no extra does."""
    package = (module or "").partition(".")[0]
    if package not in EXTRAS:
        return ""
    return f'{package} is not installed: python -m pip install "knitstudy[{EXTRAS[package]}]"'


@contextmanager
def naming_extra() -> Iterator[None]:
    """Raise a MissingPackageError with the remedy where a package of an extra is not installed."""
    try:
        yield
    except ModuleNotFoundError as error:
        if remedy := remedy_of_missing(error.name):
            raise MissingPackageError(remedy) from error
        raise


def resolve(name: str) -> Any:
    """Return an object by ``module:name``; raise a MissingPackageError where its module needs an extra."""
    with naming_extra():
        return resolve_name(name)


def lazy_import(name: str) -> Callable[..., Any]:
    """Return a function by ``module:function``; the module is imported at the first call.

    Stages and models name their functions: a job imports the mechanics that it needs alone.
    """

    def called(*arguments: Any, **named: Any) -> Any:
        return resolve(name)(*arguments, **named)

    return called


def load_plugins(names: Iterable[str]) -> None:
    """Import plugins, which register their entries: entry points by name, or modules, of the working folder as well.

    One that cannot be imported, or exits, raises a ConfigurationError.
    """
    here = str(Path.cwd())
    for name in names:
        if here not in sys.path:
            sys.path.append(here)
        module = next((entry.module for entry in entry_points(group=PLUGINS, name=name)), name)
        try:
            import_module(module)
            _imported[name] = module
        except (Exception, SystemExit) as error:  # whatever it is that a module of someone else's raises
            reason = message_of(error, ImportError)
            raise ConfigurationError(f"plugins: {name!r} cannot be imported: {reason}") from error


def plugin_files() -> list[Path]:
    """Return the Python files of all plugins that have been imported: of a package, all that it holds."""
    paths = set()
    for name in _imported.values():
        package = sys.modules.get(name.partition(".")[0])
        module = sys.modules.get(name)
        if package is not None and hasattr(package, "__path__"):
            paths |= set(Path(package.__path__[0]).rglob("*.py"))
        elif module is not None and module.__file__:
            paths.add(Path(module.__file__))
    return sorted(paths)


def is_loaded(plugin: str) -> bool:
    """Return whether a plugin has been imported."""
    return plugin in _imported


def plugin_behind(error: BaseException) -> str:
    """Return the plugin in whose code an error was raised, or in code that it called; an empty text if none."""
    running = {frame.f_globals.get("__name__", "").split(".")[0] for frame, _ in walk_tb(error.__traceback__)}
    return next((name for name, module in _imported.items() if module.split(".")[0] in running), "")


def listed(names: Sequence[str]) -> str:
    """Return names with commas and an "or" between."""
    return " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def unknown_choice(what: str, full_name: str, name: str, allowed: Sequence[str]) -> str:
    """Return a message for a name that does not exist: the nearest that do, and all unless they are many."""
    hint = near_names(name, allowed)
    if len(allowed) > MANY:
        such = "" if hint else f", such as {', '.join(allowed[:NEAR])}"
        return f"{what} {full_name!r}{hint}; {len(allowed)} names are allowed{such}"
    return f"{what} {full_name!r}{hint}; allowed are {', '.join(allowed) if allowed else 'none'}"


def near_names(name: str, allowed: Iterable[str]) -> str:
    """Return in parentheses the names that are like one; an empty text if none is."""
    near = [repr(other) for other in nearest(name, allowed)]
    return f" (did you mean {listed(near)}?)" if near else ""


def nearest(name: str, allowed: Iterable[str]) -> list[str]:
    """Return the names that are like one, the best first: the same behind their dot, holding it, or spelt so."""
    last = {other: other.rpartition(".")[2] for other in allowed}
    if same := [other for other in last if last[other] == name.rpartition(".")[2]]:
        return same[:NEAR]
    inside = sorted((other for other in last if len(name) >= NEAR and name in other), key=len)
    forms = [*last, *last.values()]
    spelt = difflib.get_close_matches(name, forms, n=NEAR, cutoff=0.75) or difflib.get_close_matches(
        name, forms, n=1
    )
    similar = [other for form in spelt for other in last if form in (other, last[other])]
    return list(dict.fromkeys([*inside, *similar]))[:NEAR]
