"""Results of scenes, their inputs, and which results a change of a key, a number or code concerns."""

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import netCDF4
import pytest
import xarray as xr
from refusals import READ, REFUSED, refusal

from knitstudy.datasets import read_dataset, recorded_digest, write_dataset
from knitstudy.errors import ConvergenceError, DataFileError
from knitstudy.run.configuration import load_scene
from knitstudy.run.cost import expected_cost
from knitstudy.run.plan import Plan, with_digits
from knitstudy.run.simulations import simulate
from knitstudy.run.stages import STAGES
from knitstudy.run.store import Store


@pytest.fixture
def plan(config):
    return Plan.of(config)


def test_a_plan_imports_no_library_of_results_and_no_mechanics_of_models(printed_and_imported):
    """The workflow starts in a third of the time, and each job of a cluster starts it twice."""
    code = (
        "from knitstudy.run.plan import Plan; from knitstudy.run.stages import STAGES;"
        "plan = Plan.of(); scene = plan.scenes['rom3d-tie-course']; step = plan.step('simulation', scene);"
        "print(len(step.digest), step.cost.memory > 0, step.cost.seconds > 0)"
    )
    assert printed_and_imported(code) == ["16 True True", "[]"]


def test_changed_scenes_get_names_of_their_own(plan):
    scene = plan.scenes["dns-a"]
    varied = plan.labelled(scene.vary({"load.strain": 0.01}))
    assert varied.name == f"dns-a-{varied.hash[:8]}"
    assert varied.knit == "plain"
    assert plan.labelled(varied) == varied
    named = plan.labelled(scene.vary({"load.strain": 0.01, "name": "mine"}))
    assert named.name == "mine"
    nameless = plan.labelled(scene.vary({"name": "scene", "knit": "scene"}))
    assert (nameless.name, nameless.knit) == (f"scene-{scene.hash[:8]}", f"scene-{scene.geometry_key[:8]}")
    assert plan.labelled(nameless) == nameless
    assert with_digits(scene.vary({"name": "a" * 198})).name == f"{'a' * 191}-{scene.hash[:8]}"


def test_reduced_model_is_made_from_contacts_of_its_own_geometry(plan):
    scene = plan.labelled(plan.scenes["rom3d-a"].vary({"pattern.loops": 2}))
    step = plan.step("simulation", scene).needs["contacts"]
    direct = step.scene
    assert step.stage.name == "contacts"
    assert direct.pattern.loops == 2
    assert direct.load.strain == plan.scenes["dns-a"].load.strain
    assert direct.name == f"dns-a-{direct.hash[:8]}"


@pytest.mark.parametrize(("changes", "message"), REFUSED["sources"])
def test_sources_that_do_not_fit(plan, changes, message):
    scene = plan.scenes["rom3d-a"].vary(changes)
    with refusal(message):
        plan.step("simulation", scene)


def digests(plan, scene):
    return {step.stage.name: step.digest for step in plan.steps([scene])}


SIMULATED = {"simulation", "contacts", "stress", "series", "deck_abaqus", "deck_calculix"}


@pytest.mark.parametrize(
    ("key", "value", "changed"),
    [
        ("load.strain", 0.01, SIMULATED),
        ("mesh.size", 0.45, SIMULATED | {"mesh", "mesh_vtu"}),
        ("geometry.alpha", 2.0, None),
        ("outputs", ["vtu", "fields", "deck"], set()),
    ],
)
def test_a_key_concerns_the_stages_that_read_it_and_those_behind(config, key, value, changed):
    scene = Plan.of(config).scenes["dns-a"]
    before = digests(Plan.of(config), scene)
    varied = scene.vary({key: value, "name": "dns-a-varied", "knit": "varied"})
    after = digests(Plan.of(config), varied)
    assert after.keys() == before.keys()
    expected = set(before) if changed is None else changed & set(before)
    assert {name for name in after if after[name] != before[name]} == expected


def test_scenes_that_a_stage_reads_alike_share_its_result(config):
    plan, store, calls = Plan.of(config), Store(), []
    rest = load_scene("fabric-acrylic-stockinette-course-free")
    others = (rest.vary({"solver.increments": 3}), rest.vary({"solver.residual_tolerance": 1e-7}))
    first, same, finer = (Plan({}).step("rest", scene).digest for scene in (rest, *others))
    assert first == same != finer
    scene = plan.scenes["dns-a"]
    for each in (scene, scene.vary({"name": "other", "knit": "other", "load.strain": 0.001})):
        step = plan.step("geometry", each)
        made = replace(step, stage=replace(step.stage, function=lambda _: calls.append(1) or xr.Dataset()))
        store.get(made)
    assert len(calls) == 1


def test_loads_of_one_cell_share_its_shape_at_rest(tmp_path):
    """A plan has one file for all of them; a store without a plan of all takes the file of another scene."""
    first = load_scene("fabric-acrylic-stockinette-course-free")
    second, other = (
        first.vary({"name": "second", "load.deformation": "wale"}),
        first.vary({"name": "other", "yarn.bending": 1e-9}),
    )
    plan, rests = Plan({}), [Path(f"rest/{scene.name}.nc") for scene in (first, other)]
    steps = [plan.step("simulation", scene).needs["rest"] for scene in (first, second, other)]
    assert [step.path for step in steps] == [rests[0], rests[0], rests[1]]
    write_dataset(xr.Dataset({"a": ("x", [1.0])}), tmp_path / rests[0], first.name, steps[0].digest)
    alone = Plan({}).step("rest", second)
    assert alone.path == Path("rest/second.nc")
    taken = Store(tmp_path, makes=False).get(alone)
    assert taken["a"].item() == 1.0
    assert recorded_digest(tmp_path / alone.path) == alone.digest
    stage = replace(steps[2].stage, function=lambda *_, **__: xr.Dataset({"a": ("x", [2.0])}), reports=False)
    needed = Store(tmp_path, made={need.digest: xr.Dataset() for need in steps[2].needs.values()})
    assert needed.get(replace(steps[2], stage=stage))["a"].item() == 2.0


def test_a_curve_that_ended_early_is_kept_and_named(plan, tmp_path):
    step, store = plan.step("simulation", plan.scenes["dns-a"]), Store(tmp_path)
    path, whole = tmp_path / step.path, xr.Dataset({"load": ("increment", [0.0, 1.0])})
    write_dataset(whole, path)
    calls = []

    def end(_):
        calls.append(1)
        error = ConvergenceError("no balance.")
        error.history = xr.Dataset(attrs={"incomplete": "ended at strain 2.00%: no balance."})
        raise error

    failing = replace(step, stage=replace(step.stage, function=end, reports=False, restarts=False))
    for _ in range(2):  # the second time from its file
        with refusal(r"^ended at strain 2\.00%: no balance\. The curve up to there is in"):
            store.make(failing, {})
    assert len(calls) == 1
    assert read_dataset(path).equals(whole)
    why = "dns-a ended at strain 2.00%: no balance."
    network = plan.scenes["rom3d-a"]
    assert store.ended_early([step, plan.step("simulation", network)]) == dict.fromkeys(
        ("dns-a", "rom3d-a"), why
    )
    ending = replace(failing, stage=replace(failing.stage, function=lambda _: whole))
    store.make(ending, {}, force=True)
    assert not list(tmp_path.rglob("*.incomplete.nc"))


@pytest.mark.parametrize(("name", "count", "peak", "seconds"), READ["costs"])
def test_measured_costs_are_expected(name, count, peak, seconds):
    """Unknowns are counted of the loop as drawn; a job may be promised up to twice too much, never too little."""
    cost = expected_cost(load_scene(name))
    assert cost.unknowns == pytest.approx(count, rel=0.1)
    assert peak <= cost.memory <= 2 * peak
    assert seconds <= cost.seconds <= 4 * seconds


@pytest.mark.parametrize(("model", "loops", "peak"), READ["memory in contact"])
def test_measured_memory_of_knits_in_contact_is_expected(model, loops, peak):
    scene = load_scene(f"domain-{model}-isotropic-course-10x10")
    keys = {"name": "large", "knit": "large", "pattern.loops": loops, "pattern.rows": loops}
    assert peak <= expected_cost(scene.vary(keys)).memory <= 1.3 * peak


def test_scene_that_exceeds_the_machine_is_refused_before_it_begins(monkeypatch):
    monkeypatch.setattr("psutil.virtual_memory", lambda: SimpleNamespace(total=0.3e9, available=0.3e9))
    with refusal(
        r"coarse': pattern.loops is 3, .*mesh.size is .*'simulation' would take some 0\.\d+ GB.*has 0.3"
    ):
        simulate(load_scene("dns-tie-course-coarse"))


def test_springs_are_measured_of_the_yarn_and_strain_that_a_network_has():
    """They are secants at full load: of another modulus or strain the force was off by more than half."""
    changes = {"yarn.youngs_modulus": 2.6e9, "load.strain": 0.01}
    source = Plan.of().named(load_scene("rom3d-isotropic-course").vary(changes), "rom.contacts_from")
    assert {key: source.value(key) for key in changes} == changes
    assert source.name.startswith("yarns-isotropic-course-")
    assert max(source.load.stops) < 0.01
    given = {"rom.stiffness": [1.0, 1.0, 1.0]} | changes  # nothing is measured
    source = Plan.of().named(load_scene("rom3d-isotropic-course").vary(given), "rom.contacts_from")
    assert source.name == "yarns-isotropic-course"


@pytest.fixture
def sprung(config):
    """Folder with a wale tension and a reduced model with springs as well."""
    shutil.copy(Path(__file__).parent / "families" / "sprung.yaml", config / "scenes" / "small.yaml")
    return config


@pytest.fixture
def made(monkeypatch):
    """Let every stage return its inputs, and list the stages that ran."""
    made = []

    def recorded(stage):
        def function(scene, run=None, **needed):
            made.append((stage.name, scene.knit if stage.name == "geometry" else scene.name))
            origins = {name: dataset.attrs["of"] for name, dataset in needed.items()}
            return xr.Dataset({"number": len(made)}, attrs={"of": f"{scene.name} of {stage.name}"} | origins)

        return function

    for name, stage in STAGES.items():
        monkeypatch.setitem(STAGES, name, replace(stage, function=recorded(stage)))
    return made


def test_springs_come_from_their_own_simulation(sprung, made):
    actual = simulate(load_scene("rom3d-carried", sprung), config=sprung)
    assert actual.history.attrs["contacts"] == "dns-course of contacts"
    assert actual.history.attrs["springs"] == "dns-wale of contacts"
    assert actual.contacts.attrs["of"] == "dns-course of contacts"
    assert made.count(("geometry", "plain")) == 1


def test_changed_knit_reaches_the_sources_and_nothing_else_does(sprung, made):
    changes = {"pattern.loops": 4, "solver.increments": 3}
    simulate(load_scene("rom3d-carried", sprung).vary(changes), config=sprung)
    direct = [scene for name, scene in made if name == "simulation"]
    assert len(direct) == 3
    for base in ("dns-course", "dns-wale"):
        source = load_scene(base, sprung).vary({"pattern.loops": 4})
        assert f"{base}-{source.hash[:8]}" in direct


def test_failure_leaves_earlier_results(sprung, made, tmp_path, monkeypatch):
    scene = load_scene("rom3d-own", sprung)
    path = simulate(scene, tmp_path, config=sprung).path
    before = path.read_bytes()

    def fail(scene, run, **needed):
        raise DataFileError("no")

    monkeypatch.setitem(STAGES, "simulation", replace(STAGES["simulation"], function=fail))
    with pytest.raises(DataFileError):
        simulate(scene, tmp_path, config=sprung, force=True)
    assert path.read_bytes() == before


def test_interrupted_run_goes_on_where_its_geometry_is_made_again(sprung, made, tmp_path, monkeypatch):
    scene, begun = load_scene("beam", sprung), []

    def interrupt(scene, run, **needed):
        begun.append(run.restart.exists())
        run.restart.parent.mkdir(exist_ok=True)
        run.restart.touch()
        raise KeyboardInterrupt

    monkeypatch.setitem(STAGES, "simulation", replace(STAGES["simulation"], function=interrupt))
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            simulate(scene, tmp_path, config=sprung)
        (tmp_path / "geometry" / "plain.nc").unlink()
    assert begun == [False, True]


def test_edited_file_is_replaced(sprung, made, tmp_path, caplog):
    scene = load_scene("rom3d-own", sprung)
    path = simulate(scene, tmp_path, config=sprung).path
    with netCDF4.Dataset(path, "a") as file:
        file["number"][...] = 77
    assert int(simulate(scene, tmp_path, config=sprung).history["number"]) != 77
    assert caplog.text.count("does not end with a checksum: it was cut, changed") == 1
    assert "; it is made again" in caplog.text
    assert made.count(("simulation", "rom3d-own")) == 2


def test_history_that_ends_early_is_not_written(sprung, made, tmp_path, monkeypatch):
    half = xr.Dataset({"load": ("increment", [0.0, 0.5])})
    instead = replace(STAGES["simulation"], function=lambda scene, **needed: half)
    monkeypatch.setitem(STAGES, "simulation", instead)
    with refusal(r"simulation of beam ends at 0\.5 of the load"):
        simulate(load_scene("beam", sprung), tmp_path, config=sprung)
    assert not [*(tmp_path / "simulation").glob("*")]
