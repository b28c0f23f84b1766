# Files that `all` asks for from this part.
TABLES = paths_of("table", "csv")


rule table:
    input:
        changed(digest_of("table"), "results/tables/{table}.csv"),
        unpack(sources_of("table")),
    output:
        report(
            update("results/tables/{table}.csv"),
            caption="../report/item.rst",
            category="Tables",
            labels={"table": "{table}"},
        ),
    log:
        "logs/table/{table}.log",
    wildcard_constraints:
        table="[^/]+",
    conda:
        "../envs/knitstudy.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        digest=digest_of("table"),
        title=title_of("table"),
        scenes=scenes_of("table"),
    message:
        "Build the table {wildcards.table}"
    script:
        "../scripts/table.py"
