include: "sources.smk"


DRAWN = possible(FIGURE_ENTRIES)

# Files that `all` asks for from this part.
FIGURES = expand("results/figures/{figure}.{suffix}", figure=DRAWN, suffix=("png", "pdf"))


rule figure:
    input:
        unpack(needs_of_figure),
        code=lambda wildcards: code(figure_module(wildcards.figure), "knitstudy.figures.saving"),
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
