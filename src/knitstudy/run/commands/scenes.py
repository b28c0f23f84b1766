"""``knitstudy list``, ``check`` and ``plan``: facts about scenes before any simulation."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from math import nan
from pathlib import Path
from typing import Any

import click

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.alternatives import Value, known_yarns, read_yarn, values_of_yarns
from knitstudy.knit.scene.documents import layered_defaults
from knitstudy.knit.scene.keys import Description, documented
from knitstudy.knit.scene.kinds import MODELS, Labels, defaults_of_fields, word_of
from knitstudy.knit.scene.scene import LABELS, Scene, flat, unit_warnings
from knitstudy.registry import unknown_choice
from knitstudy.run.advice import (
    BESIDE,
    Choice,
    ModelSetting,
    Promises,
    as_measured,
    choose,
    digits,
    front,
    without_edges,
)
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.commands import console
from knitstudy.run.configuration import asked_of, knits_of, load_families, load_scenes, load_study, own_scenes
from knitstudy.run.families import STUDIES
from knitstudy.run.plan import Plan
from knitstudy.run.stages import STAGES
from knitstudy.run.store import OF_STUDY, Store

RUNS = Path("runs")  # where `knitstudy run` keeps results by default


@click.command("list")
@click.option("--study", type=click.Choice(STUDIES), help="Only scenes of this study.")
@click.option("--family", help="Only scenes of this family, by the name of its file.")
@click.option("--fidelity", help="Only scenes of this model.")
@click.option("--yarns", is_flag=True, help="List the yarns that a scene may take (yarn.of) instead.")
@console.config_option
def list_scenes(
    study: str | None, family: str | None, fidelity: str | None, yarns: bool, config: Path
) -> None:
    """List the scenes: family, studies, and the keys that differ from the defaults (SI units).

    A terminal shows a table; in a pipe, tabs separate the columns. `knitstudy check` checks the keys.

    \b
    knitstudy list --study reduced               the scenes that `make study` runs
    knitstudy list --fidelity hexahedra          solid yarns of hexahedra
    knitstudy list --family 2-medium             the scenes that config/scenes/2-medium.yaml defines
    knitstudy list | cut -f1                     names alone
    knitstudy list --yarns                       values with their intervals, and where they come from
    """
    if yarns:
        if study or family or fidelity:
            raise click.UsageError("--study, --family and --fidelity are for scenes, and not for --yarns")
        return _print_yarns()
    if fidelity is not None:
        MODELS.find(fidelity, "--fidelity")
    members = load_families(config)
    defaults = flat(layered_defaults(config))
    families = dict.fromkeys(member.family for member in members.values())
    if family is not None and family not in families:
        raise ConfigurationError(unknown_choice("unknown family", family, family, list(families)))
    rows = []
    for name, member in members.items():
        inside = study is None or study in member.studies
        model = member.keys.get("fidelity", defaults.get("fidelity"))
        if inside and fidelity in (None, model) and family in (None, member.family):
            rows.append((name, member.family, ",".join(member.studies), _difference(member.keys, defaults)))
    console.print_table(("scene", "family", "studies", "differs from defaults"), rows)


def _difference(keys: Mapping[str, Any], defaults: Mapping[str, Any]) -> str:
    """Return in words which keys differ from the defaults, the model first."""
    changed = {
        key: value
        for key, value in keys.items()
        if key not in LABELS and (key not in defaults or value != defaults[key])
    }
    return ", ".join(
        f"{key} of its own" if _nested(changed[key]) else f"{key}={console.plain(word_of(changed[key]))}"
        for key in sorted(changed, key=lambda key: ("." in key, key))
    )


def _print_yarns() -> None:
    """Print the yarns of the library with their main values."""
    shown = {"diameter [mm]": 1e3, "stretching [N]": 1, "bending [N mm2]": 1e6, "friction": 1}
    rows = []
    for name, yarn in ((name, read_yarn(name)) for name in known_yarns()):
        row = [name, float(yarn.values["tex"].value)]
        for column, scale in shown.items():
            value = yarn.values[column.split()[0]]
            x, high, low = scale * value.ends
            row.append(f"{x:.3g}{f' ({low:.3g} to {high:.3g})' if low < high else ''} {value.provenance}")
        rows.append((*row, yarn.name))
    console.print_table(("yarn", "tex", *shown, "name"), rows)


def _nested(value: Any) -> bool:
    """Return whether a value is a list of lists, as points are."""
    return isinstance(value, list) and any(isinstance(item, list) for item in value)


@click.command()
@console.scene_argument("what", metavar="[FOLDER | FILE | SCENE]", required=False)
@console.set_option
@click.option("--sources", is_flag=True, help="Also print the source of every key of the scene.")
@console.config_option
def check(what: str | None, changes: console.Changes, sources: bool, config: Path) -> None:
    """Check a configuration folder, or print every key of a scene with its unit and its provenance.

    The loop of a knit is laid out, and one cell of it meshed: a loop that does not fit, or that elements do not
    resolve, is an error.

    An error is one message: the file, the scene, the key, its value and the values that are allowed. The provenance of
    a key tells whether the paper states the default, or whether it was inferred, calibrated, assumed or chosen here;
    for other values it tells who set them, or the source in the file of the yarn.

    \b
    knitstudy check                              the default configuration
    knitstudy check my-scenes                    a folder, or a file, of your own
    knitstudy check yarns-tie-course             all keys of a scene
    knitstudy check yarns-tie-course --sources     and their sources
    knitstudy check yarns-tie-course --set mesh.size=0.5
    """
    file = what is not None and what.endswith((".yaml", ".yml"))
    if what is None or file or (Path(what).is_dir() and what not in load_families(config)):
        if changes or sources:
            raise click.UsageError("--set and --sources need the name of a scene")
        _check_folder(config if what is None else Path(what))
    else:
        scene = console.changed_scene(what, changes, config)
        try:
            loop = _checked_loop(scene) if "pattern" in scene.sections else None
            _print_keys(scene, sources, what, changes, config)
            for text in filter(None, (_known_rest(scene, what, config), loop)):
                console.say(text)
        finally:  # a value in another unit may be why there is no loop
            for warning in unit_warnings(scene):
                console.say(warning, err=True)


def _check_folder(folder: Path) -> None:
    console.load_plugins_of(folder)
    scenes = load_scenes(folder)
    if folder.is_file():
        own = own_scenes(folder)
        console.say(f"{folder}: valid; scene{'s' * (len(own) != 1)} {', '.join(own) or 'none'}")
        for name in own[:1]:
            console.say(f"knitstudy check {name} --config {folder} shows all keys of {name}")
        return
    studies = ", ".join(f"{len(load_study(name, folder))} of study {name}" for name in STUDIES)
    console.say(f"{folder}: valid; {len(scenes)} scenes ({studies}), {len(knits_of(scenes))} geometries")


def _checked_loop(scene: Scene) -> str:
    """Lay out the loop of a scene, divide its knit, and describe both in words."""
    # The geometry is imported here: the other commands and --help do not need it.
    from knitstudy.knit.geometry.fabric_file import fabric_of
    from knitstudy.knit.geometry.lay_out import lay_out
    from knitstudy.knit.simulate import require_resolution
    from knitstudy.measures.construction import drawn, of_yarn
    from knitstudy.mechanics.core.batches import serial_blas

    with serial_blas():  # as in a run: whether a tight loop is found may depend on the last bits of its sums
        geometry = lay_out(scene)
    known = of_yarn(drawn(geometry, scene.tex), scene)
    numbers = (f"{name} {value:.3g} {unit}" if unit else f"{name} {value}" for name, value, unit in known)
    fabric = f"fabric as drawn: {', '.join(numbers)}\n"
    if "state" not in geometry.dims:
        return f"{fabric}loop: stitches as they are drawn, not optimised; the path to rest finds their shape"
    after = geometry.isel(state=-1)
    length, gap, other = (1e3 * float(after[name]) for name in ("loop_length", "gap", "other_gap"))
    text = f"{length:.4g} mm of yarn, gaps of {gap:.3g} mm at crossings and {other:.3g} mm elsewhere"
    if scene.value("geometry.diameter_share") not in (None, 1):
        text += " between yarns as thin as they are drawn"
    return f"{fabric}loop: {text}; {require_resolution(scene, fabric_of(geometry))}"


def _known_rest(scene: Scene, what: str, config: Path) -> str:
    """Return as text how stable the stored shape at rest of a scene is; empty if the load begins as drawn."""
    from knitstudy.measures.summary import stability_of_rest

    if not STAGES["rest"].of(scene):
        return ""
    plan = Plan.of(config)
    kept = Store(RUNS, (OF_STUDY,)).found(plan.step("rest", plan.labelled(scene)))
    if kept is None:
        return f"shape at rest: not known yet; knitstudy run {what} finds it, and whether the cell hides an instability"
    numbers = (
        f"{name} {value:.3g} {unit}" if unit else f"{name} {value}"
        for name, value, unit in stability_of_rest(kept)
    )
    return f"shape at rest: {', '.join(numbers)}"


def _print_keys(scene: Scene, sources: bool, what: str, changes: console.Changes, config: Path) -> None:
    columns = ("unit", "role", "provenance", *(("source", "checked") if sources else ()))
    defaults = defaults_of_fields() | flat(layered_defaults(config))
    before = flat(scene.to_dict())
    with suppress(ConfigurationError):  # only the changes make it a scene
        before = flat(console.changed_scene(what, (), config).to_dict()) if changes else before
    member = load_families(config).get(what)
    changed = dict(changes)
    rows = []
    yarns = values_of_yarns((member.keys if member else {}) | changed)
    for key, value in flat(scene.to_dict()).items():
        if scene.replaced_by(key):
            continue  # nothing reads it
        set_here = key in changed or before.get(key) != value
        by_scene = key in changed or (key not in LABELS and value != defaults.get(key))
        given = next((each for name, each in yarns if (name, each.value) == (key, value)), None)
        who = ("set here" if set_here else "set by the scene") if by_scene else ""
        described = _described(scene, key, given, who)
        rows.append((key, word_of(value), *(getattr(described, column) for column in columns)))
    console.print_table(("key", "value", *columns), rows)


def _described(scene: Scene, key: str, given: Value | None, who: str) -> Description:
    """Return the description of a key, with the source of its value: a yarn's value, `who` has set it, or a default."""
    name, _, field = key.rpartition(".")
    described = documented(type(scene.sections[name]) if name else Labels, field)
    if given is not None:
        return replace(described, provenance=given.provenance, source=given.source)
    if who:
        default = f"default: {described.provenance}, {described.source}"
        return replace(described, provenance=who, source=default)
    return described


@click.command()
@console.scene_argument()
@click.option("--question", help="force, curve, out_of_plane, contact, stress or loss.")
@click.option("--accuracy", type=float, help="Largest relative error, for example 0.05.")
@click.option("--seconds", type=float, help="Largest time [s].")
@click.option("--memory", type=float, help="Largest growth of memory [MB].")
@console.set_option
@console.config_option
def plan(scene: str, changes: console.Changes, config: Path, **asks: str | float | None) -> None:
    """Print the cheapest model that answers a question about a scene accurately enough, its promised error
    and its cost. Small cells of the endless fabric then run for some seconds and show which
    inputs change the force most.

    Errors and costs were measured on a sample of knits (config/trade.yaml, accuracy.md). Outside its range nothing is
    promised: `knitstudy measure SCENE` measures them on this knit.

    A scene can leave its model open with these keys; `knitstudy run` and `make study` then see an ordinary scene of the
    chosen model:

    \b
    fidelity: auto
    ask.question: force            # or curve, out_of_plane, contact, stress, loss
    ask.accuracy: 0.05             # largest relative error at full load
    ask.seconds: 30                # optional
    ask.memory: 500                # MB, optional

    The options apply to any other scene, whatever model it names; without them the question is force within 5 %:

    \b
    knitstudy plan cell-course
    knitstudy plan yarns-isotropic-wale --question contact --accuracy 0.1 --seconds 30
    knitstudy plan yarns-tie-course --question force --accuracy 0.05 --set pattern.course_spacing=5e-3
    knitstudy run yarns-tie-course --set fidelity=auto --set ask.question=force --set ask.accuracy=0.05

    For a knit with more cells than any knit of the sample, the endless cell comes first, then the costs of the knit.

    Each line of the printed table costs more and is more accurate than the line before. If no model meets the
    accuracy or the budget, the message names the nearest.
    """
    asked_keys = {f"ask.{name}": value for name, value in asks.items() if value is not None}
    problem, ask, where = asked_of(scene, dict(changes) | asked_keys, config)
    if small := as_measured(problem):
        settings = Promises.of(small, where).settings(ask.question)
        console.say(
            without_edges(problem, ask)
            or f"the endless cell is not promised to be accurate to {100 * ask.accuracy:g} %"
        )
        _print_larger(problem, small, settings)
    else:
        _print_plan(choose(problem, ask, where))


def _print_larger(problem: PhysicalProblem, small: PhysicalProblem, settings: list[ModelSetting]) -> None:
    """Print the costs of a knit that is larger than all knits of the sample, and the errors on a smaller knit."""
    from knitstudy.run.cost import expected_cost

    size, less = (f"{knit.inputs.loops} x {knit.inputs.rows}" for knit in (problem, small))
    console.say(
        f"no error is promised of {size} cells by any model; expected costs, and errors on {less} cells:"
    )
    costs = [expected_cost(problem.scene.vary(setting.keys)) for setting in settings]
    rows = [
        (setting.name, digits(cost.seconds), cost.memory, digits(100 * setting.error))
        for setting, cost in zip(settings, costs, strict=True)
    ]
    console.print_table(("model", "seconds", "MB", f"error at most on {less} cells [%]"), rows)


def _print_inputs(problem: PhysicalProblem) -> None:
    """Print the inputs that the force of an endless cell changes most with, and how a spun yarn bends."""
    from knitstudy.run.inputs import SHARE, compared_with_library, effects_on_force

    if effects := effects_on_force(problem):
        what = f"force of an endless cell, for {100 * SHARE:g} % more of an input"
        console.say(f"{what}: yarn.youngs_modulus {100 * SHARE:+g} %, {', '.join(map(str, effects))}")
    console.say(compared_with_library(problem.scene))


def _print_plan(choice: Choice) -> None:
    """Print question, choice, basis, front, and the keys that the choice sets."""
    problem = choice.promises.problem
    ask = choice.ask
    setting = choice.setting
    name = problem.scene.name
    interaction = word_of(problem.scene.interaction)
    console.say(f"{name}: {ask.question} within {100 * ask.accuracy:g} %, {interaction}")
    console.say(f"take {setting}, for the values you gave, {choice.promises.basis}")
    if offer := without_edges(problem, ask):
        console.say(offer)
    _print_inputs(problem)
    beside = choice.beside
    rows = []
    for option in front(choice.settings):
        price = map(digits, (100 * option.error, option.seconds, option.most_seconds, option.memory))
        other = [digits(100 * beside.get(option.name, nan))] if beside else []
        rows.append((option.name, *price, *other, "taken" if option == setting else ""))
    columns = ["model", "error of the simulation at most [%]", "seconds", "at most", "MB"]
    if beside:
        columns.append(f"of the {BESIDE[ask.question]} [%]")
    console.print_table((*columns, ""), rows)
    console.say(" ".join(f"--set {key}={console.plain(value)}" for key, value in setting.keys.items()))
