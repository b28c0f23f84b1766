rule geometry:
    message:
        "Optimise the loop of {wildcards.knit}"
    input:
        code=code("knitstudy.geometry.build"),
    output:
        "results/geometry/{knit}.nc",
    log:
        "logs/geometry/{knit}.log",
    benchmark:
        "logs/geometry/{knit}.benchmark.tsv"
    params:
        scene=lambda wildcards: KNITS[wildcards.knit].to_dict(),
    threads: 1
    resources:
        mem_mb=500,
    script:
        "../scripts/geometry.py"
