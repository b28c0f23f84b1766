"""What digests need of the syntax trees of modules, kept beside their bytecode.

Parsing all modules takes one to two seconds, and every job of a study asks for a hundred of them. As with bytecode, a
file is read again when its time or its size has changed; where nothing can be written nothing is kept.
"""

from __future__ import annotations

import atexit
import json
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Tree:
    """Digest of a module's syntax tree without docstrings, and the modules of this package that it may import."""

    digest: str
    imports: tuple[str, ...]


@dataclass
class KeptTrees:
    """Trees of files, by their time and size.

    Parameters
    ----------
    folder : Path
        Where they are kept, in a file for every version of Python.
    read : callable
        Makes the tree of a file; those that another version of it has made are of no use.
    """

    folder: Path
    read: Callable[[Path], Tree]
    _known: dict[str, list] | None = field(default=None, init=False)
    _waits: bool = field(default=False, init=False)

    def of(self, path: Path) -> Tree:
        """Return the tree of a file, made anew if it is not known or the file is another one."""
        if self._known is None:
            self._known = self._load()
        stamp = _stamp(path)
        name = os.path.relpath(path, self.folder)  # a copy of all knows its own
        kept = self._known.get(name)
        if kept is not None and kept[:2] == stamp:
            return Tree(kept[2], tuple(kept[3]))
        tree = self.read(path)
        self._known[name] = [*stamp, tree.digest, list(tree.imports)]
        if not self._waits:
            self._waits = True
            atexit.register(self.keep)
        return tree

    def keep(self) -> None:
        """Write what is known, for the processes after this one."""
        if sys.dont_write_bytecode:
            return
        temporary = self._file.with_suffix(f".{os.getpid()}")
        with suppress(OSError):
            self.folder.mkdir(exist_ok=True)
            temporary.write_text(json.dumps({"made by": self._maker(), "trees": self._known}))
            os.replace(temporary, self._file)

    @property
    def _file(self) -> Path:
        return self.folder / f"trees.{sys.implementation.cache_tag}.json"

    def _maker(self) -> list[int]:
        return _stamp(Path(self.read.__code__.co_filename))

    def _load(self) -> dict[str, list]:
        """Return what is kept; nothing where it is missing, damaged or of another version of this code."""
        try:
            kept = json.loads(self._file.read_text())
            known = kept["trees"] if kept["made by"] == self._maker() else {}
            return {path: entry for path, entry in known.items() if len(entry) == 4}
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return {}


def _stamp(path: Path) -> list[int]:
    """Return time [ns] and size [bytes] of a file."""
    found = path.stat()
    return [found.st_mtime_ns, found.st_size]
