# Files that `all` asks for from this part.
REPORT = [f"{RESULTS}/report.html"]
PAGE = {
    "captions": workflow.source_path("../report/captions.yaml"),
    "template": workflow.source_path("../report/template.html"),
}
if workflow.is_main_process:
    noted = {
        f"{kind}/{name}": (freshness.FOLDER / kind / name).read_text()
        for kind, names in (("figures", DRAWN), ("tables", BUILT))
        for name in names
    }
    code = code_digest("knitstudy.report.page", "knitstudy.report.origin")
    page = digests_of(PAGE | {"data": data_of_study()}) | noted
    freshness.note("report", freshness.digest_of_files({"study": CONFIGURATION.study}, code, page))


rule report:
    input:
        # Pictures and tables count by what they show: digests of what they are made from.
        figures=[ancient(path) for path in FIGURES if path.endswith(".png")],
        # Linked from the page.
        documents=[ancient(path) for path in FIGURES if path.endswith(".pdf")],
        tables=[ancient(path) for path in TABLES],
        data=[ancient(f"{RESULTS}/{stage.path(scene)}") for stage, scene in data_of_study()],
        captions=ancient(PAGE["captions"]),
        template=ancient(PAGE["template"]),
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
    message:
        "Write the report"
    script:
        "../scripts/report.py"
