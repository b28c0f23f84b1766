# Files that `all` asks for from this part.
REPORT = [f"{RESULTS}/report.html"]
PAGE = {
    "captions": workflow.source_path("../report/captions.yaml"),
    "template": workflow.source_path("../report/template.html"),
    "kept": os.path.relpath(RESOURCES / "verdicts.csv"),
}
# Tables and pictures of the full study, which the page of a smaller study shows in place of its own.
FULL = sorted(os.path.relpath(path) for path in (RESOURCES / "full").iterdir())


rule report:
    input:
        changed(lambda wildcards: digest_of_report(), *REPORT),
        figures=paths_of("figure", "png"),
        # Linked from the page.
        documents=paths_of("figure", "pdf"),
        tables=TABLES,
        data=lambda wildcards: list(map(source, data_of_study())),
        captions=ancient(PAGE["captions"]),
        template=ancient(PAGE["template"]),
        kept=ancient(PAGE["kept"]),
        full=ancient(FULL),
    output:
        update(f"{RESULTS}/report.html"),
    log:
        "logs/report.log",
    conda:
        "../envs/knitstudy.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        study=CONFIGURATION.study,
        notes=lambda wildcards: notes(),
        digest=lambda wildcards: digest_of_report(),
    message:
        "Write the report"
    script:
        "../scripts/report.py"
