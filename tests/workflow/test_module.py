"""Another workflow imports this one, and takes the history of a scene of its own."""

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
- name: mine
  case: tie-course
  keys: {knit: mine, fidelity: rom3d, rom.contacts_from: null, pattern.loops: 1, pattern.rows: 1, solver.increments: 1}
"""


def test_a_workflow_imports_this_one(fresh, tmp_path):
    folder = tmp_path / "of others"
    folder.mkdir()
    (folder / "Snakefile").write_text(SNAKEFILE.format(snakefile=str(fresh.folder / "Snakefile")))
    (folder / "mine.yaml").write_text(SCENE)
    (folder / "force.py").write_text(SCRIPT)
    made = fresh.snakemake(
        "--directory", str(folder), "--snakefile", str(folder / "Snakefile"), "--cores", "1"
    )
    assert made.returncode == 0, made.stderr
    assert len((folder / "force.csv").read_text().splitlines()) == 3
    assert (folder / "results" / "simulation" / "mine.nc").is_file()
