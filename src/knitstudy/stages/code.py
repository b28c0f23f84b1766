"""The digest of the code behind a result: of modules and of all modules that they import, directly or not.

Comments, docstrings and layout do not count. A module that a plugin imports counts if it belongs to the package of the
plugin, or is not installed. What was read of a file is kept in the user's cache until the file changes, as Python
keeps compiled modules.
"""

from __future__ import annotations

import ast
import gc
import hashlib
import json
import os
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec, resolve_name
from itertools import accumulate
from pathlib import Path
from types import CodeType
from typing import Any

from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.files import replacing

PACKAGE = Path(__file__).resolve().parents[1]

CARRIERS = ("errors", "registry", "files", "stages", "study", "loading.columns", "loading.restart")
"""Rooms and modules that carry inputs and results but change no number: editing them runs no simulation again."""

INSTALLED = {
    Path(sysconfig.get_path(name)).resolve() for name in ("purelib", "platlib", "stdlib", "platstdlib")
}
"""Folders of packages that no plugin's digest follows."""

BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")
"""Where statements, handlers of exceptions and cases of a match hold others."""


@dataclass(frozen=True)
class Module:
    """A module: its file, the dotted names that it may import, and the digest of its instructions."""

    path: Path
    imports: tuple[str, ...]
    digest: str


@cache
def code_digest(*names: str, without: tuple[str, ...] = ()) -> str:
    """Return a digest of modules and of all that they import; see `modules_behind`."""
    digest, known = hashlib.sha256(), len(_kept())
    for module in modules_behind(*names, without=without):
        digest.update(f"{module.path.name} {module.digest}\n".encode())
    if len(_kept()) > known:
        _keep()
    return digest.hexdigest()[:16]


def modules_behind(*names: str, without: tuple[str, ...] = ()) -> list[Module]:
    """Return modules and all that they import of this package, or of the place of a plugin, directly or not.

    They are named as in ``knitstudy.mesh.sweep`` and returned in alphabetical order of their files. `CARRIERS` and
    modules in `without` do not count, whoever imports them. A name of no module raises a ConfigurationError.
    """
    found: dict[str, Module] = {}
    waiting, carriers = list(names), tuple(f"knitstudy.{each}." for each in CARRIERS)
    while waiting:
        name = waiting.pop()
        if name in (*found, *without, "knitstudy") or f"{name}.".startswith(carriers):
            continue
        path = _path_of(name)
        if path is None:
            raise ConfigurationError(f"there is no module {name!r}")
        found[name] = _read(path, name)
        waiting += [each for each in found[name].imports if _counts(each, name)]
        # The packages whose __init__ runs before
        around = accumulate(name.split(".")[:-1], "{}.{}".format)
        waiting += [package for package in around if _path_of(package)]
    return sorted({module.path: module for module in found.values()}.values(), key=lambda module: module.path)


@cache
def _counts(name: str, importer: str) -> bool:
    """Whether a name that a module imports is a module whose code counts."""
    top, of_importer = name.partition(".")[0], importer.partition(".")[0]
    if of_importer == "knitstudy" != top:
        return False
    path = _path_of(name)
    return path is not None and (
        top in ("knitstudy", of_importer) or not INSTALLED.intersection(path.parents)
    )


@cache
def _path_of(name: str) -> Path | None:
    """Return the Python file of a module; None if there is none."""
    if name.split(".")[0] == "knitstudy":
        base = PACKAGE.joinpath(*name.split(".")[1:])
        return next(
            (path for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file()), None
        )
    try:
        spec = find_spec(name)
    except (ImportError, ValueError):  # a name in a module, for example
        return None
    return Path(spec.origin).resolve() if spec and spec.origin and spec.origin.endswith(".py") else None


def _state(path: Path) -> str:
    """Return what changes with a file."""
    stat = path.stat()
    return f"{path} {stat.st_mtime_ns} {stat.st_size}"


@cache
def _cache() -> Path:
    """Return the file of what was read of modules by this Python and by this module as it is now."""
    folder = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    made_by = hashlib.sha256(f"{sys.version} {_state(Path(__file__))}".encode()).hexdigest()[:8]
    return Path(folder) / "knitstudy" / f"code-{made_by}.json"


@cache
def _kept() -> dict[str, list]:
    """Return imports and digests that were read before, by the name of the module and the state of its file."""
    try:
        found = json.loads(_cache().read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _keep() -> None:
    """Keep what is known of files as they are now; a cache that cannot be written is none."""

    def holds(key: str) -> bool:
        path = Path(key.partition(" ")[2].rsplit(" ", 2)[0])
        return path.is_file() and key.endswith(f" {_state(path)}")

    with suppress(OSError, DataFileError), replacing(_cache()) as temporary:
        now = {key: value for key, value in _kept().items() if holds(key)}
        temporary.write_text(json.dumps(now), encoding="utf-8")


@cache
def _read(path: Path, name: str) -> Module:
    """Return a module, parsed unless its file is as it was when it was read before."""
    kept, key = _kept(), f"{name} {_state(path)}"
    if key not in kept:
        module = _parsed(path, name)
        kept[key] = [module.imports, module.digest]
    imports, digest = kept[key]
    return Module(path, tuple(imports), digest)


def _parsed(path: Path, name: str) -> Module:
    collecting = gc.isenabled()
    gc.disable()  # a syntax tree is many objects that all live: looking for garbage takes most of the time
    try:
        tree = ast.parse(path.read_text(encoding="utf-8"), filename=str(path))
        imports = _imported(tree, name if path.name == "__init__.py" else name.rpartition(".")[0])
        return Module(path, tuple(imports), tree_digest(tree))
    finally:
        if collecting:
            gc.enable()


def tree_digest(tree: ast.Module) -> str:
    """Return a digest of the instructions of a syntax tree, from which docstrings are taken."""
    for node in _statements(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            # A text that stands alone documents: of fields and constants as well.
            nothing = [ast.Pass(lineno=1, col_offset=0)]
            node.body = [each for each in node.body if not _is_text(each)] or nothing
    code = compile(tree, "", "exec", dont_inherit=True)
    return hashlib.sha256(repr(_essence(code)).encode()).hexdigest()


def _is_text(node: ast.stmt) -> bool:
    value = node.value if isinstance(node, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def _essence(value: Any) -> Any:
    """Return what counts of code and of its constants: all but places in the file."""
    if isinstance(value, tuple):
        return tuple(map(_essence, value))
    if isinstance(value, frozenset):
        return sorted(map(repr, value))  # their order differs from process to process
    if not isinstance(value, CodeType):
        return repr(value)
    fields = "name code names varnames freevars cellvars argcount posonlyargcount kwonlyargcount flags consts"
    return tuple(_essence(getattr(value, f"co_{field}")) for field in fields.split())


def _imported(tree: ast.Module, package: str) -> Iterator[str]:
    """Yield the names that a module imports, but under TYPE_CHECKING: of modules, and of what may be one in them."""
    for node in _statements(tree, but_types=True):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            inside = "." * node.level + (node.module or "")
            base = resolve_name(inside, package) if node.level else inside
            yield from (base, *(f"{base}.{alias.name}" for alias in node.names))


def _statements(tree: ast.Module, but_types: bool = False) -> Iterator[ast.AST]:
    """Yield a tree and all statements in it, but for those under TYPE_CHECKING if that is asked for."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if but_types and isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        yield node
        held = (getattr(node, block, ()) for block in BLOCKS)
        # The body of an expression is no list.
        waiting += [each for block in held if isinstance(block, list) for each in block]
