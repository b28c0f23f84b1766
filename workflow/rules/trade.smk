# What accuracy costs (config/trade.yaml): a table of sampled knits, one job a knit, case and rung, which leaves a record
# however its run ends, and the table of errors and prices. Nothing of it belongs to a study; `make trade` asks for it.


rule knits:
    output:
        update("results/trade/knits.csv"),
    log:
        "logs/knits.log",
    threads: 1
    resources:
        mem_mb=1000,
    params:
        sample=lambda wildcards: load_trade().model_dump(mode="json", include={"knits", "seed", "box"}),
    message:
        "Draw knits"
    script:
        "../scripts/trade.py"


rule rung:
    input:
        "results/trade/knits.csv",
    output:
        update("results/trade/{knit_of_sample}-{case}-{rung}.json"),
    log:
        "logs/rung/{knit_of_sample}-{case}-{rung}.log",
    wildcard_constraints:
        knit_of_sample=r"knit\d+",
        case="(cut-knit|cell)-(tied|touching)",
        rung="[a-z0-9-]+",
    threads: 1
    resources:
        mem_mb=memory("rung", lambda wildcards: 4000 if wildcards.rung in ("yarns3", "yarns4") else 1500),
        runtime=runtime("rung", lambda wildcards: load_trade().limit),
    params:
        digest=lambda wildcards: rung_digest(wildcards.case, wildcards.rung),
    message:
        "Measure {wildcards.rung} on {wildcards.knit_of_sample}, {wildcards.case}"
    script:
        "../scripts/trade.py"


rule trade:
    input:
        knits="results/trade/knits.csv",
        records=lambda wildcards: records_of_trade(),
    output:
        update("results/trade/trade.csv"),
    log:
        "logs/trade.log",
    threads: 1
    resources:
        mem_mb=1000,
    message:
        "Collect errors and prices"
    script:
        "../scripts/trade.py"
