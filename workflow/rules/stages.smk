# Stages from a scene to its results, one rule each. `made` names the file of a stage that a rule takes, `outdated` the
# mark of a result of other inputs or other code (`Plan.mark_outdated`), which is newer than the result. A job whose result
# is up to date after all, since only times of files have changed, leaves the result as it is.


rule geometry:
    input:
        outdated=outdated("geometry"),
    output:
        update("results/geometry/{knit}.nc"),
    log:
        "logs/geometry/{knit}.log",
    threads: 1
    resources:
        mem_mb=memory("geometry"),
    params:
        labels=labels,
        reads=reads("geometry"),
    message:
        "Lay out {wildcards.knit}"
    script:
        "../scripts/stage.py"


rule mesh:
    input:
        geometry=made("mesh", "geometry"),
        outdated=outdated("mesh"),
    output:
        update("results/mesh/{scene}.nc"),
    log:
        "logs/mesh/{scene}.log",
    threads: 1
    resources:
        mem_mb=memory("mesh"),
    params:
        labels=labels,
        reads=reads("mesh"),
    message:
        "Mesh {wildcards.scene}"
    script:
        "../scripts/stage.py"


rule rest:
    input:
        geometry=made("rest", "geometry"),
        outdated=outdated("rest"),
    output:
        update("results/rest/{scene}.nc"),
    log:
        "logs/rest/{scene}.log",
    threads: 1
    resources:
        mem_mb=memory("rest"),
    params:
        labels=labels,
        reads=reads("rest"),
    message:
        "Relax {wildcards.scene}"
    script:
        "../scripts/stage.py"


rule simulation:
    input:
        geometry=made("simulation", "geometry"),
        mesh=made("simulation", "mesh"),
        contacts=made("simulation", "contacts"),
        springs=made("simulation", "springs"),
        stresses=made("simulation", "stresses"),
        rest=made("simulation", "rest"),
        outdated=outdated("simulation"),
    output:
        update("results/simulation/{scene}.nc"),
    log:
        "logs/simulation/{scene}.log",
    priority: 10
    threads: 1
    resources:
        mem_mb=memory("simulation"),
        runtime=runtime("simulation"),
    params:
        labels=labels,
        reads=reads("simulation"),
    message:
        "Simulate {wildcards.scene}"
    script:
        "../scripts/stage.py"


rule contacts:
    input:
        geometry=made("contacts", "geometry"),
        history=made("contacts", "history"),
        outdated=outdated("contacts"),
    output:
        update("results/contacts/{scene}.nc"),
    log:
        "logs/contacts/{scene}.log",
    threads: 1
    resources:
        mem_mb=memory("contacts"),
    params:
        labels=labels,
        reads=reads("contacts"),
    message:
        "Find the contacts of {wildcards.scene}"
    script:
        "../scripts/stage.py"


rule stress:
    input:
        geometry=made("stress", "geometry"),
        mesh=made("stress", "mesh"),
        history=made("stress", "history"),
        outdated=outdated("stress"),
    output:
        update("results/stress/{scene}.nc"),
    log:
        "logs/stress/{scene}.log",
    threads: 1
    resources:
        mem_mb=memory("stress"),
    params:
        labels=labels,
        reads=reads("stress"),
    message:
        "Average the stress of {wildcards.scene}"
    script:
        "../scripts/stage.py"


rule mesh_vtu:
    input:
        geometry=made("mesh_vtu", "geometry"),
        mesh=made("mesh_vtu", "mesh"),
    output:
        update("results/mesh/{scene}.vtu"),
    log:
        "logs/mesh_vtu/{scene}.log",
    threads: 1
    resources:
        mem_mb=memory("mesh_vtu"),
    params:
        labels=labels,
        reads=reads("mesh_vtu"),
        digest=digest("mesh_vtu"),
    message:
        "Write the mesh of {wildcards.scene} for ParaView"
    script:
        "../scripts/stage.py"


rule series:
    input:
        geometry=made("series", "geometry"),
        mesh=made("series", "mesh"),
        history=made("series", "history"),
    output:
        update("results/simulation/{scene}.pvd"),
    log:
        "logs/series/{scene}.log",
    threads: 1
    resources:
        mem_mb=memory("series"),
    params:
        labels=labels,
        reads=reads("series"),
        digest=digest("series"),
    message:
        "Write all increments of {wildcards.scene} for ParaView"
    script:
        "../scripts/stage.py"


rule deck_abaqus:
    input:
        geometry=made("deck_abaqus", "geometry"),
        mesh=made("deck_abaqus", "mesh"),
    output:
        update("results/mesh/{scene}.abaqus.inp"),
    log:
        "logs/deck_abaqus/{scene}.log",
    threads: 1
    resources:
        mem_mb=memory("deck_abaqus"),
    params:
        labels=labels,
        reads=reads("deck_abaqus"),
        digest=digest("deck_abaqus"),
    message:
        "Write the Abaqus deck of {wildcards.scene}"
    script:
        "../scripts/stage.py"


rule deck_calculix:
    input:
        geometry=made("deck_calculix", "geometry"),
        mesh=made("deck_calculix", "mesh"),
    output:
        update("results/mesh/{scene}.calculix.inp"),
    log:
        "logs/deck_calculix/{scene}.log",
    threads: 1
    resources:
        mem_mb=memory("deck_calculix"),
    params:
        labels=labels,
        reads=reads("deck_calculix"),
        digest=digest("deck_calculix"),
    message:
        "Write the CalculiX deck of {wildcards.scene}"
    script:
        "../scripts/stage.py"


rule shell_section:
    input:
        history=made("shell_section", "history"),
    output:
        update("results/simulation/{scene}.abaqus.inp"),
    log:
        "logs/shell_section/{scene}.log",
    threads: 1
    resources:
        mem_mb=memory("shell_section"),
    params:
        labels=labels,
        reads=reads("shell_section"),
        digest=digest("shell_section"),
    message:
        "Write the shell section of {wildcards.scene} for Abaqus"
    script:
        "../scripts/stage.py"
