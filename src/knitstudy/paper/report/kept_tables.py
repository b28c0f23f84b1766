"""Tables that are kept in ``resources``, and warnings where they are of other code than today's.

``benchmarks/keep.py`` makes them.
"""

from __future__ import annotations

from pathlib import Path

from knitstudy.files import read_table
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.knit.scene.scene import Scene
from knitstudy.run.catalogue import TABLES, Catalogue, Displays, reference_files
from knitstudy.run.configuration import CONFIG, load_study
from knitstudy.run.plan import Plan

STUDY, VERDICTS = "full", "verdicts"

VERDICTS_KEPT = RESOURCES / "verdicts.csv"
"""Verdicts of the full study, which the report of every study shows."""

REFERENCE = RESOURCES / "reference" / "reference.csv"
"""Reference values; a file beside it has the values of single simulations."""

SIMULATED = ("simulation", "contacts")  # Stages that the reference is made from


def age_warning(kept: Path, column: str, wanted: str, what: str, target: str) -> str:
    """Return a warning where rows of a kept table have another digest; else an empty text.

    `what` names the rows in the plural, `target` is the target of make for them.
    """
    table = read_table(kept, needs=(column, "made"))
    if set(table[column].astype(str)) == {wanted}:
        return ""
    days = ", ".join(sorted(set(table["made"].astype(str))))
    why = "code or scenes have changed since, or not all had been run"
    return f"{what} were kept on {days}; {why}: `make {target}` makes them anew."


def full_study(catalogue: Catalogue, plan: Plan, scenes: list[Scene], config: Path) -> Displays:
    """Return the figures or tables of the full study that can be made of scenes."""
    return Displays(catalogue, plan, scenes, reference_files(config), label=f"study {STUDY!r}")


def verdicts_warning(plan: Plan, config: Path = CONFIG) -> str:
    """Return a warning where the kept verdicts were made by other code or scenes than today's; else an empty text."""
    displays = full_study(TABLES, plan, [plan.scenes[name] for name in load_study(STUDY, config)], config)
    wanted = displays.digest(VERDICTS) if VERDICTS in displays.names() else ""
    return age_warning(VERDICTS_KEPT, "digest", wanted, f"Verdicts of the study {STUDY!r}", VERDICTS)
