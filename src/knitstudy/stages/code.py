"""The code that a result depends on: modules found from import statements, compared without comments.

A result is up to date as long as the syntax trees of these modules, docstrings apart, are the same: a better comment
runs nothing again.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from knitstudy.errors import ConfigurationError
from knitstudy.stages.trees import KeptTrees, Tree

PACKAGE = Path(__file__).resolve().parents[1]

CARRIERS = (
    "errors",
    "registry",
    "files",
    "stages",
    "study",
    "loading.columns",
    "loading.restart",
)
"""Rooms and modules that carry inputs and results but change no number: editing them runs no simulation again."""


BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")
"""Where statements, handlers of exceptions and cases of a match hold others."""


@cache
def code_digest(*names: str) -> str:
    """Return a digest of modules and of all that they import; see `modules_behind`."""
    digest = hashlib.sha256()
    for path in modules_behind(*names):
        digest.update(f"{path.name} {tree_digest(path)}\n".encode())
    return digest.hexdigest()[:16]


def tree_digest(path: Path) -> str:
    """Return a digest of a file's syntax tree without docstrings: comments and layout do not count."""
    return _tree(path).digest


@cache
def _tree(path: Path) -> Tree:
    return TREES.of(path)


def _read(path: Path) -> Tree:
    """Return the digest of a file's syntax tree, and the modules of this package that it may import."""
    tree = ast.parse(path.read_text(encoding="utf-8"), filename=str(path))
    imports = tuple(_imported(tree, path))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            # Wherever a text stands alone it documents: of fields and constants as well.
            node.body = [each for each in node.body if not _is_text(each)] or [ast.Pass()]
    return Tree(hashlib.sha256(ast.dump(tree).encode()).hexdigest(), imports)


TREES = KeptTrees(PACKAGE / "__pycache__", _read)


def _is_text(node: ast.stmt) -> bool:
    value = node.value if isinstance(node, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def modules_behind(*names: str) -> list[Path]:
    """Return the files of modules and of all modules of the package that they import, directly or not.

    Parameters
    ----------
    *names
        Dotted module names, for example ``knitstudy.mesh.sweep``; a module from outside of the package stands for its
        own file and what it imports of the package.

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
        if name in found or _carries(name):
            continue
        path = _path_of(name)
        if path is None:
            raise ConfigurationError(f"the package has no module {name!r}")
        found[name] = path
        waiting.extend(each for each in _tree(path).imports if _is_module(each))
        waiting.extend(_packages_around(name))
    return sorted(set(found.values()))


def _carries(name: str) -> bool:
    return name == "knitstudy" or any(
        name == f"knitstudy.{carrier}" or name.startswith(f"knitstudy.{carrier}.") for carrier in CARRIERS
    )


@cache
def _is_module(name: str) -> bool:
    return _path_of(name) is not None


def _imported(tree: ast.Module, path: Path) -> Iterator[str]:
    """Yield what a file imports of this package, on every level but under TYPE_CHECKING: modules, and names in them."""
    for node in _running_statements(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "knitstudy")
        elif isinstance(node, ast.ImportFrom):
            base = _absolute(node, path)
            if base.split(".")[0] == "knitstudy":
                yield base
                yield from (f"{base}.{alias.name}" for alias in node.names)


def _absolute(node: ast.ImportFrom, path: Path) -> str:
    """Return the dotted name of the module that a statement imports from, relative or not."""
    if node.level == 0 or not path.is_relative_to(PACKAGE):
        return node.module or ""
    package = ("knitstudy", *path.relative_to(PACKAGE).parent.parts)
    around = package[: len(package) - node.level + 1]
    return ".".join((*around, *filter(None, [node.module])))


def _running_statements(tree: ast.Module) -> Iterator[ast.stmt]:
    """Yield all statements but those under TYPE_CHECKING; imports are statements, and no expression holds any."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.stmt):
            yield node
        for block in BLOCKS:
            waiting.extend(getattr(node, block, ()))


def _packages_around(name: str) -> list[str]:
    """Return the packages whose __init__ runs before a module does, but for the outermost."""
    parts = name.split(".")
    return [package for package in (".".join(parts[:n]) for n in range(2, len(parts))) if _path_of(package)]


def _path_of(name: str) -> Path | None:
    if name.split(".")[0] != "knitstudy":
        spec = find_spec(name)
        return Path(spec.origin) if spec and spec.origin else None
    if name == "knitstudy":
        return PACKAGE / "__init__.py"
    base = PACKAGE.joinpath(*name.split(".")[1:])
    return next((path for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file()), None)
