"""Tables against values computed by hand, and the paper's numbers beside them."""

import fnmatch
from pathlib import Path

import numpy as np
import pytest
import synthetic
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.knit.contacts.contacts import extract
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.measures.centre_cell import first_symmetric_contact
from knitstudy.measures.cost import SERIES
from knitstudy.measures.response import distance_of_curves, out_of_plane_correlation, transverse_contraction
from knitstudy.paper.cases import number, numbers
from knitstudy.paper.report.files import READERS
from knitstudy.run.catalogue import FIGURES, TABLES
from knitstudy.run.configuration import CONFIG, load_scenes, load_study
from knitstudy.run.displays import Displays, reference_files
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
    with pytest.raises(DataFileError, match="case 'dns', quantity 'time' is there 0 times"):
        number(paper, "5", "dns", "time")
    with pytest.raises(DataFileError, match="'memory' is 'much'; it must be numbers"):
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


def test_first_symmetric_contact():
    """Left lower alone, then both lower ones: symmetric at increment 2."""
    zones = np.array([[0, 0, 0, 0], [1, 0, 0, 0], [1, 2, 0, 0], [1, 0, 0, 0]])
    touching = contacts(1, 1).assign(zones=(("increment", "crossing"), zones))
    assert first_symmetric_contact(touching) == 2
    assert first_symmetric_contact(touching.isel(increment=slice(0, 2))) is None


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


OTHERS = ("domain-", "cell-", "fabric-acrylic-stockinette-", "fabric-acrylic-rib-", "reference-3x3-tie-")
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


@pytest.mark.parametrize("name", TABLES.names())
def test_every_table_is_made_from_the_files_that_the_workflow_names(offered, results, name):
    def read(source):
        if isinstance(source, list):
            return {scene.name: read((stage, scene)) for stage, scene in source}
        if isinstance(source, Path):
            return READERS[source.suffix](source)
        if source[1].name.startswith("fabric-"):
            way, other = source[1].name.split("-")[-2:]
            return synthetic.fabric_cell(other, way)
        return results[source[0].name].assign_attrs(scene=source[1].name)

    sources = {argument: read(source) for argument, source in offered.sources[name].items()}
    assert len(TABLES.make(name, **sources, scenes=offered.scenes(name)).columns)


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
