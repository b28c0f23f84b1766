"""Things of one kind by their names; each of them stands in a file that registers it."""

from __future__ import annotations

from typing import Generic, Protocol, TypeVar

from knitstudy.errors import ConfigurationError


class Named(Protocol):
    """What a registry holds: a name, and what it means in one line."""

    name: str
    meaning: str


Entry = TypeVar("Entry", bound=Named)


class Registry(Generic[Entry]):
    """Entries by name.

    Parameters
    ----------
    key : str
        Key of a scene that chooses one of them, for messages.
    """

    def __init__(self, key: str) -> None:
        self.key = key
        self._entries: dict[str, Entry] = {}

    def register(self, entry: Entry) -> Entry:
        """Add an entry, from this package or from outside.

        Raises
        ------
        ConfigurationError
            If its name is taken.
        """
        if entry.name in self._entries:
            raise ConfigurationError(f"{self.key} {entry.name!r} is registered twice")
        self._entries[entry.name] = entry
        return entry

    def names(self) -> tuple[str, ...]:
        """Return all names, in the order of their registration."""
        return tuple(self._entries)

    def meanings(self) -> dict[str, str]:
        """Return what every name means."""
        return {name: entry.meaning for name, entry in self._entries.items()}

    def find(self, name: str) -> Entry:
        """Return an entry.

        Raises
        ------
        ConfigurationError
            If there is none of that name.
        """
        if name not in self._entries:
            raise ConfigurationError(f"{self.key} is {name!r}; allowed: {', '.join(self._entries)}")
        return self._entries[name]
