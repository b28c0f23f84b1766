# What figures, tables and the report of a study are made from. Their modules are imported only where one is asked for.


@cache
def displays(kind):
    """Return the figures or the tables of the study."""
    from knitstudy.run.catalogue import Displays, reference_files

    if kind == "figure":
        from knitstudy.run.catalogue import FIGURES as catalogue
    else:
        from knitstudy.run.catalogue import TABLES as catalogue
    return Displays(catalogue, PLAN, STUDY, reference_files(CONFIG), f"study {CONFIGURATION.study!r}")


def paths_of(kind, *suffixes):
    """Return the function that lists the files of all figures or tables that the study can make."""

    def path(name, suffix):
        path = f"{RESULTS}/{kind}s/{name}.{suffix}"
        return ancient(path) if recorded(path) == displays(kind).digest(name) else path

    return lambda wildcards: [path(name, suffix) for name in displays(kind).names() for suffix in suffixes]


def sources_of(kind):
    """Return the function of the files that one is made from by what they are; it stops where it cannot be made."""

    @stopping
    def sources(wildcards):
        return {
            role: list(map(source, what)) if isinstance(what, list) else source(what)
            for role, what in displays(kind).sources_of(wildcards[kind]).items()
        }

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
    """Return the function of the digest of one; it stops where it cannot be made."""
    return stopping(lambda wildcards: displays(kind).digest(wildcards[kind]))


def data_of_study():
    """Return every dataset of the study, in the order of its stages."""
    return [step for step in PLAN.steps(STUDY) if step.stage.is_dataset]


@cache
def digest_of_report():
    """Return the digest of the report: of its code, its page, all figures and tables, and all data of the study."""
    from knitstudy.run.catalogue import digests_of
    from knitstudy.knit.scene.scene import digest
    from knitstudy.run.code_digest import code_digest

    files = {name: Path(path) for name, path in PAGE.items()} | {path: Path(path) for path in FULL}
    shown = [displays(kind).digest(name) for kind in ("figure", "table") for name in displays(kind).names()]
    code = code_digest("paper/report.py", "use/deformed.py", "use/viewer.html")
    return digest([code, digests_of(files | {"data": data_of_study()}), shown, notes(), CONFIGURATION.study])


@cache
@stopping
def notes():
    """Return what the report says of scenes that are left out, and of committed tables whose scenes or rules have changed since."""
    from knitstudy.run.catalogue import reference_files
    from knitstudy.paper.report import age_warnings

    warnings = age_warnings(PLAN.scenes, CONFIG, reference_files(CONFIG)["claims"])
    left_out = [f"{name} is left out of figures, tables and verdicts: {why}" for name, why in ENDED.items()]
    return left_out + warnings
