BUILT = possible(TABLE_ENTRIES)
if workflow.is_main_process:
    note_entries("tables", TABLE_ENTRIES, BUILT, table_module)

# Files that `all` asks for from this part.
TABLES = expand("results/tables/{table}.csv", table=BUILT)


rule table:
    input:
        unpack(lambda wildcards: files_of(BUILT[wildcards.table])),
        digest=f"{freshness.FOLDER}/tables/{{table}}",
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
