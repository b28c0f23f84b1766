# What figures, tables and the report of a study are made from. Their modules are imported only by jobs that ask for them.
from functools import cache

REFERENCE = {
    "paper": "resources/reference/paper_tables.csv",
    "claims": "resources/reference/paper_claims.csv",
    "targets": f"{CONFIG}/calibration.yaml",
}


@cache
def catalogue(kind):
    """Return the catalogue of figures or of tables."""
    if kind == "figure":
        from knitstudy.figures.catalogue import FIGURES as found
    else:
        from knitstudy.tables.catalogue import TABLES as found
    return found


@cache
def possible_of(kind):
    """Return the files that each figure or table is made from by what they are, of those that the study can make."""
    from knitstudy.stages.displays import possible

    return possible(catalogue(kind), STUDY, REFERENCE, "results")


def paths_of(kind, *suffixes):
    """Return a function that lists the files of all figures or tables that the study can make."""
    return lambda wildcards: [
        f"results/{kind}s/{name}.{suffix}" for name in possible_of(kind) for suffix in suffixes
    ]


def sources_of(kind):
    """Return a function of the files that one is made from by what they are; it stops where it cannot be made."""

    def sources(wildcards):
        name = wildcards[kind]
        try:
            needs = [need for need in catalogue(kind).find(name).needs if need != "scenes"]
            if name not in possible_of(kind):
                raise ConfigurationError(
                    f"{kind} {name!r} needs {', '.join(needs)}: study {config['study']!r} lacks a scene for one of them"
                )
        except KnitstudyError as error:
            stop(error)
        return possible_of(kind)[name]

    return sources


def scenes_for(kind):
    """Return a function of the scenes of what one takes, where it asks for them: several of one role by their names."""

    def scenes(wildcards):
        from knitstudy.stages.displays import scenes_of

        found = scenes_of(catalogue(kind).find(wildcards[kind]), STUDY)
        return {role: scene.to_dict() for role, scene in found.items()}

    return scenes


def data_of_study():
    """Return every netCDF file of the study, in the order of its stages."""
    direct = [scene for scene in STUDY if scene.fidelity == "dns"]
    geometry = dict.fromkeys(f"results/geometry/{scene.knit}.nc" for scene in STUDY)
    details = [f"results/{stage}/{scene.name}.nc" for stage in ("mesh", "contacts") for scene in direct]
    return [*geometry, *details, *histories(STUDY)]
