rule contacts:
    message:
        "Find the contacts of {wildcards.scene}"
    input:
        knit=knit_of,
        history="results/dns/{scene}.nc",
        code=code("knitstudy.contacts"),
    output:
        "results/contacts/{scene}.nc",
    log:
        "logs/contacts/{scene}.log",
    benchmark:
        "logs/contacts/{scene}.benchmark.tsv"
    params:
        scene=parameters,
    wildcard_constraints:
        scene=names({"dns"}),
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/contacts.py"
