rule dns:
    input:
        knit=knit_of,
        mesh="results/mesh/{scene}.nc",
        code=code("knitstudy.solids.dns", "knitstudy.geometry.specimen"),
    output:
        update("results/dns/{scene}.nc"),
    log:
        "logs/dns/{scene}.log",
    benchmark:
        "logs/dns/{scene}.benchmark.tsv"
    wildcard_constraints:
        scene=names({"dns"}),
    # On the longest path: before whatever else is ready.
    priority: 10
    # Two simulations side by side, of one thread each, take as long as one of two threads.
    threads: 1
    resources:
        mem_mb=4000,
    params:
        scene=parameters,
        restart="run/dns",
    message:
        "Load {wildcards.scene}"
    script:
        "../scripts/dns.py"


rule dns_vtu:
    input:
        knit=knit_of,
        mesh="results/mesh/{scene}.nc",
        history=history_with_fields,
        code=code(
            "knitstudy.solids.tie",
            "knitstudy.crossings.tied_crossings",
            "knitstudy.geometry.specimen",
            "knitstudy.exchange.vtu",
        ),
    output:
        update("results/dns/{scene}.vtu"),
    log:
        "logs/dns_vtu/{scene}.log",
    wildcard_constraints:
        scene=names({"dns"}),
    threads: 1
    resources:
        mem_mb=1000,
    params:
        scene=parameters,
    message:
        "Write the deformed yarns of {wildcards.scene} for ParaView"
    script:
        "../scripts/dns_vtu.py"
