# Files that `all` asks for from this part.
REPORT = ["results/report.html"]


def data_of_study():
    """Return every netCDF file of the study, in the order of its stages."""
    direct = [scene for scene in STUDY if scene.fidelity == "dns"]
    geometry = dict.fromkeys(f"results/geometry/{scene.knit}.nc" for scene in STUDY)
    details = [f"results/{stage}/{scene.name}.nc" for stage in ("mesh", "contacts") for scene in direct]
    return [*geometry, *details, *histories(STUDY)]


rule report:
    input:
        figures=[path for path in FIGURES if path.endswith(".png")],
        # Linked from the page.
        documents=[path for path in FIGURES if path.endswith(".pdf")],
        tables=TABLES,
        data=data_of_study(),
        captions=workflow.source_path("../report/captions.yaml"),
        template=workflow.source_path("../report/template.html"),
        code=code("knitstudy.report.page", "knitstudy.report.origin"),
    output:
        update("results/report.html"),
    log:
        "logs/report.log",
    threads: 1
    resources:
        mem_mb=500,
    params:
        study=config["study"],
    message:
        "Write the report"
    script:
        "../scripts/report.py"
