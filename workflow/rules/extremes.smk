# The campaign of extremes (config/extremes.yaml): one job a trial, which leaves a row however the trial ends.
# Nothing of it belongs to a study; `make extremes` asks for the table.


rule trial:
    output:
        update("results/extremes/{trial}.json"),
    log:
        "logs/trial/{trial}.log",
    wildcard_constraints:
        trial="[a-z0-9-]+",
    threads: 1
    resources:
        mem_mb=memory("trial", lambda wildcards: 1000),
        runtime=runtime("trial", lambda wildcards: trials()[wildcards.trial].limit),
    params:
        digest=lambda wildcards: trials()[wildcards.trial].digest(),
        config=str(CONFIG),
    message:
        "Try {wildcards.trial}"
    script:
        "../scripts/trial.py"


rule extremes:
    input:
        lambda wildcards: [f"{RESULTS}/extremes/{label}.json" for label in trials()],
    output:
        update("results/extremes/extremes.csv"),
    log:
        "logs/extremes.log",
    threads: 1
    resources:
        mem_mb=500,
    message:
        "Collect the trials"
    script:
        "../scripts/extremes.py"
