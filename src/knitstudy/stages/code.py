"""Which modules of this package a result depends on, read from their import statements.

A workflow rule lists these files as inputs: editing one of them runs the rule again, editing any other does
not.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from knitstudy.errors import ConfigurationError

PACKAGE = Path(__file__).resolve().parents[1]

CARRIERS = frozenset({"knitstudy"}) | frozenset(
    f"knitstudy.{name}"
    for name in (
        "errors",
        "files.csv_table",
        "files.netcdf",
        "files.provenance",
        "files.replacing",
        "progress",
        "restart",
        "stages.imports",
        "stages.script",
        "study.configuration",
        "study.scene",
        "study.schema",
    )
)
"""Modules that carry inputs and results but change no number: editing them runs no simulation again."""


def modules_behind(*names: str) -> list[Path]:
    """Return the files of modules and of all modules of the package that they import, directly or not.

    Parameters
    ----------
    *names
        Dotted module names, for example ``knitstudy.mesh.build``.

    Returns
    -------
    list of Path
        Absolute paths in alphabetical order, without `CARRIERS`.

    Raises
    ------
    ConfigurationError
        When there is no such module.
    """
    found: dict[str, Path] = {}
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name in found or name in CARRIERS:
            continue
        path = _path_of(name)
        if path is None:
            raise ConfigurationError(f"the package has no module {name!r}")
        found[name] = path
        waiting.extend(_imported(path))
        waiting.extend(_packages_around(name))
    return sorted(set(found.values()))


def _imported(path: Path) -> Iterator[str]:
    """Yield the modules of this package that a file imports, on every level but under TYPE_CHECKING."""
    for node in _running_nodes(ast.parse(path.read_text(encoding="utf-8"), filename=str(path))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "knitstudy")
        elif isinstance(node, ast.ImportFrom):
            base = _absolute(node, path)
            if base.split(".")[0] == "knitstudy":
                yield base
                candidates = (f"{base}.{alias.name}" for alias in node.names)
                yield from (name for name in candidates if _path_of(name) is not None)


def _absolute(node: ast.ImportFrom, path: Path) -> str:
    """Return the dotted name of the module that a statement imports from, relative or not."""
    if node.level == 0:
        return node.module or ""
    package = ("knitstudy", *path.relative_to(PACKAGE).parent.parts)
    around = package[: len(package) - node.level + 1]
    return ".".join((*around, *filter(None, [node.module])))


def _running_nodes(tree: ast.AST) -> Iterator[ast.AST]:
    for child in ast.iter_child_nodes(tree):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            continue
        yield child
        yield from _running_nodes(child)


def _packages_around(name: str) -> list[str]:
    """Return the packages whose __init__ runs before a module does, but for the outermost."""
    parts = name.split(".")
    return [package for package in (".".join(parts[:n]) for n in range(2, len(parts))) if _path_of(package)]


def _path_of(name: str) -> Path | None:
    if name == "knitstudy":
        return PACKAGE / "__init__.py"
    base = PACKAGE.joinpath(*name.split(".")[1:])
    return next((path for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file()), None)
