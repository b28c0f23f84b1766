rule rom:
    message:
        "Pull the reduced model {wildcards.scene}"
    input:
        knit=knit_of,
        contacts=contacts_of,
        code=code("knitstudy.rom.run"),
    output:
        "results/rom/{scene}.nc",
    log:
        "logs/rom/{scene}.log",
    benchmark:
        "logs/rom/{scene}.benchmark.tsv"
    params:
        scene=parameters,
    wildcard_constraints:
        scene=names({"rom2d", "rom3d"}),
    threads: 1
    resources:
        mem_mb=500,
    script:
        "../scripts/rom.py"
