"""How the workflow engine learns which results are up to date: from files that hold the digests they should have.

Such a file is an input of the rule: older than a result of its digest, whoever made that, and newer than one of another
digest. A result that is up to date is dated after all that it is made from, since the engine compares times alone.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from knitstudy.errors import ConfigurationError
from knitstudy.stages.plan import Plan, digest_or_warning
from knitstudy.study.scene import Scene, digest

FOLDER = Path("run/digests")
"""Where they lie, beside restart files."""


def note(name: str | Path, wanted: str, result: Path | None = None) -> bool:
    """Write the digest that a result should have, unless it is written already; return whether the result has it.

    Parameters
    ----------
    name : str or Path
        Of the result.
    wanted : str
    result : Path, optional
        File that says which digest it has; without one, only a digest that changes makes a result out of date.
    """
    path = FOLDER / name
    written = path.read_text(encoding="utf-8") if path.is_file() else None
    if result is None or not result.is_file():
        if written != wanted:
            _write(path, wanted)
        return False
    recorded = digest_or_warning(result)
    if recorded == wanted:
        if written != wanted:
            _write(path, wanted)
        older = result.stat().st_mtime - 1
        if path.stat().st_mtime > older:
            os.utime(path, (older, older))
        return True
    # The engine compares contents as well as times: what is there now is part of it.
    text = f"{wanted} instead of {recorded or 'none'}"
    if written != text or path.stat().st_mtime <= result.stat().st_mtime:
        _write(path, text)
    return False


def note_all(plan: Plan, scenes: Iterable[Scene], results: Path) -> None:
    """Note the digests of all that can be made of scenes, and date what is up to date after what it is made from."""
    for stage, scene in plan.steps(scenes):
        path = stage.path(scene)
        try:
            wanted = plan.digest(stage, scene)
        except ConfigurationError:
            continue  # it says so when it is asked for
        if path.suffix != ".nc":
            note(path, wanted)
        elif note(path, wanted, results / path):
            made_from = (results / other.path(of) for other, of in plan.needs(stage, scene).values())
            _date_after(results / path, [file for file in made_from if file.is_file()])


def _date_after(result: Path, files: Iterable[Path]) -> None:
    latest = max((file.stat().st_mtime_ns for file in files), default=0)
    if latest > result.stat().st_mtime_ns:
        os.utime(result, ns=(latest, latest))


def digest_of_files(reads: Mapping, code: str, needed: Mapping[str, str]) -> str:
    """Return the digest of a figure, a table or the report: of what it reads, its code, and what it is made from."""
    return digest({"reads": dict(reads), "code": code, "needs": dict(needed)})


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
