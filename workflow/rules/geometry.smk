rule geometry:
    input:
        code=code("knitstudy.geometry.build"),
    output:
        update("results/geometry/{knit}.nc"),
    log:
        "logs/geometry/{knit}.log",
    benchmark:
        "logs/geometry/{knit}.benchmark.tsv"
    threads: 1
    resources:
        mem_mb=500,
    params:
        scene=lambda wildcards: KNITS[wildcards.knit].to_dict(),
    message:
        "Lay out {wildcards.knit}"
    script:
        "../scripts/geometry.py"
