rule dns:
    message:
        "Pull {wildcards.scene}"
    input:
        knit=knit_of,
        mesh="results/mesh/{scene}.nc",
        code=code("knitstudy.dns"),
    output:
        "results/dns/{scene}.nc",
    log:
        "logs/dns/{scene}.log",
    benchmark:
        "logs/dns/{scene}.benchmark.tsv"
    params:
        scene=parameters,
        restart="run/dns",
    wildcard_constraints:
        scene=names({"dns"}),
    threads: 2
    resources:
        mem_mb=4000,
    script:
        "../scripts/dns.py"
