# One rule for every stage of `knitstudy.stages.table`.


def needs_of(stage):
    """Return the function that names what a job is made from."""

    def needs(wildcards):
        try:
            found = PLAN.needs(stage, scene_of(wildcards))
        except KnitstudyError as error:
            stop(error)
        return {name: f"{RESULTS}/{other.path(scene)}" for name, (other, scene) in found.items()}

    return needs


def labels_of(wildcards):
    """Return the name and the kind of a scene."""
    scene = scene_of(wildcards)
    names = ("name", "knit", "specimen", "fidelity", "interaction")
    return {name: getattr(scene, name) for name in names} | {"outputs": []}


def reads_of(stage):
    """Return the function that says what a job reads of its scene."""
    return lambda wildcards: stage.document(scene_of(wildcards))


def memory_of(stage):
    """Return the function of what a job may take of memory, at most what there is: what does not fit says so itself."""
    return lambda wildcards: min(stage.memory(scene_of(wildcards)), machine_memory())


for stage in STAGES.values():
    place = stage.path_pattern.removesuffix(Path(stage.path_pattern).suffix)

    rule:
        name:
            stage.name
        input:
            unpack(needs_of(stage)),
            digest=f"{freshness.FOLDER}/{stage.path_pattern}",
        output:
            update(f"{RESULTS}/{stage.path_pattern}"),
        log:
            f"logs/{stage.name}/{Path(place).name}.log",
        wildcard_constraints:
            scene=names(stage),
        priority: 10 * stage.long
        threads: 1
        resources:
            mem_mb=memory_of(stage),
        params:
            scene=labels_of,
            reads=reads_of(stage),
        message:
            f"{stage.name} {{wildcards}}"
        script:
            "../scripts/stage.py"
