# One rule for every stage from a scene to its results (knitstudy.run.stages). The param `digest` is that of all that
# the result depends on: keys of the scene, code, and what the stage takes.
for stage in STAGES.values():

    rule:
        name:
            stage.name
        input:
            changed(digest_of_step(stage.name), f"{RESULTS}/{stage.path_pattern}"),
            unpack(needs_of(stage.name)),
        output:
            update(f"{RESULTS}/{stage.path_pattern}"),
        log:
            f"logs/{stage.name}/{stage.label}.log",
        priority: 10 if stage.restarts else 0
        localrule: not stage.queued
        conda:
            "../envs/knitstudy.yaml"
        threads: 1
        resources:
            mem_mb=memory(stage.name),
            runtime=runtime(stage.name),
        params:
            stage=stage.name,
            digest=digest_of_step(stage.name),
        message:
            stage.message
        script:
            "../scripts/stage.py"
