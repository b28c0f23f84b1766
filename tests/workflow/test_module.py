"""Another workflow imports this one, as its page says, and takes the histories of scenes of its own."""

import re
import shutil
import subprocess
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "snakemake.md"

SCENE = """\
studies: []
scenes:
- {name: mine, case: tie-course, keys: {knit: plain3x3, fidelity: rom2d, rom.contacts_from: null, solver.increments: 1}}
"""


def test_a_workflow_imports_this_one(checkout, tmp_path):
    """It takes a knit that lies there as it is: the digest of the study's is the one that it would make."""
    folder = tmp_path / "of others"
    knit = folder / "results" / "geometry" / "plain3x3.nc"
    knit.parent.mkdir(parents=True)
    shutil.copy2(checkout.folder / knit.relative_to(folder), knit)
    page = PAGE.read_text(encoding="utf-8")
    (study,), (rules,) = (re.findall(rf"```{each}\n(.*?)```", page, re.DOTALL) for each in ("yaml", "python"))
    there = {
        "/path/to/checkout/workflow/Snakefile": str(checkout.folder / "workflow" / "Snakefile"),
        "study.yaml": "scenes",
    }
    for printed, actual in there.items():
        assert rules.count(printed) == 1
        rules = rules.replace(printed, actual)
    (folder / "Snakefile").write_text(rules)
    (folder / "scenes").mkdir()
    (folder / "scenes" / "study.yaml").write_text(study)
    (folder / "scenes" / "mine.yaml").write_text(SCENE)
    # In a folder of its own: the profile of the checkout is of its own workflow, which cancels the timers that it sets.
    command = [checkout.python, "-m", "snakemake", "--cores", "1", "all", "results/simulation/mine.nc"]
    made = subprocess.run(command, cwd=folder, env=checkout.environment, capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    forces = [float(line.split(",")[1]) for line in (folder / "forces.csv").read_text().splitlines()]
    assert 0 < forces[0] < forces[1], "friction makes a knit stiffer"
    assert (folder / "results" / "simulation" / "mine.nc").is_file()
    assert made.stderr.count("Lay out") == 1, "of the jersey alone"
