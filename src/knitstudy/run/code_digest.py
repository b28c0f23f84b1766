"""Digests of the code behind a result: equal where nothing has changed that can change the result.

Of every file in the packages that make the result its statements count, without comments, docstrings and blank lines.
Files of scenes are another case. The values of keys are in the digest of a scene, so that the keys themselves, their
defaults, limits and descriptions do not count; but scenes compute as well (radii, which row has which yarn, friction),
and their functions and constants do. Files that turn what people write into keys do not count at all: their answer is
the keys.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterator
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
"""Packages and files whose code makes the numbers of meshes and of simulations."""

OF_SCENES = ("knit/scene/*.py", "knit/models/*/__init__.py")
"""Files of scenes, whose functions and constants count for all results."""

FILES_OF_INPUT = (
    "alternatives.py",
    "documents.py",
    "flat_knit.py",
    "keys.py",
    "knit_graph.py",
    "knitout.py",
    "knitting_machine.py",
    "repeat_search.py",
)
"""Files of `knit/scene` that turn what people write into keys."""

_PART = re.compile(
    r"\#[^\n]*"  # a comment
    r"|[rRbBuUfF]{0,2}(?:"  # a string
    r'"""(?:\\.|.)*?"""'
    r"|'''(?:\\.|.)*?'''"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'(?:\\.|[^'\\\n])*'"
    r")|[()\[\]{}]",
    re.DOTALL,
)


def code_digest(*places: str) -> str:
    """Return a digest of the code in packages and files of this package, of scenes, and of plugins that are loaded.

    Examples
    --------
    >>> len(code_digest("knit/geometry"))
    16
    """
    return _digest(places, tuple(plugin_files()))


def physics_digest() -> str:
    """Return the digest of all that makes the numbers of meshes and simulations, without plugins."""
    return _digest(MODEL, ())


@cache
def statements(source: str) -> str:
    """Return a program without its comments, docstrings and blank lines.

    A docstring is a line of its own that is a string alone, outside of all brackets.

    Examples
    --------
    >>> statements('def f(x):  # of x\\n    \"\"\"Return x.\"\"\"\\n\\n    return g(\\n        "#"\\n    )')
    'def f(x):\\n    return g(\\n        "#"\\n    )'
    """
    kept: list[str] = []
    end = 0
    depth = 0
    for match in _PART.finditer(source):
        text = match.group()
        if text in "([{":
            depth += 1
        elif text in ")]}":
            depth -= 1
        elif text.startswith("#") or (depth == 0 and _stands_alone(source, match)):
            kept.append(source[end : match.start()])
            end = match.end()
    kept.append(source[end:])
    return "\n".join(line.rstrip() for line in "".join(kept).splitlines() if line.strip())


def _stands_alone(source: str, match: re.Match[str]) -> bool:
    """Return whether nothing else stands on the lines of a match."""
    begin = source.rfind("\n", 0, match.start()) + 1
    end = source.find("\n", match.end())
    beside = source[begin : match.start()] + source[match.end() : end if end >= 0 else len(source)]
    return not beside.strip()


@cache
def _digest(places: tuple[str, ...], plugins: tuple[Path, ...]) -> str:
    scenes = [
        file for files in OF_SCENES for file in sorted(PACKAGE.glob(files)) if file.name not in FILES_OF_INPUT
    ]
    digest = hashlib.sha256()
    for file in scenes:
        digest.update(_computed(file.read_text(encoding="utf-8")).encode())
    for place in sorted(set(places)):
        path = PACKAGE / place
        inside = sorted(
            file for file in path.rglob("*") if file.suffix in (".py", ".tsv") and file not in scenes
        )
        for file in [path] if path.is_file() else inside:
            text = file.read_text(encoding="utf-8")
            counted = statements(text) if file.suffix == ".py" else text
            digest.update(f"{file.relative_to(PACKAGE).as_posix()}\n{counted}\n".encode())
    for file in plugins:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


@cache
def _computed(source: str) -> str:
    """Return what a file of scenes computes: the statements of its functions, and its constants.

    Validators do not count: they refuse values and change none.
    """
    return "\n".join(statements(text) for text in _computing_parts(source))


def _computing_parts(source: str) -> Iterator[str]:
    module = ast.parse(source)
    lines = source.encode().splitlines(keepends=True)
    for statement in module.body:
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            yield _text_of(statement, lines)
    for node in ast.walk(module):
        if isinstance(node, ast.FunctionDef | ast.Lambda):
            decorators = "".join(ast.dump(each) for each in getattr(node, "decorator_list", []))
            if "validator" not in decorators:
                yield _text_of(node, lines)


def _text_of(node: ast.stmt | ast.expr, lines: list[bytes]) -> str:
    """Return the text of a node; `ast.get_source_segment` divides the whole source into lines for every node."""
    assert node.end_lineno is not None
    assert node.end_col_offset is not None
    own = lines[node.lineno - 1 : node.end_lineno]
    own[-1] = own[-1][: node.end_col_offset]
    own[0] = own[0][node.col_offset :]
    return b"".join(own).decode()
