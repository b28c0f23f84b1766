DIALECTS = ("abaqus", "calculix")


rule mesh:
    message:
        "Mesh the yarns of {wildcards.scene}"
    input:
        knit=knit_of,
        code=code("knitstudy.mesh.knit"),
    output:
        "results/mesh/{scene}.nc",
    log:
        "logs/mesh/{scene}.log",
    benchmark:
        "logs/mesh/{scene}.benchmark.tsv"
    params:
        scene=parameters,
    wildcard_constraints:
        scene=names({"dns"}),
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/mesh.py"


rule mesh_vtu:
    message:
        "Write the mesh of {wildcards.scene} for ParaView"
    input:
        mesh="results/mesh/{scene}.nc",
        code=code("knitstudy.mesh.export"),
    output:
        "results/mesh/{scene}.vtu",
    log:
        "logs/mesh_vtu/{scene}.log",
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/mesh_vtu.py"


rule deck:
    message:
        "Write the {wildcards.dialect} deck of {wildcards.scene}"
    input:
        knit=knit_of,
        mesh="results/mesh/{scene}.nc",
        code=code("knitstudy.contact.tie", "knitstudy.mesh.deck", "knitstudy.mesh.inp"),
    output:
        "results/mesh/{scene}.{dialect}.inp",
    log:
        "logs/deck/{scene}.{dialect}.log",
    params:
        scene=parameters,
    wildcard_constraints:
        dialect="|".join(DIALECTS),
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/deck.py"
