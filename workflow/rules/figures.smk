# Files that `all` asks for from this part.
FIGURES = paths_of("figure", "png", "pdf")


rule figure:
    input:
        changed(digest_of("figure"), "results/figures/{figure}.png", "results/figures/{figure}.pdf"),
        unpack(sources_of("figure")),
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
    conda:
        "../envs/knitstudy.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        digest=digest_of("figure"),
        title=title_of("figure"),
        scenes=scenes_of("figure"),
    message:
        "Draw {wildcards.figure}"
    script:
        "../scripts/figure.py"
