"""Another workflow imports this one, and takes the history of a scene of its own."""

import shutil
import subprocess

SNAKEFILE = """\
rule all:
    input: "force.csv"

module knit:
    snakefile: {snakefile!r}
    config: {{"folder": "mine.yaml"}}

use rule * from knit as knit_*

rule force:
    input: "results/simulation/mine.nc"
    output: "force.csv"
    script: "force.py"
"""

SCRIPT = """\
import xarray as xr

xr.open_dataset(snakemake.input[0])["force"].to_series().to_csv(snakemake.output[0])
"""

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
    (folder / "Snakefile").write_text(SNAKEFILE.format(snakefile=str(checkout.folder / "Snakefile")))
    (folder / "mine.yaml").write_text(SCENE)
    (folder / "force.py").write_text(SCRIPT)
    # In a folder of its own: the profile of the checkout is of its own workflow, which cancels the timers that it sets.
    command = [checkout.python, "-m", "snakemake", "--cores", "1"]
    made = subprocess.run(command, cwd=folder, env=checkout.environment, capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    assert len((folder / "force.csv").read_text().splitlines()) == 3
    assert (folder / "results" / "simulation" / "mine.nc").is_file()
    assert "Lay out" not in made.stderr
