from knitstudy.figures.catalogue import FIGURES as FIGURE_ENTRIES
from knitstudy.report.selection import models_of


def sources(entry):
    """Return the files that a figure or table is made from by what they are; None where the study lacks one."""
    models = models_of(STUDY, entry.of)
    files = {fidelity: histories([scene])[0] for fidelity, scene in models.items()}
    files |= {
        "paper": "resources/reference/paper_tables.csv",
        "claims": "resources/reference/paper_claims.csv",
        "targets": f"{CONFIG}/calibration.yaml",
    }
    if "dns" in models:
        dns = models["dns"]
        files |= {
            "geometry": f"results/geometry/{dns.knit}.nc",
            "mesh": f"results/mesh/{dns.name}.nc",
            "contacts": f"results/contacts/{dns.name}.nc",
        }
    needs = [need for need in entry.needs if need != "scenes"]
    return {need: files[need] for need in needs} if set(needs) <= set(files) else None


DRAWN = {name: found for name, entry in FIGURE_ENTRIES.items() if (found := sources(entry)) is not None}

# Files that `all` asks for from this part.
FIGURES = expand("results/figures/{figure}.{suffix}", figure=DRAWN, suffix=("png", "pdf"))


rule figure:
    input:
        unpack(lambda wildcards: DRAWN[wildcards.figure]),
        code=lambda wildcards: code(f"knitstudy.figures.{wildcards.figure}", "knitstudy.figures.saving"),
    output:
        png=report(
            update("results/figures/{figure}.png"),
            caption="../report/item.rst",
            category="Figures",
            labels={"figure": "{figure}"},
        ),
        pdf=update("results/figures/{figure}.pdf"),
    log:
        "logs/figure/{figure}.log",
    wildcard_constraints:
        figure="|".join(DRAWN),
    threads: 1
    resources:
        mem_mb=1000,
    params:
        title=lambda wildcards: FIGURE_ENTRIES[wildcards.figure].title,
    message:
        "Draw {wildcards.figure}"
    script:
        "../scripts/figure.py"
