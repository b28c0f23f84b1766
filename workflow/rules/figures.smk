include: "sources.smk"


DRAWN = possible(FIGURE_ENTRIES)
if workflow.is_main_process:
    note_entries("figures", FIGURE_ENTRIES, DRAWN, figure_module, "knitstudy.figures.saving")


def needs_of_figure(wildcards):
    """Return the files that a figure is drawn from by what they are; stop where it cannot be drawn."""
    name = wildcards.figure
    try:
        needs = [need for need in figure_entry(name).needs if need != "scenes"]
        if name not in DRAWN:
            raise ConfigurationError(
                f"figure {name!r} needs {', '.join(needs)}: study {config['study']!r} lacks a scene for one of them"
            )
    except KnitstudyError as error:
        stop(error)
    return files_of(DRAWN[name])


# Files that `all` asks for from this part.
FIGURES = expand("results/figures/{figure}.{suffix}", figure=DRAWN, suffix=("png", "pdf"))


rule figure:
    input:
        unpack(needs_of_figure),
        digest=f"{freshness.FOLDER}/figures/{{figure}}",
    output:
        png=report(
            update("results/figures/{figure}.png"),
            caption="../report/item.rst",
            category="Figures",
            labels={"figure": "{figure}"},
        ),
        pdf=update("results/figures/{figure}.pdf"),
    log:
        "logs/figure/{figure}.log",
    wildcard_constraints:
        figure="[^/]+",
    threads: 1
    resources:
        mem_mb=1000,
    params:
        title=lambda wildcards: FIGURE_ENTRIES[wildcards.figure].title,
        scenes=lambda wildcards: scenes_for(FIGURE_ENTRIES[wildcards.figure]),
    message:
        "Draw {wildcards.figure}"
    script:
        "../scripts/figure.py"
