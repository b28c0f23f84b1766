"""Modules lie in rooms, one above the other: imports run downwards and never in a circle."""

import ast
from pathlib import Path

import knitstudy

PACKAGE = Path(knitstudy.__file__).resolve().parent

ROOMS = (
    {"errors", "interruption"},
    {"registry"},
    {"files"},
    {"mechanics"},
    {"study"},
    {"geometry"},
    {"mesh"},
    {"loading"},
    {"contacts"},
    {"models"},
    {"exchange"},
    {"measures"},
    {"figures", "tables"},
    {"report"},
    {"stages"},
    {"cli"},
)
"""From below; those of one level do not import each other."""

LEVEL = {room: level for level, rooms in enumerate(ROOMS) for room in rooms}

AT_THE_TOP = {"__init__", "__main__", "errors", "files", "interruption", "registry"}  # for newcomers

MODULES = {
    ".".join(("knitstudy", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__"): path
    for path in sorted(PACKAGE.rglob("*.py"))
}


def room(module):
    return module.split(".")[1]


def imported(path):
    """Return the modules of the package that a file imports, in functions and under TYPE_CHECKING as well."""
    actual, waiting = set(), [ast.parse(path.read_text(encoding="utf-8"))]
    while waiting:
        node = waiting.pop()
        waiting += ast.iter_child_nodes(node)
        if isinstance(node, ast.Import):
            actual |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            actual |= (names & MODULES.keys()) or {node.module}
    return {name for name in actual if name in MODULES and name != "knitstudy"}


IMPORTS = {module: imported(path) for module, path in MODULES.items()}


def is_downward(module, other):
    here, there = room(module), room(other)
    return here == there or LEVEL[here] > LEVEL[there]


def test_imports_run_downwards():
    upward = [
        f"{module} imports {other}"
        for module, others in IMPORTS.items()
        for other in sorted(others)
        if module not in ("knitstudy", "knitstudy.__main__") and not is_downward(module, other)
    ]
    assert upward == []


def circle(imports):
    """Return modules that import each other one after the other, or nothing."""
    done = set()

    def follow(module, way):
        if module in way:
            return [*way[way.index(module) :], module]
        if module in done:
            return []
        actual = next(filter(None, (follow(other, [*way, module]) for other in sorted(imports[module]))), [])
        done.add(module)
        return actual

    return next(filter(None, (follow(module, []) for module in imports)), [])


def test_no_module_imports_itself_by_way_of_others():
    assert circle(IMPORTS) == []


def test_only_files_for_newcomers_lie_at_the_top():
    actual = {path.stem for path in PACKAGE.glob("*.py")}
    assert actual == AT_THE_TOP
    assert {path.parent.name for path in PACKAGE.glob("*/__init__.py")} <= LEVEL.keys()
