"""Tables against values computed by hand, and the paper's numbers beside them."""

import fnmatch
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import study
import synthetic
import xarray as xr
from refusals import refusal

from knitstudy.knit.contacts.contacts import extract
from knitstudy.knit.geometry.specimens import cut_cells, yarn_pair
from knitstudy.knit.mesh.mesher import mesh_fabric, slices_of
from knitstudy.measures.response import (
    distance_of_curves,
    out_of_plane_correlation,
    transverse_contraction,
)
from knitstudy.paper.cases import number, numbers
from knitstudy.paper.columns import Simulation
from knitstudy.paper.report import READERS
from knitstudy.paper.square_knits import COUNTED, SERIES, law_of, network_2d, network_3d
from knitstudy.paper.tables import table3_table5_cost
from knitstudy.paper.tables.table1_table2_contact import (
    AVERAGED,
    READINGS,
    tabulate_springs,
)
from knitstudy.paper.tables.table2_meshes import (
    NEAREST,
    SLIP,
    at_the_same,
    displacements,
    hertz_stiffness,
    tabulate_rules,
)
from knitstudy.run.catalogue import FIGURES, TABLES, Displays, Made, reference_files
from knitstudy.run.configuration import CONFIG, load_scenes, load_study
from knitstudy.run.plan import Plan


def contacts(rows=2, columns=2):
    """Contacts of a knit whose interlock segments go up by 2 for 1 across, and whose legs by 3 for 1."""
    row, column, zone = (index.ravel() for index in np.indices((rows, columns, 4)))
    x = 10 * column + np.array([0, 6, 1, 5])[zone]
    y = 5 * row + np.array([0, 0, 2, 2])[zone]
    centroid = np.column_stack([x, y, 0.3 * zone])
    place = {"row": row, "column": column, "zone": zone}
    return xr.Dataset(
        {name: ("crossing", values) for name, values in place.items()}
        | {"centroid": (("crossing", "xyz"), centroid)}
    )


def test_numbers_of_the_paper_are_read_and_missing_ones_are_named(paper):
    assert numbers(paper, "4", "rom2d", "segment 2 and 3 angles to x y z").tolist() == [66, 24, 90]
    with refusal("case 'dns', quantity 'time' is there 0 times"):
        number(paper, "5", "dns", "time")
    with refusal("'memory' is 'much'; it must be numbers"):
        number(paper.assign(value="much"), "5", "rom2d 3x3", "memory")


def test_angles_of_a_known_honeycomb(paper):
    table = TABLES.make("table4_angles", contacts=contacts(), paper=paper, scenes={}).set_index("segment")
    interlock, leg = np.degrees(np.arctan([2, 3]))
    np.testing.assert_allclose(table["angle to x [deg]"], [0, interlock, interlock, leg, leg, 0], atol=6e-4)
    np.testing.assert_allclose(table["angle to y [deg]"], 90 - table["angle to x [deg]"], atol=2e-3)
    assert (table["angle to z [deg]"] == 90).all()
    assert table["angle to x, paper [deg]"].tolist() == [0, 66, 66, 80, 80, 0]
    assert table.loc[2, "largest difference [deg]"] == pytest.approx(66 - interlock, abs=1e-3)
    assert table["segments"].tolist() == [4, 4, 4, 2, 2, 2]


def test_transverse_contraction_by_hand():
    """Yarns 5 mm apart approach by 1 mm in the middle third, and by 4 mm at the ends.

    Where the path begins with yarns 4 mm apart, which are drawn 5 mm apart, they contract by a quarter.
    """
    history = synthetic.history(stations=31)
    x, motion = history["centreline"].to_numpy()[:, 0], history["centreline_displacement"].copy(deep=True)
    middle = np.abs(x - 5e-3) <= 10e-3 / 6
    motion[-1, :, 1] = np.where(middle, -1e-3, -4e-3) * (history["yarn"] == 1)
    assert transverse_contraction(history.assign(centreline_displacement=motion)) == pytest.approx(0.2)
    motion[:, :, 1] -= 1e-3 * (history["yarn"] == 1)
    assert transverse_contraction(history.assign(centreline_displacement=motion)) == pytest.approx(0.25)


def test_names_of_scenes_are_those_of_the_configuration():
    """A name or pattern that no scene has, for example with a typing error, would leave out a result in silence."""
    known = set(load_scenes())
    coarse = {name for name in known if name.endswith("-coarse")}
    for display in (*FIGURES.all().values(), *TABLES.all().values()):
        for argument, results in display.results.items():
            actual = {name for name in results.names if fnmatch.filter(known, name)}
            assert actual, (display.name, argument)
            if not results.several:
                assert actual - coarse, (display.name, argument)
    for stem, three in SERIES.items():
        assert fnmatch.filter(known, f"{stem}-*x*"), stem
        assert three is None or three in known


OTHERS = (
    "sweep-shape-c0",
    "domain-",
    "cell-",
    "fabric-acrylic-stockinette-",
    "fabric-acrylic-rib-",
    "reference-3x3-tie-",
)
"""How names of scenes of the full study begin that other tables than those of the reduced one take."""


@pytest.fixture(scope="module")
def offered():
    """The tables of a study."""
    plan = Plan.of(CONFIG)
    study = [*load_study("reduced"), *(each for each in plan.scenes if each.startswith(OTHERS))]
    return Displays(TABLES, plan, [plan.scenes[name] for name in study], reference_files(CONFIG))


@pytest.fixture(scope="module")
def results(knit):
    """Made-up results by stage, with all that any model records."""
    history = synthetic.contact_history(knit, **synthetic.COST, linear_setups=1, penetration_limit=1e-6)
    count = history.sizes["increment"]
    each = ("residual", "correction", "krylov_iterations", "augmentations")
    path = {name: ("increment", np.zeros(count)) for name in each} | {"load": ("increment", np.ones(count))}
    path["crossing_slip"] = (("increment", "crossing"), np.ones((count, history.sizes["crossing"])))
    of_cells = {"cell_strain": [1.0, 0.5, 0.1], "force_per_width": [1e3, 1e2, 1e2]}
    in_plane = {
        name: (("increment", "plane"), np.outer(history["strain"], each)) for name, each in of_cells.items()
    }
    sections = {f"{name}_stiffness": (("a", "b"), np.eye(3)) for name in ("membrane", "coupling", "bending")}
    tangent = {"tangent_per_width": (("increment", "a", "b"), np.tile(np.eye(3), (count, 1, 1)))}
    seconds = {"seconds": (("increment", "phase"), np.ones((count, 1)))}
    return {
        "geometry": synthetic.geometry(knit),
        "simulation": history.assign(**path, **in_plane, **sections, **tangent, **seconds),
        "contacts": synthetic.with_kinematics(extract(knit, history)),
        "stress": synthetic.stresses(knit, "course", 33, 33, mesh_fabric(knit, 4 / 3)),
    }


@pytest.fixture(scope="module")
def made(offered, results):
    """Function that makes a table by its name from made-up results; tables that others take are made once.

    The table of counts, which takes seconds, is made up where others take it.
    """

    def read(source):
        if isinstance(source, list):
            return {step.scene.name: read(step) for step in source}
        if isinstance(source, Made):
            return study.counted() if source.path.stem == COUNTED else make(source.path.stem)
        if isinstance(source, Path):
            return READERS[source.suffix](source)
        if source.scene.name.startswith("fabric-"):
            way, other = source.scene.name.split("-")[-2:]
            return synthetic.fabric_cell(other, way)
        return results[source.stage.name].assign_attrs(scene=source.scene.name)

    @cache
    def make(name):
        sources = {argument: read(source) for argument, source in offered.sources[name].items()}
        return TABLES.make(name, **sources, scenes=offered.scenes(name))

    return make


@pytest.mark.parametrize("name", TABLES.names())
def test_every_table_is_made_from_the_files_that_the_workflow_names(made, name, monkeypatch):
    monkeypatch.setattr(table3_table5_cost, "SIZES", (3, 6))  # larger knits take seconds
    assert len(made(name).columns)


def test_distance_of_a_hat_by_hand():
    """A hat of height 3 over [0, 2], against a line of slope 1: 6 over 8/3 under the roots."""
    distance = distance_of_curves(np.arange(3.0), np.array([0.0, 4, 2]), np.array([0.0, 1, 2]))
    assert distance == pytest.approx(np.sqrt(6 / (8 / 3)))


def test_the_shape_out_of_the_plane_correlates_whatever_the_stations():
    """Straight bulges sampled differently; 201 stations interpolate a sine within 1e-4."""
    bulge = synthetic.history(lift=1e-4, stations=201)
    assert out_of_plane_correlation(synthetic.history(lift=0.5e-4, stations=7), bulge) == pytest.approx(
        1, abs=1e-4
    )
    assert out_of_plane_correlation(synthetic.history(lift=-1e-4), bulge) == pytest.approx(-1, abs=1e-4)
    assert np.isnan(out_of_plane_correlation(synthetic.history(), bulge))


@pytest.fixture(scope="module")
def every(cases):
    return study.histories(cases)


@pytest.fixture(scope="module")
def reference(cases):
    return study.reference(cases)


def test_distances_of_all_models_from_the_reference(every, cases, reference):
    sources = {"models": every, "scenes": cases, "reference": reference}
    table = TABLES.make("rom_distance", **sources).set_index("model")
    assert table.index.is_unique
    assert len(table) == 4 * 7
    of = table.loc["3D ROM, printed joints; tie constraint, wale"]
    assert of["scene"] == "rom3d-printed-tie-wale"
    assert of["discretisation"] == "beams"
    assert of["L2 distance of force to the reference [1]"] == pytest.approx(0.5)
    assert of["force over the reference's [1]"] == pytest.approx(1.5)
    assert of["correlation of u_z with DNS [1]"] == pytest.approx(1)
    assert of["amplitude of u_z over the reference's [1]"] == pytest.approx(0.5)
    # 1.5 times the reference's value is 1.5 / 0.98 times the least that this may be.
    assert of["uncertainty of that ratio [1]"] == pytest.approx(1.5 / 0.98 - 1.5)
    assert of["uncertainty of that distance [1]"] == pytest.approx(1.5 / 0.98 - 1.5)
    other_mesh = table.loc["DNS, one-point hexahedra of 0.45 mm; isotropic friction, course"]
    assert other_mesh["L2 distance of force to the reference [1]"] == pytest.approx(0.02)
    assert other_mesh["discretisation"] == "one-point hexahedra of 0.45 mm"


def test_networks_are_compared_with_the_solids_whose_contacts_they_have(every, cases):
    """A network of 1.2 times the force of its solids at all strains is 0.2 away from them."""
    solids = {name: each for name, each in every.items() if name.startswith("dns-") and "medium" not in name}
    networks = {name: each for name, each in every.items() if name.startswith("rom3d-")}
    table = TABLES.make("joints", networks=networks, solids=solids, scenes=cases).set_index("scene")
    assert list(table.loc[table["case"] == "tie constraint, course", "joints"]) == [
        "separated",
        "rigid arms",
        "pinned",
    ]
    assert table.loc["rom3d-tie-wale", "L2 distance of force to the solids' [1]"] == pytest.approx(0.2)
    assert table.loc["rom3d-printed-isotropic-wale", "force over the solids' [1]"] == pytest.approx(1.5)
    assert table.loc["rom3d-tie-wale", "springs"] == "none"
    assert table.loc["rom3d-isotropic-wale", "springs"] == "own"


def test_responses_by_hand(every, cases):
    """10 N at 5 % of a specimen that is 10 mm long: its displacement is 0.5 mm."""
    table = TABLES.make("responses", every=every, scenes=cases).set_index("scene")
    assert list(table.index) == list(every)
    for way in ("course", "wale"):
        of = table.loc[f"dns-isotropic-{way}"]
        assert of["force at 1% strain [N]"] == pytest.approx(2)
        assert of["secant stiffness [N/m]"] == pytest.approx(10 / 0.5e-3)


STIFFNESS = np.array([80e3, 60e3, 900e3])


@pytest.fixture
def scenes(plain_scene):
    course = plain_scene.vary({"fidelity": "hexahedra", "interaction": "isotropic", "name": "course"})
    return {"course": course, "wale": course.replace("name", "wale").replace("load.direction", "wale")}


@pytest.fixture
def touching(contacts):
    return synthetic.contacts_with_springs(contacts, STIFFNESS)


def rows_of(table, axes="global", **values):
    for column, value in values.items():
        table = table[table[column] == value]
    return table[table["axes"] == axes].set_index("axis")


def test_one_row_a_scene_measure_and_axis(touching, scenes, paper):
    both = touching.assign(centreline_relative_displacement=2 * touching["relative_displacement"])
    table = tabulate_springs({"course": touching, "wale": both}, paper, scenes)
    assert len(table) == (1 + 2) * len(READINGS) * 3
    rows = rows_of(table, scene="wale", displacement="centreline")
    for average in (AVERAGED, "mean of F / d [N/m]"):
        np.testing.assert_allclose(rows.loc[list("xyz"), average], STIFFNESS / 2)
    spread = rows_of(table, scene="course")["standard deviation of F / d [N/m]"]
    np.testing.assert_allclose(spread.loc[list("xyz")], 0, atol=1e-6)


def test_numbers_of_the_paper_stand_beside_averages_along_its_axes(touching, scenes, paper):
    table = tabulate_springs({"course": touching, "wale": touching}, paper, scenes)
    for load, printed in study.SPRINGS.items():
        rows = rows_of(table, load=load)
        np.testing.assert_array_equal(rows.loc[list("xyz"), "paper [N/m]"], printed)
        np.testing.assert_allclose(
            rows.loc[list("xyz"), "averaged, over the paper's [1]"], STIFFNESS / printed
        )
    rough = {"course": scenes["course"].replace("interaction", "rough")}
    assert tabulate_springs({"course": touching}, paper, rough)["paper [N/m]"].isna().all()


def test_spread_and_counts(touching, scenes, paper):
    force = touching["force"].to_numpy().copy()
    force[-1, 12] *= [3.0, -1.0, 1.0]
    displacement = touching["relative_displacement"].to_numpy().copy()
    displacement[:, 13, 2] = 0.0
    changed = touching.assign(
        force=(touching["force"].dims, force),
        relative_displacement=(touching["relative_displacement"].dims, displacement),
    )
    table = tabulate_springs({"course": changed}, paper, scenes)
    table = table[table["axes"] == "global"].set_index("axis")
    assert table.loc["x", "largest F / d [N/m]"] == pytest.approx(3 * STIFFNESS[0])
    assert table.loc["y", "smallest F / d [N/m]"] == pytest.approx(-STIFFNESS[1])
    assert table.loc["x", "mean of F / d [N/m]"] == pytest.approx(14 / 12 * STIFFNESS[0])
    counts = table[["crossings [1]", "negative [1]", "undefined [1]", "open [1]"]]
    np.testing.assert_array_equal(counts.loc[["x", "y", "z"]], [[12, 0, 0, 0], [12, 1, 0, 0], [11, 0, 1, 0]])


@pytest.mark.parametrize(("factor", "within", "words"), [(1.0, 6, "all of 6"), (2.0, 0, "0 of 6")])
def test_rules_find_the_paper_and_say_how_far_they_miss(contacts, scenes, paper, factor, within, words):
    """Springs of Table 2 along local axes, x along the course, by the motion of facing points, and twice these."""
    touching = {
        way: synthetic.contacts_with_springs(contacts, factor * np.array(stiffness), "local")
        for way, stiffness in study.SPRINGS.items()
    }
    histories = dict.fromkeys(touching, synthetic.history())
    table = tabulate_rules(touching, histories, paper, scenes).set_index("name")
    nearest = table.loc[NEAREST]
    assert nearest["worst factor [1]"] == pytest.approx(factor)
    assert nearest["springs within 1.5 [1]"] == within
    assert nearest["axes"] == "x along the course"
    assert words in nearest["in words"]
    assert f"{factor:.2f}" in nearest["in words"]
    assert set(table["contact"]) == {"0.45 mm"}
    # With one increment in contact there is no change of force, and forces of both tensions do not meet.
    assert set(table["rule"]) == {"one strain", "course tension by itself", "wale tension by itself"}


def test_one_tension_has_three_springs_and_no_rule_for_both(touching, scenes, paper):
    table = tabulate_rules({"course": touching}, {"course": synthetic.history()}, paper, scenes)
    assert table["rule"].tolist() == ["course tension by itself"]
    assert "of 3 springs" in table["in words"].item()


def test_springs_are_compared_at_the_same_force():
    """Springs that grow with the force are the paper's at 2.5 N in both tensions, whatever the strains there."""
    force = {"course": np.array([0.0, 1.0, 3.0]), "wale": np.array([2.0, 1.9, 6.0])}
    shares = {way: np.repeat(each[:, None] / 2.5, 3, axis=1) for way, each in force.items()}
    shares["course"][0] = np.nan  # nothing touches
    found = list(at_the_same(force, shares))
    assert found[0][0] == pytest.approx(2.0), "the smallest force that both tensions reach"
    assert found[-1][0] == pytest.approx(3.0)
    for value, there in found:
        np.testing.assert_allclose(there["course"], value / 2.5)
        np.testing.assert_allclose(there["wale"], value / 2.5)


def test_hertz_at_right_angles_is_a_sphere_on_a_plane():
    force, modulus, radius = np.array([0.0, 4.0]), 8e8, 0.9e-3
    sphere = (9 * 4.0**2 / (16 * radius * modulus**2)) ** (1 / 3)
    stiffness = hertz_stiffness(force, yarn_pair(radius, 90.0, 6e-3, 0.01), modulus)
    assert np.isnan(stiffness[0])
    assert stiffness[1] == pytest.approx(4.0 / sphere, rel=1e-4)


def test_slip_and_depth_are_those_of_points_in_contact(contacts):
    """One point slips by 3 um along its traction and lies 1 um deep; the other side counts the other way round."""
    crossings = contacts.sizes["crossing"]
    touching = synthetic.contacts_with_springs(contacts, STIFFNESS)
    touching["centreline_relative_displacement"] = touching["relative_displacement"]
    points = {
        "increment": [2, 2],
        "crossing": [5, 5],
        "side": [0, 1],
        "area": [1.0, 3.0],
        "pressure": [2.0, 1.0],
    }
    points |= {"slip": [3e-6, 3e-6], "gap": [-1e-6, -1e-6]}
    vectors = {"position": np.zeros((2, 3)), "reference": np.zeros((2, 3))}
    vectors |= {"traction": [[4.0, 0, 0], [-4.0, 0, 0]], "normal": [[0, 0, 1.0], [0, 0, -1.0]]}
    history = synthetic.history().assign(
        {f"contact_{name}": ("contact_point", np.array(values)) for name, values in points.items()}
        | {f"contact_{name}": (("contact_point", "xyz"), np.array(each)) for name, each in vectors.items()}
    )
    slip = displacements(Simulation(None, {"contacts": touching, "simulation": history}))[SLIP]
    np.testing.assert_allclose(slip[2, 5], [3e-6, 0, 1e-6])
    assert np.isfinite(slip).all(axis=-1).sum() == 1 < crossings, "where nothing touches there is no slip"


def test_ties_are_refused(touching, scenes, paper):
    tied = touching.assign(tied=("crossing", np.ones(touching.sizes["crossing"], dtype=np.int8)))
    with refusal("'course' are all tied"):
        tabulate_springs({"course": tied}, paper, scenes)


def test_counts_of_a_cell_are_those_of_larger_knits(plain_scene, knit_of):
    """Of the meshes of 3 x 3 and 6 x 6 cells."""
    loop = knit_of(plain_scene).loop
    cell = cut_cells(loop, 1, 1)
    slices = law_of(lambda fabric: slices_of(fabric, 0.5, 1.2), cell)
    assert slices(3) == mesh_fabric(cut_cells(loop, 3, 3), 0.5, 1.2, load="course").slices
    assert slices(6) == slices_of(cut_cells(loop, 6, 6), 0.5, 1.2)
    nodes = [
        lambda fabric: network_3d(fabric, 5 / 9).beam_nodes,
        lambda fabric: network_2d(fabric).beam_nodes,
    ]
    spatial, planar = (law_of(count, cell) for count in nodes)
    for n in (3, 6):
        fabric = cut_cells(loop, n, n)
        assert [spatial(n), planar(n)] == [count(fabric) for count in nodes]
        assert planar(n) == 4 * n**2 + 6 * n, "zones, and the ends of 3 n pieces"
