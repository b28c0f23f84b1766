# Files that `all` asks for from this part.
REPORT = ["results/report.html"]


rule report:
    input:
        figures=paths_of("figure", "png"),
        # Linked from the page.
        documents=paths_of("figure", "pdf"),
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
