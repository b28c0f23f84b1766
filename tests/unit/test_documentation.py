"""Pages name keys and files that are there, docstrings show what they return, packages keep their order."""

import doctest
import importlib
import re
from importlib.util import find_spec
from pathlib import Path

import pytest
from importlinter.cli import lint_imports
from measured_numbers import measured_numbers

import knitstudy
from knitstudy.datasets import read_table
from knitstudy.knit.scene.alternatives import OTHER_WAYS
from knitstudy.knit.scene.kinds import Labels, all_sections, role_of
from knitstudy.measures.reference import HOW_FAR, physics_of
from knitstudy.run.configuration import load_scenes

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "config" / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]
LINKING = [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
TEXTS = [*PAGES, *sorted(ROOT.glob("config/**/*.yaml"))]  # with the comments of configurations
ROOTS = ("src/knitstudy", ".")  # folders that paths on pages begin in
COMMAND = re.compile(r"python -m (knitstudy[\w.]*)")
MODULE = re.compile(r"`(?:python )?([\w./-]+/\w+\.py)[ `]")
LINK = re.compile(r"\]\(([^)#:\s]+)\)")
KEY = re.compile(rf"`({'|'.join(all_sections())})\.(\w+)[` ]")

DESCRIBED = {name: (Labels, name) for name in Labels.model_fields} | {
    f"{section}.{name}": (described, name)
    for section, keys in all_sections().items()
    for name, described in keys.items()
}


def test_every_physical_key_enters_the_problem_and_no_other():
    for scene in load_scenes().values():
        actual = physics_of(scene).keys()
        expected = {key for key in DESCRIBED if role_of(key) == "physics" and has(scene, key)}
        expected |= scene.kind.part.implied.keys()
        assert actual | {HOW_FAR} == expected | {HOW_FAR}, scene


def has(scene, key):
    section, _, name = key.rpartition(".")
    return not section or (section in scene.sections and name in type(scene.sections[section]).model_fields)


@pytest.mark.parametrize("name", ["columns", "keys", "anomalies"])
def test_documentation_is_up_to_date(docs_script, name):
    """Otherwise: python docs/reference/NAME.py."""
    docs = docs_script(name)
    page = docs.PAGE.read_text(encoding="utf-8")
    assert (docs.keys_page() if name == "keys" else docs.renewed(page)) == page


@pytest.mark.optional_packages
@pytest.mark.parametrize("page", TEXTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_texts_name_modules_and_keys_that_are_there(page):
    text = page.read_text(encoding="utf-8")
    modules = {
        path for path in MODULE.findall(text) if not any((ROOT / root / path).is_file() for root in ROOTS)
    }
    modules |= {module for module in COMMAND.findall(text) if not find_spec(module)}
    keys = {".".join(actual) for actual in KEY.findall(text)} - DESCRIBED.keys() - set(OTHER_WAYS)
    dotted = {key for key in keys if not (ROOT / f"src/knitstudy/{key.replace('.', '/')}.py").is_file()}
    assert not modules | dotted, page


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_somewhere(page):
    for path in LINK.findall(page.read_text(encoding="utf-8")):
        assert (page.parent / path).exists(), path


CLAIM = re.compile(rf"\b({'|'.join(read_table(ROOT / 'resources/reference/paper_claims.csv')['id'])})\b")
GENERATED = {ROOT / "docs" / "reference" / "results.md", ROOT / "docs" / "anomalies.md"}


def test_decimals_and_numbers_with_a_unit_may_be_measured():
    text = "1.9 times, 7% of the pairs, 2 of 4, 0.45 here, 3D networks of Fig. 11(b), section 2.6, K5"
    assert measured_numbers(text) == {"1.9 times", "7 %", "2 of 4", "0.45"}


@pytest.mark.parametrize(
    "page", sorted({*PAGES[2:]} - GENERATED), ids=lambda page: str(page.relative_to(ROOT))
)
def test_pages_link_to_the_numbers_of_claims(page):
    """Verdicts are made again, and pages are not: a line that names a claim has no measured number."""
    lines = page.read_text(encoding="utf-8").splitlines()
    assert not [line for line in lines if CLAIM.search(line) and measured_numbers(line)]


ANCHOR = re.compile(r"\]\(([^):\s]*)#([^)\s]+)\)")


def anchors(page):
    """Return the anchors that MkDocs and GitHub give to the headings of a page."""
    heads = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"\s+", "-", re.sub(r"[^\w\s-]", "", head.lower()).strip()) for head in heads}


@pytest.mark.parametrize("page", LINKING, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_anchor_is_a_heading(page):
    for path, anchor in ANCHOR.findall(page.read_text(encoding="utf-8")):
        target = page.parent / path if path else page
        assert anchor in anchors(target), f"{path}#{anchor}"


def test_every_page_is_linked_from_the_readme_or_its_index():
    index = ROOT / "docs" / "index.md"
    linked = {
        (page.parent / path).resolve()
        for page in (PAGES[0], index)
        for path in LINK.findall(page.read_text(encoding="utf-8"))
    }
    assert {page for page in PAGES[1:] if page.parent.name != "notes"} <= linked


NOTE = re.compile(
    r"^\| \[\w+\]\((\w+\.md)\) \| [^|]{20,} \| [^|]+ \| `[^|]+` \| \d\d-\d\d, `[0-9a-f]{8}` \|$", re.MULTILINE
)


def test_every_note_has_its_result_figure_command_date_and_code():
    notes = ROOT / "docs" / "notes"
    listed = NOTE.findall((notes / "README.md").read_text(encoding="utf-8"))
    assert sorted(listed) == sorted(page.name for page in notes.glob("*.md") if page.name != "README.md")


PACKAGE = Path(knitstudy.__file__).resolve().parent

WITH_EXAMPLES = [
    ".".join(("knitstudy", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")
    for path in sorted(PACKAGE.rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_run(module):
    results = doctest.testmod(importlib.import_module(module))
    assert (results.failed, results.attempted > 0) == (0, True)


CONTRACTS = Path(__file__).parents[2] / ".importlinter"


def test_contracts_of_imports_are_kept(capsys, monkeypatch):
    """The linter would disable the loggers that other tests listen to."""
    monkeypatch.setattr("logging.config.dictConfig", lambda _: None)
    assert lint_imports(config_filename=str(CONTRACTS), cache_dir=None) == 0, capsys.readouterr().out
