# What figures, tables and the report of a study are made from.
import hashlib

from knitstudy.figures.catalogue import FIGURES as FIGURE_ENTRIES
from knitstudy.figures.catalogue import entry as figure_entry
from knitstudy.figures.catalogue import module as figure_module
from knitstudy.report.selection import roles_of
from knitstudy.stages.code import code_digest
from knitstudy.tables.catalogue import TABLES as TABLE_ENTRIES
from knitstudy.tables.catalogue import module as table_module

REFERENCE = {
    "paper": "resources/reference/paper_tables.csv",
    "claims": "resources/reference/paper_claims.csv",
    "targets": f"{CONFIG}/calibration.yaml",
}


def steps_of(roles):
    """Return the results of scenes by what figures call them, as stages and scenes; those of several scenes are lists."""
    found = {}
    for role, scenes in roles.items():
        several = scenes if isinstance(scenes, list) else [scenes]
        direct = [scene for scene in several if scene.fidelity == "dns"]
        steps = {role: [(stage_of(scene), scene) for scene in several]}
        if direct:
            prefix = "" if role == "dns" else f"{role}_"
            for name in ("contacts", "geometry", "mesh"):
                steps[f"{prefix}{name}"] = [(STAGES.find(name), scene) for scene in direct]
        found |= steps if isinstance(scenes, list) else {name: each[0] for name, each in steps.items()}
    return found


def possible(entries):
    """Return what each figure or table is made from by what it is, of those that the study can make."""
    found = {}
    for name, entry in entries.items():
        steps = steps_of(roles_of(STUDY, entry.of)) | REFERENCE
        if set(entry.needs) <= {*steps, "scenes"}:
            found[name] = {need: steps[need] for need in (*entry.needs, *entry.may) if need in steps}
    return found


def files_of(needs):
    """Return the files of what something is made from; no time of theirs counts."""
    files = {}
    for name, found in needs.items():
        if isinstance(found, str):
            files[name] = ancient(found)
        elif isinstance(found, tuple):
            files[name] = ancient(f"{RESULTS}/{found[0].path(found[1])}")
        else:
            files[name] = [ancient(f"{RESULTS}/{stage.path(scene)}") for stage, scene in found]
    return files


def digests_of(needs):
    """Return the digests of what something is made from."""
    digests = {}
    for name, found in needs.items():
        if isinstance(found, str):
            digests[name] = hashlib.sha256(Path(found).read_bytes()).hexdigest()[:16]
        else:
            for step in [found] if isinstance(found, tuple) else found:
                digests[f"{name} {step[1].name}"] = PLAN.digest(*step)
    return digests


def scenes_for(entry):
    """Return the scenes of what a figure or table takes, where it asks for them: several of one role by their names."""
    asked = {*entry.needs, *entry.may}
    if "scenes" not in asked:
        return {}
    scenes = {}
    for role, found in roles_of(STUDY, entry.of).items():
        if not asked & steps_of({role: found}).keys():
            continue
        if isinstance(found, list):
            scenes |= {scene.name: scene.to_dict() for scene in found}
        else:
            scenes[role] = found.to_dict()
    return scenes


def reads_of_scenes(entry):
    """Return what a figure or table can read of its scenes: keys that were added since say nothing at their defaults."""
    return {name: PLAN.scenes[found["name"]].read(found) for name, found in scenes_for(entry).items()}


def note_entries(folder, entries, made_from, module_of, *code):
    """Note the digests of figures or tables."""
    for name, needs in made_from.items():
        reads = {"title": entries[name].title, "scenes": reads_of_scenes(entries[name])}
        wanted = freshness.digest_of_files(reads, code_digest(module_of(name), *code), digests_of(needs))
        freshness.note(f"{folder}/{name}", wanted)


def data_of_study():
    """Return every netCDF file of the study, in the order of its stages."""
    order = ("geometry", "mesh", "contacts", "dns", "rom", "beams")
    steps = [step for step in PLAN.steps(STUDY) if step[0].leaves.endswith(".nc")]
    place = {name: number for number, name in enumerate(order)}
    return sorted(steps, key=lambda step: place.get(step[0].name, len(order)))
