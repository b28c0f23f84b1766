DIALECTS = ("abaqus", "calculix")


rule mesh:
    input:
        knit=knit_of,
        code=code("knitstudy.mesh.specimen"),
    output:
        update("results/mesh/{scene}.nc"),
    log:
        "logs/mesh/{scene}.log",
    benchmark:
        "logs/mesh/{scene}.benchmark.tsv"
    wildcard_constraints:
        scene=names({"dns"}),
    threads: 1
    resources:
        mem_mb=1000,
    params:
        scene=parameters,
    message:
        "Mesh the yarns of {wildcards.scene}"
    script:
        "../scripts/mesh.py"


rule mesh_vtu:
    input:
        mesh="results/mesh/{scene}.nc",
        code=code("knitstudy.exchange.vtu"),
    output:
        update("results/mesh/{scene}.vtu"),
    log:
        "logs/mesh_vtu/{scene}.log",
    threads: 1
    resources:
        mem_mb=1000,
    message:
        "Write the mesh of {wildcards.scene} for ParaView"
    script:
        "../scripts/mesh_vtu.py"


rule deck:
    input:
        knit=knit_of,
        mesh="results/mesh/{scene}.nc",
        code=code(
            "knitstudy.solids.tie",
            "knitstudy.geometry.specimen",
            "knitstudy.exchange.deck",
            "knitstudy.exchange.inp",
        ),
    output:
        update("results/mesh/{scene}.{dialect}.inp"),
    log:
        "logs/deck/{scene}.{dialect}.log",
    wildcard_constraints:
        dialect="|".join(DIALECTS),
    threads: 1
    resources:
        mem_mb=1000,
    params:
        scene=parameters,
    message:
        "Write the {wildcards.dialect} deck of {wildcards.scene}"
    script:
        "../scripts/deck.py"
