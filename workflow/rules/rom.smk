rule rom:
    input:
        unpack(contacts_of),
        knit=knit_of,
        code=code("knitstudy.networks.rom.run"),
    output:
        update("results/rom/{scene}.nc"),
    log:
        "logs/rom/{scene}.log",
    benchmark:
        "logs/rom/{scene}.benchmark.tsv"
    wildcard_constraints:
        scene=names({"rom2d", "rom3d"}),
    threads: 1
    resources:
        mem_mb=500,
    params:
        scene=parameters,
        restart="run/rom",
    message:
        "Pull the reduced model {wildcards.scene}"
    script:
        "../scripts/rom.py"
