"""The code behind a result as one short value: a digest of all files in the rooms that its stage declares.

A changed comment counts as any other change. Files of loaded plugins always count; a plugin of several modules is a
package, whose files are all counted.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

from knitstudy.registry import plugin_files

PACKAGE = Path(__file__).resolve().parents[1]

MESH = ("knit/geometry", "knit/mesh")
MODEL = (
    *MESH,
    "mechanics",
    "knit/contacts",
    "knit/loading",
    "knit/models",
    "knit/simulate.py",
    "knit/stress.py",
    "knit/yarns",
)
"""Rooms of this package whose code makes the numbers of meshes and of simulations."""

KEYS = "models/*/__init__.py"
"""Files of keys, whose values a digest of a scene has already: their code does not count."""


def code_digest(*rooms: str) -> str:
    """Return a digest of the bytes of all files in rooms: folders or files of this package.

    Examples
    --------
    >>> len(code_digest("knit/geometry"))
    16
    """
    return _digest(rooms, tuple(plugin_files()))


def physics_digest() -> str:
    """Return the digest of all that makes the numbers of meshes and simulations, without plugins."""
    return _digest(MODEL, ())


@cache
def _digest(rooms: tuple[str, ...], plugins: tuple[Path, ...]) -> str:
    digest = hashlib.sha256()
    for room in sorted(set(rooms)):
        path = PACKAGE / room
        files = (
            [path]
            if path.is_file()
            else sorted(
                file for file in path.rglob("*") if file.suffix in (".py", ".tsv") and not file.match(KEYS)
            )
        )
        for file in files:
            digest.update(f"{file.relative_to(PACKAGE).as_posix()}\n".encode() + file.read_bytes())
    for file in plugins:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
