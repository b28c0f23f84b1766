"""The page holds every figure and table, numbers of captions come from tables, and wrong texts are named."""

import re
from html import escape
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr
import yaml
from matplotlib.figure import Figure
from refusals import refusal

from knitstudy.paper.report import age_warning, numbers, render, value
from knitstudy.run.catalogue import FIGURES, TABLES
from knitstudy.run.committed_tables import with_runs
from knitstudy.use.style import save

ROOT = Path(__file__).resolve().parents[2]
REPORT = ROOT / "workflow" / "report"

CAPTIONS = {
    "figures": {
        name: {
            "alt": f"sight of {name}",
            "caption": "<C>",
            "paper": "it says",
            "ours": '{{ value("t", "a", "b") }}',
        }
        for name in FIGURES.names()
    },
    "tables": {name: {"caption": f"about {name}"} for name in TABLES.names()},
    "opening": {
        "asked": "What is asked?",
        "pictures": ["none", "fig09_interactions"],
        "pulled": ["{{ key('yarn.diameter', '.2g', 1e-3) }} mm thick."],
        "sentences": ["b is {{ value('t', 'a', 'b') }}.", "Left out: {{ value('t', 'c', 'b') }}."],
    },
}
CAPTIONS["figures"]["fig02_interfaces"]["folded"] = True
CAPTIONS["figures"]["fig03_interactions"]["numbers"] = {
    "table": "t",
    "columns": {"size (m)": "b"},
    "rows": ["a"],
}


@pytest.fixture(scope="module")
def captions():
    """Captions of the study."""
    return yaml.safe_load((REPORT / "captions.yaml").read_text())


@pytest.fixture
def pictures(tmp_path):
    """A small picture for every figure."""
    paths = [tmp_path / f"{name}.png" for name in FIGURES.names()]
    for path in paths:
        sources = {"dns": xr.Dataset(attrs={"scene": "dns-a", "digest": "beef"})}
        save(Figure(figsize=(0.5, 0.4)), [path], sources, path.stem)
    return paths


KEPT = with_runs(ROOT / "resources" / "verdicts.csv")
"""Verdicts of the full study."""

RULES = pd.read_csv(ROOT / "resources" / "reference" / "paper_claims.csv")


@pytest.fixture
def results():
    """Two claims of the full study, the second one as if it had not been run."""
    plain = pd.DataFrame({"name": ["a", "c"], "b": [1.23456, None]})
    since = [
        "id",
        *(name for name in RULES if name not in KEPT),
    ]  # the committed table may be older than rules
    claims = KEPT[:2].merge(RULES[since], on="id").astype(object)
    claims.loc[1, ["verdict", "quantity", "paper", "ours", "measured"]] = (
        "not yet run",
        None,
        None,
        None,
        None,
    )
    return {name: plain for name in TABLES.names()} | {"verdicts": claims}


@pytest.fixture
def page(pictures, results, monkeypatch):
    monkeypatch.setattr(TABLES, "_entries", dict(TABLES.all()))
    TABLES.add("t", "of another package", texts={"caption": "of t"})(lambda: None)
    provenance = pd.DataFrame({"file": ["dns/a.nc"], "scene": ["dns-a"]})
    results = results | {"t": results["geometry"]}
    notes = ["The reference is old."]
    return render(REPORT / "template.html", CAPTIONS, pictures, results, provenance, "reduced", notes, KEPT)


def test_page_holds_every_figure_and_table_in_order_and_nothing_from_elsewhere(page):
    pictures = re.findall(r'<img src="data:image/webp;base64,[\w+/=]+" [^>]*alt="sight of (\w+)"', page)
    assert pictures[0] == "fig09_interactions"
    assert sorted(pictures) == sorted(FIGURES.names())
    for name in TABLES.names():
        assert f'href="tables/{name}.csv"' in page
    loaded = re.findall(r'(?:src|srcset|poster|data)="([^"]*)"', page) + re.findall(r"url\(([^)]*)\)", page)
    assert len(loaded) == len(pictures)
    assert not re.search(r"<(?:script|link|iframe|object)\b", page)
    assert 'href="dns/a.nc"' in page
    assert "dns of dns-a [beef]" in page
    parts = (
        "top",
        "verdicts",
        "fig15_force_strain",
        "fig01_unit_cell",
        "fig02_interfaces",
        "rom_distance",
        "data",
    )
    places = [page.index(f'id="{part}"') for part in parts]
    assert places == sorted(places), "folded figures and tables come last"


def test_page_opens_with_the_question_a_picture_and_sentences(page):
    head = page[: page.index("<main>")]
    assert "What is asked?" in head
    assert "<p>Of 2 claims of the paper, " in head, "how many are reproduced, by which rules"
    assert head.count("<img ") == 1
    assert "<p>b is 1.23.</p>" in head, "sentences without a number are left out"


def test_a_verdict_is_one_line_and_all_else_is_folded(page):
    lines = re.findall(r'<details class="claim"><summary class="line">(.*?)</summary>', page, flags=re.DOTALL)
    message = [re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", line)).strip() for line in lines]
    judged, waiting = KEPT.iloc[0], KEPT.iloc[1]
    assert message == [
        f"{judged.id} {judged.short} {judged.verdict} {judged.quantity} {judged.paper} {judged.ours}",
        f"{waiting.id} {waiting.short} not yet run {waiting.quantity} {waiting.paper} {waiting.ours} (full study)",
    ]
    for measured in judged.measured.splitlines():
        quantity, ours, *_ = measured.split(" | ")
        assert f"<td>{escape(quantity)}</td><td>{ours}</td>" in page


def test_numbers_of_a_figure_stand_in_a_table(results):
    table = {"t": results["geometry"]}
    shown = numbers(table, "t", {"size (m)": "b"})
    assert (shown["header"], shown["rows"]) == (["name", "size (m)"], [["a", "1.235"], ["c", "–"]])
    assert numbers({}, "t", {"size (m)": "b"}) is None
    assert value(table, "t", "a", "b", ".1f", 1e-3) == "1234.6", "a caption names the unit"
    with refusal("captions: table 't' has no column 'z'"):
        numbers(table, "t", {"size": "z"})


def test_captions_name_all_figures_and_tables(captions):
    assert set(captions["figures"]) == set(FIGURES.names())
    assert set(captions["tables"]) == set(TABLES.names())
    for texts in captions["figures"].values():
        assert set(texts) - {"folded", "numbers"} == {"alt", "caption", "paper", "ours"}


def test_a_smaller_study_shows_kept_results_of_the_full_study(pictures, results, tmp_path, monkeypatch):
    monkeypatch.setattr(TABLES, "_entries", dict(TABLES.all()))
    TABLES.add("t", "of another package", texts={"caption": "of t"})(lambda: None)
    (tmp_path / "readings.csv").write_text("name,b\nkept,7\n")
    one = [path for path in pictures if path.stem == "fig11_sweeps"]
    save(Figure(figsize=(0.5, 0.4)), [tmp_path / "fig11_sweeps.png"], {}, "kept")
    shown = results | {"t": results["geometry"]}
    arguments = REPORT / "template.html", CAPTIONS, one, shown, pd.DataFrame({"file": ["a.nc"]})
    page = render(*arguments, "reduced", full=tmp_path, page=tmp_path / "results" / "report.html")
    assert "kept</th>" in page
    assert page.count("(of the full study)") >= 2, "in the title of the table and of the figure"
    for name, own in (("fig11_sweeps.png", "figures"), ("readings.csv", "tables")):
        assert f'href="../{name}"' in page, "links open what is shown"
        assert f"{own}/{name}" not in page
    assert "fig11_sweeps.pdf" not in page
    assert "(of the full study)" not in render(*arguments, "full", full=tmp_path)
    assert "<iframe" not in page


def test_a_knit_turns_and_its_keys_say_what_is_pulled(results, plain_scene):
    captions = CAPTIONS | {"opening": CAPTIONS["opening"] | {"sentences": []}}
    arguments = REPORT / "template.html", captions, [], results, pd.DataFrame({"file": ["a.nc"]})
    page = render(*arguments, "reduced", turning=("<b>knit</b>", plain_scene))
    assert 'srcdoc="&lt;b&gt;knit' in page
    assert f"<p>{1e3 * plain_scene.yarn.diameter:.2g} mm thick.</p>" in page
    assert "mm thick" not in render(*arguments, "reduced")


def test_a_warning_names_what_has_changed_since_a_table_was_kept(tmp_path):
    kept = tmp_path / "scenes.csv"
    kept.write_text("scene,keys,run\na,0x1,1\nb,0x2,1\n")
    row = "scenes.csv,1,,,,,2026-11-28,make reference"
    (tmp_path / "runs.csv").write_text(f"table,run,groups,behaviour,code,commit,made,command\n{row}\n")
    assert age_warning(kept, "keys", {"b": "0x2", "a": "0x1", "later": "3"}, "Values", "reference") == ""
    for present in ({"a": "0x1", "b": "0x3"}, {"a": "0x1"}):
        warning = age_warning(kept, "keys", present, "Values", "reference")
        assert warning == (
            "Values were committed on 2026-11-28; changed since then: keys of b; `make reference` makes them again."
        )
