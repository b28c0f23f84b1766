BUILT = possible(TABLE_ENTRIES)

# Files that `all` asks for from this part.
TABLES = expand("results/tables/{table}.csv", table=BUILT)


rule table:
    input:
        unpack(lambda wildcards: BUILT[wildcards.table]),
        code=lambda wildcards: code(table_module(wildcards.table)),
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
        table="|".join(BUILT),
    threads: 1
    resources:
        mem_mb=500,
    params:
        title=lambda wildcards: TABLE_ENTRIES[wildcards.table].title,
        scenes=lambda wildcards: scenes_for(TABLE_ENTRIES[wildcards.table]),
    message:
        "Build the table {wildcards.table}"
    script:
        "../scripts/table.py"
