from knitstudy.tables.catalogue import TABLES as TABLE_ENTRIES

BUILT = {name: found for name, entry in TABLE_ENTRIES.items() if (found := sources(entry)) is not None}

# Files that `all` asks for from this part.
TABLES = expand("results/tables/{table}.csv", table=BUILT)


def scenes_of_table(wildcards):
    """Return the scenes that a table is about by fidelity, where it asks for them."""
    entry = TABLE_ENTRIES[wildcards.table]
    if "scenes" not in entry.needs:
        return {}
    return {fidelity: scene.to_dict() for fidelity, scene in models_of(STUDY, entry.of).items()}


rule table:
    input:
        unpack(lambda wildcards: BUILT[wildcards.table]),
        code=lambda wildcards: code(f"knitstudy.tables.{wildcards.table}"),
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
        scenes=scenes_of_table,
    message:
        "Build the table {wildcards.table}"
    script:
        "../scripts/table.py"
