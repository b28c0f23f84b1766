# What figures, tables and the report of a study are made from.
from knitstudy.errors import ConfigurationError
from knitstudy.figures.catalogue import FIGURES as FIGURE_ENTRIES
from knitstudy.figures.catalogue import entry as figure_entry
from knitstudy.figures.catalogue import module as figure_module
from knitstudy.measures.selection import roles_of
from knitstudy.tables.catalogue import TABLES as TABLE_ENTRIES
from knitstudy.tables.catalogue import module as table_module

REFERENCE = {
    "paper": "resources/reference/paper_tables.csv",
    "claims": "resources/reference/paper_claims.csv",
    "targets": f"{CONFIG}/calibration.yaml",
}


def results_of(roles):
    """Return the results of scenes by what figures call them; those of several scenes are lists."""
    files = {}
    for role, found in roles.items():
        scenes = found if isinstance(found, list) else [found]
        direct = [scene for scene in scenes if scene.fidelity == "dns"]
        paths = {role: histories(scenes)}
        if direct:
            prefix = "" if role == "dns" else f"{role}_"
            paths[f"{prefix}contacts"] = [f"results/contacts/{scene.name}.nc" for scene in direct]
            paths[f"{prefix}geometry"] = [f"results/geometry/{scene.knit}.nc" for scene in direct]
            paths[f"{prefix}mesh"] = [f"results/mesh/{scene.name}.nc" for scene in direct]
        files |= paths if isinstance(found, list) else {name: path[0] for name, path in paths.items()}
    return files


def possible(entries):
    """Return the files that each figure or table needs by what they are, of those that the study can make."""
    found = {}
    for name, entry in entries.items():
        files = results_of(roles_of(STUDY, entry.of)) | REFERENCE
        if set(entry.needs) <= {*files, "scenes"}:
            found[name] = {need: files[need] for need in (*entry.needs, *entry.may) if need in files}
    return found


def needs_of_figure(wildcards):
    """Return the files that a figure is drawn from by what they are; stop where it cannot be drawn."""
    name = wildcards.figure
    try:
        needs = [need for need in figure_entry(name).needs if need != "scenes"]
        if name not in DRAWN:
            raise ConfigurationError(
                f"figure {name!r} needs {', '.join(needs)}: study {config['study']!r} lacks a scene for one of them"
            )
    except KnitstudyError as error:
        stop(error)
    return DRAWN[name]


def scenes_for(entry):
    """Return the scenes of what a figure or table takes, where it asks for them: several of one role by their names."""
    asked = {*entry.needs, *entry.may}
    if "scenes" not in asked:
        return {}
    scenes = {}
    for role, found in roles_of(STUDY, entry.of).items():
        if not asked & results_of({role: found}).keys():
            continue
        if isinstance(found, list):
            scenes |= {scene.name: scene.to_dict() for scene in found}
        else:
            scenes[role] = found.to_dict()
    return scenes


def data_of_study():
    """Return every netCDF file of the study, in the order of its stages."""
    direct = [scene for scene in STUDY if scene.fidelity == "dns"]
    geometry = dict.fromkeys(f"results/geometry/{scene.knit}.nc" for scene in STUDY)
    details = [f"results/{stage}/{scene.name}.nc" for stage in ("mesh", "contacts") for scene in direct]
    return [*geometry, *details, *histories(STUDY)]
