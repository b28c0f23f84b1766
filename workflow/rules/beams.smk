rule beams:
    input:
        knit=knit_of,
        code=code("knitstudy.networks.beams.run"),
    output:
        update("results/beams/{scene}.nc"),
    log:
        "logs/beams/{scene}.log",
    benchmark:
        "logs/beams/{scene}.benchmark.tsv"
    wildcard_constraints:
        scene=names({"beam"}),
    threads: 1
    resources:
        mem_mb=1000,
    params:
        scene=parameters,
        restart="run/beams",
    message:
        "Pull the beams in contact of {wildcards.scene}"
    script:
        "../scripts/beams.py"
