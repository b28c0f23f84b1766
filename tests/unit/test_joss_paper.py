"""paper.md has the form that the Journal of Open Source Software asks for, and its numbers are those of the tables."""

import re
from pathlib import Path

import pandas as pd
import pytest

ROOT = Path(__file__).resolve().parents[2]
RESOURCES = ROOT / "resources"
_, HEAD, BODY = (ROOT / "paper.md").read_text(encoding="utf-8").split("---\n", 2)
TEXT = " ".join(BODY.split())
KEYS = re.compile(r"^@\w+\{(\w+),", re.MULTILINE)
CITED = re.compile(r"@(\w+)")

SECTIONS = {
    "Summary",
    "Statement of need",
    "State of the field",
    "Software design",
    "Tests and research impact",
    "AI usage disclosure",
}


def test_length():
    assert 750 <= len(TEXT.split()) <= 1750


def test_sections():
    assert set(re.findall(r"^# (.*)$", BODY, re.MULTILINE)) >= SECTIONS


def test_every_reference_is_cited_and_every_citation_is_a_reference():
    listed = KEYS.findall((ROOT / "paper.bib").read_text(encoding="utf-8"))
    assert len(listed) == len(set(listed))
    assert set(listed) == set(CITED.findall(BODY))


def table(name):
    return pd.read_csv(RESOURCES / name)


def verification():
    cases = table("verification.csv")
    assert cases["holds"].all()
    return f"A table of {len(cases)} verification cases"


def rods():
    rows = table("benchmarks.csv")
    return f"{len(rows)} quantities of {rows['benchmark'].nunique()} rod benchmarks"


def promises():
    rows = table("promises.csv")
    return f"{len(rows):,} promises hold in {100 * rows['held'].mean():.1f} % of cases"


def extremes():
    outcomes = table("extremes.csv")["outcome"]
    ended = (outcomes == "ended").sum()
    others = outcomes.isin(["refused", "stopped"]).sum()
    assert ended + others == len(outcomes), "the text says that no scene failed in another way"
    return f"Of {len(outcomes)} scenes at the bounds of all keys, {ended} end, and {others} are refused or stopped"


def claims():
    rows = table("verdicts.csv")
    number = rows[rows["counts"] == "yes"]["verdict"].value_counts()
    return (
        f"Of {len(rows)} claims of @liu2018, {number['reproduced']} hold in converged simulations;"
        f" of {number['direction holds, size does not']} the direction holds and the size does not,"
        f" {number['contradicted']} do not hold, {number['undecidable']} cannot be decided from what is printed,"
        f" and {(rows['counts'] != 'yes').sum()} do not count"
    )


def swatches():
    return f"Sizes of {len(table('swatches.csv'))} swatches of KnitDB"


@pytest.mark.parametrize("sentence", [verification, rods, promises, extremes, claims, swatches])
def test_numbers_are_those_of_the_tables(sentence):
    assert sentence() in TEXT
