# What figures, tables and the report of a study are made from. Their modules are imported only where one is asked for.


@cache
def displays(kind):
    """Return the figures or the tables of the study."""
    from knitstudy.run.displays import Displays, reference_files

    if kind == "figure":
        from knitstudy.run.catalogue import FIGURES as catalogue
    else:
        from knitstudy.run.catalogue import TABLES as catalogue
    return Displays(catalogue, PLAN, STUDY, reference_files(CONFIG), f"study {CONFIGURATION.study!r}")


def paths_of(kind, *suffixes):
    """Return the function that lists the files of all figures or tables that the study can make."""
    return lambda wildcards: [
        f"{RESULTS}/{kind}s/{name}.{suffix}" for name in displays(kind).names() for suffix in suffixes
    ]


def sources_of(kind):
    """Return the function of the files that one is made from by what they are; it stops where it cannot be made."""

    def sources(wildcards):
        try:
            found = displays(kind).files(wildcards[kind], RESULTS)
        except KnitstudyError as error:
            stop(error)
        return found

    return sources


def scenes_of(kind):
    """Return the function of the scenes of what one takes, where it asks for them."""
    return lambda wildcards: {
        role: scene.to_dict() for role, scene in displays(kind).scenes(wildcards[kind]).items()
    }


def title_of(kind):
    """Return the function of the title of one."""
    return lambda wildcards: displays(kind).catalogue.find(wildcards[kind]).title


def digest_of(kind):
    """Return the function of the digest of one."""
    return lambda wildcards: displays(kind).digest(wildcards[kind])


def digest_of_report(wildcards):
    """Return the digest of the report: of its code, its page, all figures and tables, and all data of the study."""
    from knitstudy.run.code import code_digest
    from knitstudy.run.displays import digests_of

    files = {name: Path(path) for name, path in PAGE.items()} | {path: Path(path) for path in FULL}
    files |= {"data": data_of_study()}
    shown = [displays(kind).digest(name) for kind in ("figure", "table") for name in displays(kind).names()]
    code = code_digest("paper/report.py", "use/deformed.py", "use/viewer.html")
    return [code, digests_of(files, PLAN), shown]


@cache
def notes():
    """Return what the report says of a reference and of verdicts that were kept by other code than today's."""
    from knitstudy.run.code import physics_digest
    from knitstudy.paper.report import REFERENCE, age_warning, verdicts_warning

    try:
        warnings = [verdicts_warning(PLAN, CONFIG)]
        if load_study("reference", CONFIG):
            what = "Values of the reference"
            warnings.append(age_warning(REFERENCE, "physics", physics_digest(), what, "reference"))
    except KnitstudyError as error:
        stop(error)
    left_out = [f"{name} is left out of figures, tables and verdicts: {why}" for name, why in ENDED.items()]
    return [*left_out, *(each for each in warnings if each)]


def data_of_study():
    """Return every dataset of the study, in the order of its stages."""
    return [(stage, scene) for stage, scene in PLAN.steps(STUDY) if stage.is_dataset]
