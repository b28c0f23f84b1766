# Files that `all` asks for from this part.
REPORT = [f"{RESULTS}/report.html"]
PAGE = {
    "captions": workflow.source_path("../report/captions.yaml"),
    "template": workflow.source_path("../report/template.html"),
    "kept": "resources/verdicts.csv",
}
if workflow.is_main_process:
    from knitstudy.stages.code import code_digest
    from knitstudy.stages.displays import digests_of

    code = code_digest("knitstudy.report.page", "knitstudy.report.page")
    page = {name: Path(path) for name, path in PAGE.items()} | {"data": data_of_study()}
    needed = digests_of(page, PLAN) | digests_of_displays() | {"notes": " ".join(notes())}
    freshness.note("report", freshness.digest_of_files({"study": CONFIGURATION.study}, code, needed))


rule report:
    input:
        figures=paths_of("figure", "png"),
        # Linked from the page.
        documents=paths_of("figure", "pdf"),
        tables=TABLES,
        data=[f"{RESULTS}/{stage.path(scene)}" for stage, scene in data_of_study()],
        captions=ancient(PAGE["captions"]),
        template=ancient(PAGE["template"]),
        kept=ancient(PAGE["kept"]),
        digest=f"{freshness.FOLDER}/report",
    output:
        update(f"{RESULTS}/report.html"),
    log:
        "logs/report.log",
    threads: 1
    resources:
        mem_mb=500,
    params:
        study=config["study"],
        notes=lambda wildcards: notes(),
    message:
        "Write the report"
    script:
        "../scripts/report.py"
