rule contacts:
    input:
        knit=knit_of,
        history="results/dns/{scene}.nc",
        code=code("knitstudy.crossings.contacts", "knitstudy.geometry.specimen"),
    output:
        update("results/contacts/{scene}.nc"),
    log:
        "logs/contacts/{scene}.log",
    benchmark:
        "logs/contacts/{scene}.benchmark.tsv"
    wildcard_constraints:
        scene=names({"dns"}),
    threads: 1
    resources:
        mem_mb=1000,
    params:
        scene=parameters,
    message:
        "Find the contacts of {wildcards.scene}"
    script:
        "../scripts/contacts.py"
