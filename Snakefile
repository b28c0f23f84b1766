# The study: scene -> geometry -> mesh -> simulation -> contacts -> figures, tables, report.
# `snakemake` alone makes the study that config/config.yaml names; any file under results/ is a target as well.
from snakemake.utils import min_version

min_version("9.11.7")


configfile: workflow.source_path("config/config.yaml")


include: "workflow/rules/common.smk"


# The first rule is what `snakemake` alone makes; a workflow that imports this one has a first rule of its own.
rule all:
    input:
        wanted(STUDY),
        lambda wildcards: FIGURES(wildcards),
        lambda wildcards: TABLES(wildcards),
        lambda wildcards: REPORT,
    message:
        f"Study {CONFIGURATION.study}: complete"


include: "workflow/rules/stages.smk"


# Figures, tables and the report belong to a wing of the package, which may have been removed.
FIGURES = TABLES = lambda wildcards: []
REPORT = []
if any(package.report for package in optional_packages()):

    include: "workflow/rules/displays.smk"
    include: "workflow/rules/figures.smk"
    include: "workflow/rules/tables.smk"
    include: "workflow/rules/report.smk"


# Seconds each: Snakemake runs them itself where other jobs wait in a queue, since a start costs a minute there.
localrules:
    all,
    campaign,
    figure,
    table,
    report,


onstart:
    expect_jobs()
    end_jobs_at_term()


onsuccess:
    cancel_timers()


onerror:
    cancel_timers()


rule campaign:
    input:
        lambda wildcards: wanted(campaign()),
    message:
        f"All scenes of {CONFIGURATION.folder}: complete"
