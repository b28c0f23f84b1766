"""The reference: which simulations it is made from, how models find it, and that it is kept with its code."""

import keep
import numpy as np
import pytest
import study
import synthetic

from knitstudy.datasets import read_table, write_dataset
from knitstudy.knit.contacts.contacts import extract
from knitstudy.measures.reference import problem_of, reference_of
from knitstudy.measures.response import FORCE, LARGEST_U_Z, RMS_U_Z, STRAINS, rms_out_of_plane
from knitstudy.paper.tables.reference import limits, values_of
from knitstudy.run import committed_tables
from knitstudy.run.catalogue import TABLES
from knitstudy.run.committed_tables import with_runs
from knitstudy.run.configuration import load_scenes, load_study
from knitstudy.run.plan import Plan

SIZES = (1 / 2, 1 / 3)


@pytest.fixture(scope="module")
def solid(plain_scene):
    return plain_scene.vary({"fidelity": "hexahedra", "interaction": "tie"})


def way(solid, element, sizes=SIZES, **keys):
    """Return scenes of one element on several meshes by name, whose increments end at the reference's strains."""
    keys = {"mesh.element": element, "load.stops": list(STRAINS[:-1])} | keys
    named = {f"reference-{element}-{size:g}".replace(".", "").replace("_", "-"): size for size in sizes}
    return {name: solid.vary(keys | {"name": name, "mesh.size": size}) for name, size in named.items()}


def results(knit, cases, force):
    """Return histories and contacts by scene; `force` gives the force at full load from element and size."""
    whole = synthetic.contact_history(knit)
    base, contacts = (
        each.isel(increment=[0, 2, 4, 5]).assign(strain=("increment", [0.0, *STRAINS]))
        for each in (whole, synthetic.with_kinematics(extract(knit, whole)))
    )
    histories = {
        name: base.assign(force=20 * force(scene.mesh.element, scene.mesh.size) * base["strain"])
        for name, scene in cases.items()
    }
    return {"histories": histories, "contacts": dict.fromkeys(cases, contacts), "scenes": cases}


@pytest.fixture(scope="module")
def sources(knit, solid):
    """Two elements on two meshes whose errors are of second order, and tend to 12 and 12.24 N."""
    scenes = way(solid, "one_point") | way(solid, "quadratic")
    limits = {"one_point": (12.0, -0.81), "quadratic": (12.24, 1.62)}
    return results(knit, scenes, lambda element, h: limits[element][0] + limits[element][1] * h**2)


def test_rows_of_two_ways(sources, solid):
    table = TABLES.make("reference", **sources)
    rows = table[table["quantity"] == FORCE].set_index("strain [1]")
    assert list(rows.index) == list(STRAINS)
    assert set(rows["problem"]) == {problem_of(solid)}
    last = rows.loc[0.05]
    # Half of the corrections at 0.3 mm, 0.09 and 0.18 N, which do not explain 0.24 N: what does is added to both.
    added = (0.24**2 - 0.045**2 - 0.09**2) / 2
    share = (0.045**2 + added) / 0.24**2
    assert last["value"] == pytest.approx(12 + 0.24 * share)
    # Their finest values lie farther apart than their limits.
    assert last["uncertainty from disagreement"] == pytest.approx(12.42 - 11.91)
    assert last["uncertainty"] == last["uncertainty from disagreement"]
    assert last["uncertainty from extrapolation"] == pytest.approx(
        np.hypot((1 - share) * 0.045, share * 0.09)
    )
    assert last["mostly from"] == "disagreement"
    assert last["unit"] == "N"
    assert last["discretisations"] == ("one-point hexahedra 0.45, 0.3 mm; quadratic hexahedra 0.45, 0.3 mm")
    assert table["uncertainty"].notna().all()


def test_both_quantities_of_u_z_are_as_uncertain_as_the_less_certain_one(sources):
    """The root mean square of one element is 5 % larger, the largest |u_z| of both the same, by chance."""
    values = values_of(sources["histories"], sources["contacts"])
    here = (values["quantity"] == RMS_U_Z) & values["scene"].str.contains("quadratic")
    values.loc[here, "value"] *= 1.05
    table = limits(values, sources["scenes"]).set_index(["quantity", "strain [1]"])
    share = table["uncertainty from disagreement"] / table["value"]
    assert share[RMS_U_Z, 0.05] == pytest.approx(0.05 / 1.025, rel=1e-2)
    assert share[LARGEST_U_Z, 0.05] == pytest.approx(share[RMS_U_Z, 0.05])


def test_one_way_or_one_mesh_makes_no_reference(knit, solid):
    for scenes in (way(solid, "one_point"), way(solid, "one_point") | way(solid, "quadratic", SIZES[:1])):
        alone = results(knit, scenes, lambda element, h: 1.0)
        assert TABLES.make("reference", **alone).empty


def test_one_way_is_as_uncertain_as_ways_disagree_elsewhere(knit, solid, sources):
    """Forces of two elements are 0.24 N apart at 12.1 N; a stiffer problem has one element alone."""
    other = {
        f"{name}-other": scene.vary({"name": f"{name}-other", "yarn.youngs_modulus": 2e9})
        for name, scene in way(solid, "quadratic").items()
    }
    both = results(knit, sources["scenes"] | other, lambda element, h: 12 + 0.24 * (element == "quadratic"))
    table = TABLES.make("reference", **both)
    last = table[(table["quantity"] == FORCE) & (table["strain [1]"] == 0.05)].set_index("problem")
    pair, single = last.loc[problem_of(solid)], last.loc[problem_of(other["reference-quadratic-05-other"])]
    assert single["value"] == pytest.approx(12.24)
    share = pair["uncertainty from disagreement"] / pair["value"]
    assert share == pytest.approx(0.24 / 12.12, rel=1e-3)
    assert single["uncertainty from disagreement"] == pytest.approx(12.24 * share)


def test_the_committed_reference_has_the_present_problems():
    """A new key of the physics would change their digests, and the reference would no longer be found."""
    table, scenes = read_table(keep.REFERENCE), load_scenes()
    for name in load_study("reference"):
        assert reference_of(table, scenes[name]).known, name


def test_models_are_compared_at_the_largest_strain_that_both_reach(cases):
    reference = reference_of(study.reference(cases), cases["dns-tie-course"])
    full = reference.force_ratio(study.history(force=(0, 9, 18)))
    assert full.value == pytest.approx(18 / 12)
    assert full.uncertainty == pytest.approx(18 / (0.98 * 12) - 1.5)
    # 4 % is beyond 2 % and short of 5 %: there it is 2 % that counts.
    part = reference.force_ratio(study.history(strain=(0, 0.02, 0.04), force=(0, 6, 9)))
    assert part.value == pytest.approx(6 / 4.8)


def test_a_model_is_nearer_than_another_by_a_share_of_its_distance(cases):
    """Curves 10 and 50 % above the reference: open where the uncertainty of 2 % decides."""
    reference = reference_of(study.reference(cases), cases["dns-tie-course"])
    knots, force, _ = reference.curve(0.05)
    one, other = (study.history(strain=tuple(knots), force=tuple(k * force)) for k in (1.1, 1.5))
    actual = [reference.nearer(one, other, share) for share in (0.5, 0.2, 0.1)]
    assert actual == [True, None, False]


def test_quantities_without_a_reference_are_unknown(cases):
    table, solid = study.reference(cases), cases["dns-isotropic-course"]
    slippery = reference_of(table, solid.replace("contact.friction", 0.1))
    assert not slippery.known
    known = reference_of(table, solid)
    short = study.history(strain=(0, 0.003, 0.006))
    for unknown in (
        slippery.force_ratio(study.history()),
        slippery.force_distance(study.history()),
        known.force_ratio(short),
        known.force_distance(short),
        known.at(FORCE, 0.03),
        known.at("temperature", 0.05),
    ):
        assert str(unknown) == "no reference"
    assert slippery.nearer(study.history(), study.history(), 0.5) is None


def test_root_mean_square_does_not_depend_on_stations():
    """Of a half sine of 2 mm on one yarn: its amplitude over the root of two, however it is sampled."""
    even = synthetic.history(lift=2e-3, yarns=1, stations=401)
    s = even["arc_length"].to_numpy()
    uneven = even.isel(station=(s < 5e-3) | (np.arange(len(s)) % 4 == 0))
    for history in (even, uneven):
        assert rms_out_of_plane(history)[-1] == pytest.approx(2e-3 / np.sqrt(2), rel=1e-3)


@pytest.fixture
def copy(tmp_path, sources, monkeypatch):
    """Kept rows of all simulations of two ways, made by the code ab12."""
    path = tmp_path / "reference.csv"
    monkeypatch.setattr(committed_tables, "physics_digest", lambda: "ab12")
    keep.keep_values(values_of(sources["histories"], sources["contacts"]), sources["scenes"], path)
    return path


def test_rows_that_were_not_simulated_again_stay(copy, sources, monkeypatch):
    """One mesh of one way is: its rows and the limits change, and rows say by which code they were made."""
    name = "reference-one-point-0333333"
    changed = sources["histories"][name].assign(force=sources["histories"][name]["force"] * 1.01)
    few = values_of({name: changed}, {name: sources["contacts"][name]})
    before, values = read_table(copy), read_table(keep.values_beside(copy))
    monkeypatch.setattr(committed_tables, "physics_digest", lambda: "cd34")
    keep.keep_values(few, sources["scenes"], copy)
    after, again = read_table(copy), read_table(keep.values_beside(copy))
    assert list(again["scene"]) == list(values["scene"])
    codes = with_runs(keep.values_beside(copy))["code"]
    assert set(again[codes == "cd34"]["scene"]) == {name}
    np.testing.assert_array_equal(
        again["value"] != values["value"], (values["scene"] == name) & forces(values)
    )
    assert set(with_runs(copy)["code"]) == {"cd34"}
    np.testing.assert_array_equal(after["value"] != before["value"], forces(before))


def forces(table):
    """Return which rows are forces of the knit."""
    return (table["quantity"] == FORCE).to_numpy()


def test_only_simulations_that_are_up_to_date_are_kept(config, sources, tmp_path):
    """Their digests say so: one of the history and one of the contacts."""
    history, contacts = (next(iter(sources[name].values())) for name in ("histories", "contacts"))
    plan = Plan.of(config)
    scenes = {"dns-a": plan.scenes["dns-a"]}
    steps = [plan.step(stage, scenes["dns-a"]) for stage in keep.SIMULATED]
    assert keep.values_found(scenes, tmp_path, config).empty
    for digests, there in (([None, "old"], False), ([None, None], True), (["old", None], False)):
        for step, dataset, digest in zip(steps, (history, contacts), digests, strict=True):
            write_dataset(dataset, tmp_path / step.path, step.scene.name, digest or step.digest)
        assert set(keep.values_found(scenes, tmp_path, config)["scene"]) == (set(scenes) if there else set())
