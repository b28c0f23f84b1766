"""What figures and tables are: each a function that registers itself with what it shows and which results it takes.

One file makes one figure or table: a module of `knitstudy.figures` or `knitstudy.tables`, or one from outside that the
configuration names under ``plugins``, whose function is decorated with ``FIGURES.add`` or ``TABLES.add``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, TypeVar

from knitstudy.errors import ConfigurationError
from knitstudy.registry import Registry

Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Display:
    """A figure or a table.

    Attributes
    ----------
    name : str
        Of its file.
    title : str
        With its number in the paper.
    make : callable
        What draws the figure or builds the table.
    needs : tuple of str
        What it takes, by keyword: results by the names of `measures.selection`, "scenes", and for tables files of
        reference ("paper", "claims", "reference" and "targets").
    of : mapping
        Which scenes it is about: values of keys of the scene.
    optional : tuple of str
        What it takes as well, where a study has it.
    order : float
        Place in the report; those without one follow by their names.
    texts : mapping of str to str
        What the report says of it, by the names that ``workflow/report/captions.yaml`` uses, which goes first.
    """

    name: str
    title: str
    make: Callable[..., Any]
    needs: tuple[str, ...] = ()
    of: Mapping[str, Any] = field(default_factory=dict)
    optional: tuple[str, ...] = ()
    order: float = inf
    texts: Mapping[str, str] = field(default_factory=dict)

    @property
    def takes(self) -> tuple[str, ...]:
        """What it may be made from."""
        return (*self.needs, *self.optional)


class Catalogue(Registry[Display]):
    """All figures, or all tables, in the order of the report."""

    def add(self, name: str, title: str, **said: Any) -> Callable[[Function], Function]:
        """Return a decorator of the function that makes a figure or table.

        Parameters
        ----------
        name, title : str
        **said
            The other attributes of `Display`.

        Raises
        ------
        ConfigurationError
            If the name is taken.
        """

        def added(make: Function) -> Function:
            self.register(Display(name, title, make, **said))
            return make

        return added

    def all(self) -> dict[str, Display]:
        """Return all by name, in the order of the report."""
        return dict(sorted(super().all().items(), key=lambda entry: (entry[1].order, entry[0])))

    def module(self, name: str) -> str:
        """Return the dotted name of the module of a figure's or table's function: the code behind it.

        Raises
        ------
        ConfigurationError
            If there is none of that name.
        """
        return self.find(name).make.__module__

    def make(self, name: str, **sources: Any) -> Any:
        """Make a figure or table from those of the sources that it takes.

        Raises
        ------
        ConfigurationError
            If there is none of that name, or something that it needs is missing.
        """
        display = self.find(name)
        missing = [need for need in display.needs if need not in sources]
        if missing:
            raise ConfigurationError(
                f"{self.what} {name!r} needs {', '.join(display.needs)}: {', '.join(missing)} is missing"
            )
        return display.make(**{name: sources[name] for name in display.takes if name in sources})
