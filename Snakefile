# `snakemake` in this folder and `snakemake --snakefile workflow/Snakefile` are the same.
include: "workflow/Snakefile"


# Snakemake takes no rule of an included file as the one that it makes when no target is named.
workflow.default_target = workflow.default_target or "all"
