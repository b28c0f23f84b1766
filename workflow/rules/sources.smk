# What figures, tables and the report of a study are made from.
from knitstudy.errors import ConfigurationError
from knitstudy.figures.catalogue import FIGURES as FIGURE_ENTRIES
from knitstudy.figures.catalogue import entry as figure_entry
from knitstudy.report.selection import models_of
from knitstudy.tables.catalogue import TABLES as TABLE_ENTRIES

REFERENCE = {
    "paper": "resources/reference/paper_tables.csv",
    "claims": "resources/reference/paper_claims.csv",
    "targets": f"{CONFIG}/calibration.yaml",
}


def results_of(models):
    """Return the results of a direct simulation and its reduced models by what figures call them."""
    files = {fidelity: histories([scene])[0] for fidelity, scene in models.items()}
    if "dns" in models:
        dns = models["dns"]
        files["geometry"] = f"results/geometry/{dns.knit}.nc"
        files["mesh"] = f"results/mesh/{dns.name}.nc"
        files["contacts"] = f"results/contacts/{dns.name}.nc"
    return files


def possible(entries):
    """Return the files that each figure or table needs by what they are, of those that the study can make."""
    found = {}
    for name, entry in entries.items():
        files = results_of(models_of(STUDY, entry.of)) | REFERENCE
        needs = [need for need in entry.needs if need != "scenes"]
        if set(needs) <= set(files):
            found[name] = {need: files[need] for need in needs}
    return found


def needs_of_figure(wildcards):
    """Return the files that a figure is drawn from by what they are; stop where it cannot be drawn."""
    name = wildcards.figure
    try:
        needs = figure_entry(name).needs
        if name not in DRAWN:
            raise ConfigurationError(
                f"figure {name!r} needs {', '.join(needs)}: study {config['study']!r} lacks a scene for one of them"
            )
    except KnitstudyError as error:
        stop(error)
    return DRAWN[name]


def scenes_of_table(wildcards):
    """Return the scenes that a table is about by fidelity, where it asks for them."""
    entry = TABLE_ENTRIES[wildcards.table]
    if "scenes" not in entry.needs:
        return {}
    return {fidelity: scene.to_dict() for fidelity, scene in models_of(STUDY, entry.of).items()}


def data_of_study():
    """Return every netCDF file of the study, in the order of its stages."""
    direct = [scene for scene in STUDY if scene.fidelity == "dns"]
    geometry = dict.fromkeys(f"results/geometry/{scene.knit}.nc" for scene in STUDY)
    details = [f"results/{stage}/{scene.name}.nc" for stage in ("mesh", "contacts") for scene in direct]
    return [*geometry, *details, *histories(STUDY)]
