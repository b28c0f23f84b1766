# Files that `all` asks for from this part.
REPORT = ["results/report.html"]


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
