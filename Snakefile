# The study: scene -> geometry -> mesh -> simulation -> contacts -> figures, tables, report.
# `snakemake` alone makes the study that config/config.yaml names; any file under results/ is a target as well.
import gc

from snakemake.utils import min_version

min_version("9.0")
gc.disable()  # a plan is many objects that all live: looking for garbage takes a quarter of its time


configfile: workflow.source_path("config/config.yaml")


include: "workflow/rules/common.smk"
include: "workflow/rules/stages.smk"
include: "workflow/rules/displays.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/tables.smk"
include: "workflow/rules/report.smk"


# Seconds each: run by Snakemake itself where other jobs wait in a queue, since a start costs a minute there.
localrules:
    all,
    campaign,
    geometry,
    mesh,
    contacts,
    stress,
    mesh_vtu,
    series,
    deck_abaqus,
    deck_calculix,
    shell_section,
    figure,
    table,
    report,


onstart:
    gc.enable()
    # With a limit of jobs a second, and there is one unless it is taken away, every look for jobs that are ready asks for
    # another one a second later, beside those at every end of a job: looks add up until they fill a core. An array of
    # jobs needs all that are ready at once.
    workflow.scheduler.job_rate_limiter = None
    gather_arrays()
    # workflow/study.py counts the jobs that are done beside it.
    print(f"planned {len(list(workflow.dag.needrun_jobs()))} jobs", file=sys.stderr, flush=True)


rule all:
    default_target: True
    input:
        wanted(STUDY),
        FIGURES,
        TABLES,
        REPORT,
    message:
        "Study {config[study]}: complete"


rule campaign:
    input:
        lambda wildcards: wanted([PLAN.scenes[name] for name in own_scenes(CONFIG)]),
    message:
        "All scenes of {config[folder]}: complete"
