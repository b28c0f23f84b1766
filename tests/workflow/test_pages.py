"""The README and the tutorials run as they are printed."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import nbclient
import nbformat
import pandas as pd
import pytest
from conftest import Checkout

from knitstudy.datasets import STRAINS, read_dataset

ROOT = Path(__file__).resolve().parents[2]
NO_WINDOW = {"MPLBACKEND": "agg"}


def blocks(page, language):
    """Return the blocks of a language on a page of docs, or of the README."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)


def run(*words, folder, environment=os.environ, program=(sys.executable,)):
    """Run Python, or another program, in a folder."""
    options = {"cwd": folder, "env": environment, "capture_output": True, "text": True}
    ended = subprocess.run([*program, *words], **options)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended


def last_number(printed, quantity):
    """Return the last value of a quantity in printed tables."""
    return float(re.findall(rf"^{quantity}\t(\S+)", printed, flags=re.MULTILINE)[-1])


def test_readme(fresh, tmp_path):
    """The first answer is that of the README, and the lines in Python print it as well."""
    ((scene,), (commands,), (answer,), (code,)) = (
        blocks("README.md", language) for language in ("yaml", "bash", "text", "python")
    )
    assert len(scene.splitlines()) <= 12
    (tmp_path / "my-jersey.yaml").write_text(scene, encoding="utf-8")
    here = {"folder": tmp_path, "environment": fresh.environment}
    install, *lines = commands.splitlines()
    assert install == "python -m pip install ."  # as test_installed does
    assert len(lines) == 2
    ended = [run("-m", *shlex.split(line, comments=True), **here).stdout for line in lines]
    for row in answer.splitlines():
        quantity, value, _unit = row.split("\t")
        assert last_number(ended[-1], quantity) == pytest.approx(float(value), rel=PRINTED)
    printed = run("-c", code, **here).stdout.splitlines()
    smooth, rough = (float(line.split()[-2]) for line in printed)
    assert smooth < rough == pytest.approx(last_number(ended[-1], quantity), rel=PRINTED)


LONG = {"7_machine_knits": pytest.mark.full}  # four fabrics to 30 %
SCRIPTS = [
    pytest.param(path, id=path.stem, marks=LONG.get(path.stem, ()))
    for path in sorted((ROOT / "examples").glob("*.py"))
]


@pytest.mark.parametrize("example", SCRIPTS)
def test_example(tmp_path, example):
    code = example.read_text(encoding="utf-8")
    assert len(code.splitlines()) <= 48
    page = (ROOT / "docs" / "tutorial" / "examples.md").read_text(encoding="utf-8")
    assert f'--8<-- "examples/{example.name}"' in page, "every example is on the page"
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    assert run("-c", code, folder=tmp_path, environment=os.environ | NO_WINDOW).stdout
    (picture,) = tmp_path.glob("*.png")
    assert picture.stat().st_size > 10_000


def test_notebook(tmp_path):
    """Every cell runs, the results show their variables, and a figure is one call."""
    notebook = nbformat.read(ROOT / "examples" / "knit.ipynb", 4)
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [set(cell.outputs[-1].data) for cell in notebook.cells if cell.cell_type == "code"]
    assert "text/html" in shown[0]
    assert "image/png" in shown[1] & shown[2]


def test_core(fresh, tmp_path):
    """A block that slides is dragged by the friction times its pressure."""
    code, rods = blocks("docs/theory/core.md", "python")
    assert len(code.splitlines()) <= 40
    last = run("-c", code, folder=tmp_path, environment=fresh.environment).stdout.splitlines()[-1]
    drag, pressure = map(float, re.findall(r"(\d+\.\d) N", last))
    assert drag == pytest.approx(0.3 * pressure, rel=0.02)
    printed = run("-c", rods, folder=tmp_path, environment=fresh.environment).stdout
    lowest = dict(line.split(": ") for line in printed.splitlines())
    assert float(lowest["35"]) > 0 > float(lowest["40"])


JERSEY = "tutorial/jersey"
ANSWERS = {  # by the page of a question: what its commands print, and the files that they write
    JERSEY: ("course force over width at the end", "loop.png", "jersey.png", "knit.png"),
    "how-to/measured": ("contact.friction", "runs/simulation/jersey-lab.png", "runs/fit/jersey-lab.csv"),
    "how-to/loads": ("N m", "both.csv"),
    "how-to/cycles": ("J/m2 at", "cycle.png", "cycle.csv"),
    "how-to/sheet": ("stitch density", "runs/sheet/jersey/sheet.html", "my-sheet/numbers.csv"),
    "how-to/abaqus": (
        "hexahedra; m, N, Pa",
        "runs/sheet/jersey/shell.abaqus.inp",
        "cell.inp",
        "swatch.inp",
    ),
}
SCREEN = 45  # lines


def end(scene, variable, plane=None):
    """Return how a number of a page is read: the end of a variable of a history of its commands."""

    def read(folder):
        value = read_dataset(folder / "runs" / "simulation" / f"{scene}.nc")[variable][-1]
        return float(value if plane is None else value[STRAINS.index(plane)])

    return read


def scaled(read, factor):
    """Return how a number is read in another unit."""
    return lambda folder: factor * read(folder)


def at_rest(folder):
    """Distance of the plates that touch the jersey first [mm]."""
    return 1e3 * float(read_dataset(folder / "runs" / "simulation" / "press.nc")["thickness"][0])


NUMBERS = {  # by page: its words around numbers {}, and how each is read from what its commands have written
    JERSEY: {
        "# {} N/m in place of 8.51 N/m at 20 %": (end("wool", "force_per_width", "course"),),
        "| course force over width | {} N/m | {} N/m | {} N/m |": (
            end("jersey", "force_per_width", "course"),
            end("solids", "force_per_width", "course"),
            end("spun", "force_per_width", "course"),
        ),
        "| wale strain: the knit contracts | {} % | {} % | |": (
            scaled(end("jersey", "cell_strain", "wale"), 100),
            scaled(end("solids", "cell_strain", "wale"), 100),
        ),
    },
    "how-to/loads": {
        "| shear, free along both edges | 5 % | {} N/m |": (end("shear", "force_per_width", "shear"),),
        "| course strain 10 % | course {}, wale {} N/m |": (
            end("both", "force_per_width", "course"),
            end("both", "force_per_width", "wale"),
        ),
        "| wale, free across | 10 % | {} N/m |": (end("wale", "force_per_width", "wale"),),
        "| 3 %, from {} to {} mm | {} kPa |": (
            at_rest,
            scaled(end("press", "thickness"), 1e3),
            scaled(end("press", "pressure"), 1e-3),
        ),
    },
}
PRINTED = (
    0.01  # of a number: pages round to three digits; these cells start from drawn loops, which no rest moves
)


def require_numbers(page, folder):
    """Compare the numbers of a page with what its commands have written."""
    text = (ROOT / f"docs/{page}.md").read_text(encoding="utf-8")
    for words, reads in NUMBERS.get(page, {}).items():
        pattern = re.escape(words).replace(r"\{\}", r"(-?[\d.]+)")
        found = re.search(pattern, text)
        assert found, f"{page} has no {words!r}"
        for number, read in zip(found.groups(), reads, strict=True):
            last_digit = 10.0 ** -len(number.partition(".")[2])
            expected = pytest.approx(read(folder), rel=PRINTED, abs=0.5 * last_digit)
            assert float(number) == expected, f"{page}: {words}"


@pytest.fixture(scope="module")
def jersey(tmp_path_factory):
    """A folder with the jersey that the pages of questions go on with, and that of the README."""
    folder = tmp_path_factory.mktemp("jersey")
    (scene,) = blocks(f"docs/{JERSEY}.md", "yaml")
    (folder / "jersey.yaml").write_text(scene, encoding="utf-8")
    (soft,) = blocks("README.md", "yaml")
    (folder / "my-jersey.yaml").write_text(soft, encoding="utf-8")
    return folder


@pytest.mark.parametrize("page", ANSWERS)
def test_a_page_answers_its_question(checkout_copy, jersey, page):
    """Commands and lines in Python run as they are printed, all pages in one folder."""
    for lab in blocks(f"docs/{page}.md", "csv"):
        (jersey / "lab.csv").write_text(lab, encoding="utf-8")
    here = {"folder": jersey, "environment": Checkout(checkout_copy).environment | NO_WINDOW}
    printed = ""
    for commands in blocks(f"docs/{page}.md", "bash"):
        for line in commands.splitlines():
            printed += run("-m", *shlex.split(line, comments=True), **here).stdout
    for code in blocks(f"docs/{page}.md", "python"):
        printed += run("-c", code, **here).stdout
    answer, *files = ANSWERS[page]
    assert answer in printed
    assert all((jersey / name).stat().st_size > 200 for name in files)
    require_numbers(page, jersey)


@pytest.mark.parametrize(
    "page", [*ANSWERS, "how-to/machine_files", "how-to/snakemake", "how-to/compare_stitches"]
)
def test_a_question_has_a_page_of_one_screen(page):
    assert len((ROOT / f"docs/{page}.md").read_text(encoding="utf-8").splitlines()) <= SCREEN
    assert f"({page}.md)" in (ROOT / "docs" / "index.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "command", ["check", pytest.param("run", marks=pytest.mark.full)]
)  # shapes at rest: three minutes
def test_compare_stitches(tmp_path, command):
    """Strains at 10, 20 and 50 N/m are those of the table, to a twentieth: slack loops may find another rest."""
    page = "docs/how-to/compare_stitches.md"
    (scenes,), (commands,), (code,) = (blocks(page, language) for language in ("yaml", "bash", "python"))
    (tmp_path / "stitches.yaml").write_text(scenes, encoding="utf-8")
    lines = commands.replace("knitstudy run", f"knitstudy {command}").splitlines()
    assert len(lines) == 3
    for line in lines:
        run("-m", *shlex.split(line, comments=True), folder=tmp_path)
    if command == "run":
        printed = run("-c", code, folder=tmp_path).stdout.splitlines()
        text = (ROOT / page).read_text(encoding="utf-8")
        for stitch, *strains in (line.replace(" %", "").split() for line in printed):
            row = re.search(rf"^\| {stitch} .*\| (\d+) % \| (\d+) % \| (\d+) % \|$", text, re.MULTILINE)
            assert [float(strain) for strain in row.groups()] == pytest.approx(
                [*map(float, strains)], rel=0.05
            )


def test_a_study_of_parameters(fresh, tmp_path):
    """All six scenes are simulated, and friction adds to the force."""
    (code,) = blocks("docs/how-to/study.md", "python")
    ended = run("-c", code, folder=tmp_path, environment=fresh.environment)
    names, *rows = (line.split() for line in ended.stdout.splitlines())
    assert names[:2] == ["contact.friction", "pattern.course_spacing"]
    table = pd.DataFrame(rows, dtype=float)
    for _, forces in table.groupby(1)[2]:
        assert len(forces) == 3
        assert forces.is_monotonic_increasing, "the page lists frictions from small to large"
    assert table[2].nunique() == 6
    assert "6 scenes" in ended.stderr


@pytest.mark.parametrize(
    "command", ["check", pytest.param("run", marks=pytest.mark.full)]
)  # a shape at rest: 30 s
def test_machine_files(tmp_path, command):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (scene,), (printed,) = (blocks("docs/how-to/machine_files.md", each) for each in ("yaml", "bash"))
    (tmp_path / "my-knit.yaml").write_text(scene, encoding="utf-8")
    for line in printed.replace("knitstudy run", f"knitstudy {command}").splitlines():
        ended = run("-m", *shlex.split(line, comments=True), folder=tmp_path)
    if command == "run":
        assert "course force over width at the end" in ended.stdout


def test_two_yarns(fresh, tmp_path):
    """The commands on the page, in one increment; stripes are softer than cotton, an inlay adds its stretch."""
    (scene,), (printed,) = (blocks("docs/how-to/two_yarns.md", each) for each in ("yaml", "bash"))
    for each, other in (("solver.increments: 10", "solver.increments: 1"), ("strain: 0.2", "strain: 0.01")):
        assert scene.count(each) == 1
        scene = scene.replace(each, other)
    (tmp_path / "stripes.yaml").write_text(scene, encoding="utf-8")
    here = {"folder": tmp_path, "environment": fresh.environment}
    lines = (shlex.split(line, comments=True) for line in printed.splitlines())
    checked, *ended = (run("-m", *line, **here).stdout for line in lines)
    assert "yarn_b.stretching\t0.156\tN" in checked
    assert re.search(r"mass per area \d+ g/m2", checked)
    stripes, cotton, laid = (
        float(re.search(r"course force over width at the end\t(\S+)", each)[1]) for each in ended
    )
    assert 0 < stripes < cotton
    assert laid == pytest.approx(1446, rel=0.01)


def test_site(tmp_path):
    """MkDocs builds the site of `make docs` without a warning. A broken section in a docstring causes a warning."""
    build = ("-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path))
    run(*build, folder=ROOT, environment=os.environ | {"NO_MKDOCS_2_WARNING": "1"})
    api = (tmp_path / "reference" / "api" / "index.html").read_text(encoding="utf-8")
    assert 'id="knitstudy.run.simulations.simulate"' in api
    assert (tmp_path / "search" / "search_index.json").stat().st_size > 100_000


def test_snakemake_commands(fresh):
    """The targets of all commands at once, and the other study."""
    (commands,) = blocks("docs/how-to/commands.md", "bash")
    lines = [line.split("#")[0].split() for line in commands.splitlines()]
    tried = [words[1:] for words in lines if words[0] == "snakemake"]
    (study,) = [words for words in tried if "--configfile" in words]
    tried.remove(study)
    assert len(tried) == 3
    together = dict.fromkeys(word for words in tried for word in words)
    for words in (together, study):
        ended = fresh.snakemake(*words, "--dry-run")
        assert ended.returncode == 0, (words, ended.stdout, ended.stderr)
