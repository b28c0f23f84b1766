"""Pictures of single results: plots, deformed knits in a page, files for ParaView."""

import base64
import json
import re
import zlib

import matplotlib
import meshio
import numpy as np
import pytest
import pyvista
import synthetic
import vtk
import xarray as xr
from refusals import REFUSED, refusal
from synthetic import history_of as stations_of

from knitstudy.knit.geometry.fabric_file import fabric_dataset, fabric_of
from knitstudy.knit.geometry.lay_out import initial_loop, lay_out
from knitstudy.knit.geometry.specimens import endless_cell, plain_knit
from knitstudy.knit.models.spline_yarns.build import undeformed, undeformed_yarns
from knitstudy.mechanics.materials import material_of
from knitstudy.use import deformed
from knitstudy.use.plot import draw, plot
from knitstudy.use.solids import AROUND
from knitstudy.use.style import figure, save
from knitstudy.use.vtu import solids, spline_grid, write_series


def test_settings_of_a_working_folder_change_no_figure(tmp_path):
    """A `matplotlibrc` there may name TeX, a program that runs commands: pictures are the same beside it."""
    forms = ["external", "internal", "hourglass", "penalty", "friction", "stabilisation"]
    energy = xr.DataArray(np.zeros((3, 6)), dims=("increment", "form"), coords={"form": forms})
    history, paths = (
        synthetic.history(scene="a").assign(energy=energy),
        (tmp_path / "a.png", tmp_path / "b.png"),
    )
    save(draw(history), [paths[0]], {}, "title")
    with matplotlib.rc_context({"text.usetex": True, "lines.linewidth": 20.0, "axes.facecolor": "red"}):
        save(draw(history), [paths[1]], {}, "title")
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_histories_are_drawn_beside_each_other():
    forms = ["external", "internal", "hourglass", "penalty", "friction", "stabilisation"]
    energy = xr.DataArray(np.zeros((3, 6)), dims=("increment", "form"), coords={"form": forms})
    both = [synthetic.history(scene=name).assign(energy=energy) for name in "ab"]
    (axes,) = draw(*both).axes
    assert [line.get_label() for line in axes.get_lines()] == ["a", "b"]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["a", "b"]
    assert axes.get_ylabel() == "reaction force (N)"
    (axes,) = draw(*both * 3).axes
    assert len({(line.get_color(), line.get_marker()) for line in axes.get_lines()}) == 6
    with refusal("a, b: tension, shear and plates do not share axes"):
        draw(both[0], both[1].assign_attrs(axis=2))
    for results, colour in (((), None), (both, "u_z")):
        with refusal("plot takes results of simulate, and one alone where it has a colour"):
            plot(*results, colour=colour)


def test_other_results_are_drawn_alone(knit):
    geometry = synthetic.geometry(knit)
    with refusal("'geometry' cannot be drawn in one picture"):
        draw(geometry, geometry)


RADIUS = 0.4e-3  # not that of the drawn fabric


@pytest.fixture(scope="module")
def knit_of_two(plain_scene):
    return plain_knit(initial_loop(plain_scene), 1, 1)


def history_of(fabric, lift=1e-4, strain=(0.0, 0.05)):
    """Return a history in which all yarns rise by `lift` [m] and stretch along x."""
    stations, strains = stations_of(fabric, size=1e-3), np.array(strain)
    moved = strains[:, None, None] * stations["centreline"].to_numpy() * [1.0, 0.0, 0.0]
    moved[..., 2] += lift * np.arange(len(strains))[:, None]
    slip = np.outer(strains, np.arange(len(fabric.crossings.yarn)) + 1.0)
    return stations.assign(
        strain=("increment", strains),
        centreline_displacement=(("increment", "station", "xyz"), moved),
        crossing_slip=(("increment", "crossing"), slip),
    )


def test_corners_lie_on_the_surface_of_the_deformed_yarns(knit_of_two):
    history = history_of(knit_of_two)
    knit = deformed.deformed(fabric_dataset(knit_of_two), history, RADIUS)
    centres = (history["centreline"] + history["centreline_displacement"][-1]).to_numpy()
    apart = np.linalg.norm(knit.points[-1][:, None] - centres[None], axis=-1).min(axis=1)
    assert apart.max() == pytest.approx(RADIUS, rel=1e-6)
    assert knit.values[-1] == pytest.approx(0.1), "mm"
    assert knit.strain.tolist() == [0.0, 0.05]


def test_the_surface_for_cad_is_closed(knit_of_two, tmp_path):
    """Facets look outwards and leave out nothing: they enclose the volume of the yarns, in mm3."""
    history = history_of(knit_of_two)
    drawn = deformed.deformed(fabric_dataset(knit_of_two), history, knit_of_two.radius)
    deformed.WRITERS[".stl"](drawn, tmp_path / "knit.stl")
    read = meshio.read(tmp_path / "knit.stl")
    corner = read.points[read.cells_dict["triangle"]].astype(float)
    volume = np.linalg.det(corner).sum() / 6
    length = 1e3 * sum(line.length for line in knit_of_two.centrelines)
    assert volume == pytest.approx(np.pi * (1e3 * knit_of_two.radius) ** 2 * length, rel=0.02)


def test_colours_count_from_the_shape_in_which_a_path_begins(knit_of_two):
    """Soft yarns rise from the loops as drawn before they are pulled."""
    history = history_of(knit_of_two)
    at_rest = history["centreline_displacement"] + [0.0, 0.0, 3e-4]
    knit = deformed.deformed(
        fabric_dataset(knit_of_two), history.assign(centreline_displacement=at_rest), RADIUS
    )
    assert knit.values[0] == pytest.approx(0.0, abs=1e-12)
    assert knit.values[-1] == pytest.approx(0.1), "mm"


@pytest.mark.parametrize(("most", "length"), [(7.0, 5.0), (4.9, 2.0), (19.0, 10.0), (0.21, 0.2)])
def test_bars_of_scale_have_round_lengths(most, length):
    assert deformed._round_length(most) == pytest.approx(length)


def test_a_crossing_colours_both_yarns_near_it_alone(knit_of_two):
    values, label = deformed._of_stations(knit_of_two, history := history_of(knit_of_two), "slip")
    assert label == "slip at crossings (mm)"
    s, yarn = history["arc_length"].to_numpy(), history["yarn"].to_numpy()
    for crossing, (yarns, places) in enumerate(
        zip(knit_of_two.crossings.yarn, knit_of_two.crossings.arc_length, strict=True)
    ):
        for own, place in zip(yarns, places, strict=True):
            near = (yarn == own) & (np.abs(s - place) <= knit_of_two.radius)
            assert (values[-1, near] >= 1e3 * 0.05 * (crossing + 1)).all()
    beside = knit_of_two.crossings.yarn[None] == yarn[:, None, None]
    apart = np.where(beside, np.abs(knit_of_two.crossings.arc_length - s[:, None, None]), np.inf).min(
        axis=(1, 2)
    )
    assert (values[-1, apart > 2 * knit_of_two.radius] == 0).all()


@pytest.mark.parametrize("at_rest", [1.0, 0.6])
def test_a_cell_is_drawn_three_times_in_both_directions(plain_scene, at_rest):
    """Yarns go on along the courses; rows stand as far apart as where the path began, which may be a shape at rest."""
    cell = endless_cell(initial_loop(plain_scene), 1, 1)
    history = history_of(cell)
    history["cell_strain"] = (("increment", "plane"), [[0, 0, 0], [0.05, -0.02, 0.1]])
    history.attrs["cell_height"] = apart = at_rest * cell.height
    knit = deformed.deformed(fabric_dataset(cell), history, RADIUS)
    rows = knit.points[-1].reshape(3, -1, 3)
    wale = apart * np.array([0.05, 0.98, 0])
    assert rows[1] - rows[0] == pytest.approx(np.broadcast_to(wale, rows[0].shape), abs=1e-9)
    one = (history["centreline"] + history["centreline_displacement"][-1]).to_numpy()
    course = cell.periods[0] * [1.05, 1, 1]
    copies = np.concatenate([one + number * course for number in range(3)])
    ends = np.linalg.norm(rows[0][:, None] - copies, axis=-1).min(axis=1) < 1e-9  # middles of caps
    assert ends.sum() == 2 * AROUND * len(cell.centrelines), "a yarn has two ends"


def test_yarns_of_beams_go_on_to_the_image_of_their_first_node(plain_scene):
    """Histories of beams leave it out; the outline is that of the undeformed cell, in the middle."""
    cell = endless_cell(initial_loop(plain_scene), 1, 1)
    history = history_of(cell)
    stations = [s < cell.centrelines[0].length * (1 - 1e-9) for s in history["arc_length"].to_numpy()]
    history = history.isel(station=np.flatnonzero(stations))
    history["cell_strain"] = (("increment", "plane"), [[0, 0, 0], [0.05, 0, 0]])
    history.attrs |= {"cell_width": cell.width, "cell_height": cell.height}
    knit = deformed.deformed(fabric_dataset(cell), history, RADIUS)
    assert np.ptp(knit.points[-1][:, 0]) == pytest.approx(3 * 1.05 * cell.width, abs=2 * RADIUS)
    corners = deformed._outline(knit)
    assert np.ptp(corners, axis=0) == pytest.approx([cell.width, cell.height, 0.0])
    low, high = knit.points[-1].min(axis=0), knit.points[-1].max(axis=0)
    assert corners[:4].mean(axis=0) == pytest.approx(0.5 * (low + high))


@pytest.mark.parametrize(("colour", "message"), REFUSED["colours"])
def test_a_colour_that_the_history_lacks_is_refused(knit_of_two, colour, message):
    with refusal(message):
        deformed.deformed(fabric_dataset(knit_of_two), history_of(knit_of_two), RADIUS, colour=colour)


def test_solids_of_a_history_without_fields_are_refused(pair):
    with refusal(r"--set outputs=\[fields\]"):
        solids(pair[0], lay_out(pair[0]), None, xr.Dataset())


def test_a_page_holds_the_knit_and_loads_nothing(knit_of_two, tmp_path, monkeypatch):
    knit = deformed.deformed(fabric_dataset(knit_of_two), history_of(knit_of_two), RADIUS)
    deformed.write_page(knit, tmp_path / "knit.html", "a <knit>")
    page = (tmp_path / "knit.html").read_text()
    data = json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.DOTALL)[1])
    raw = np.frombuffer(zlib.decompress(base64.b64decode(data["places"])), "<u2").reshape(2, -1, 3)
    low, reach = 1e3 * knit.points.min(axis=(0, 1)), 1e3 * np.ptp(knit.points, axis=(0, 1)).max()
    assert low + reach * raw / 65535 == pytest.approx(1e3 * knit.points, abs=reach / 65535)
    assert data["title"] == "a <knit>"
    assert not re.search(r'(?:src|href)="', page)
    monkeypatch.setattr(deformed, "MOST", knit.points.shape[1])
    deformed.write_page(knit, tmp_path / "last.html", "a")
    assert '"strain": [0.05]' in (tmp_path / "last.html").read_text(), (
        "full load alone, where there is no room"
    )


def test_increments_of_an_animation_are_spread_evenly():
    assert deformed._spread(3, 24).tolist() == [0, 1, 2]
    assert deformed._spread(50, 5).tolist() == [0, 12, 24, 37, 49]


def test_an_animation_says_how_far_it_is(knit_of_two, tmp_path, monkeypatch):
    """A picture takes seconds: a user would wait in silence for all of them."""
    monkeypatch.setattr(deformed, "draw", lambda knit, increment: figure(1.0, 1.0))
    knit, shares = deformed.deformed(fabric_dataset(knit_of_two), history_of(knit_of_two), RADIUS), []
    deformed.animate(knit, tmp_path / "knit.webp", "", lambda done, note: shares.append(done))
    assert shares == [0.5, 1.0]
    assert (tmp_path / "knit.webp").exists()


STRETCH = np.array([[1.02, 0.05, 0.0], [0.0, 0.97, 0.01], [-0.03, 0.0, 1.01]])
SHIFT = np.array([1e-4, -2e-4, 3e-4])

SHARE, WEIGHT = np.polynomial.legendre.leggauss(3)


@pytest.fixture(scope="module")
def pair(plain_scene):
    keys = {
        "specimen": "pair",
        "fidelity": "spline_yarns",
        "pair.support": "ends",
        "outputs": ["fields", "vtu"],
    }
    scene = plain_scene.vary(keys | {"interaction": "isotropic", "load.path": [[0, 0, -1e-5]]})
    return scene, fabric_of(lay_out(scene))


@pytest.fixture(scope="module")
def space(pair):
    return undeformed_yarns(*pair)[0]


def history(space, specimen, points=()):
    """A history in which every yarn is stretched uniformly, with points in contact: yarn, place, pressure, area."""
    nodes = undeformed(space, specimen)
    moved = nodes @ (STRETCH - np.eye(3)).T + space.unity[:, None] * SHIFT
    columns = [np.array(column) for column in zip(*points, strict=True)] or [np.empty(0, int)] * 4
    yarn, place, pressure, area = columns
    return xr.Dataset(
        {
            "strain": ("increment", np.arange(2.0)),
            "node_displacement": (("node", "xyz"), moved),
            "contact_increment": ("point", np.ones(len(yarn), int)),
            "contact_yarn": ("point", yarn),
            "contact_reference": (("point", "xyz"), place.reshape(-1, 3)),
            "contact_pressure": ("point", pressure),
            "contact_area": ("point", area),
        }
    )


def volume(grid, places):
    """Sum of the Jacobian of all cells, by VTK's own shape functions, with nodes at places (P, 3); all are positive."""
    gradients = np.empty((27, 3, 27))
    cell, row = vtk.vtkTriQuadraticHexahedron(), [0.0] * 81
    at = 0.5 * (np.stack(np.meshgrid(SHARE, SHARE, SHARE), axis=-1).reshape(-1, 3) + 1)
    for number, place in enumerate(at):
        cell.InterpolateDerivs(place, row)
        gradients[number] = np.reshape(row, (3, 27))
    weight = np.einsum("i,j,k->ijk", WEIGHT, WEIGHT, WEIGHT).ravel() / 8
    jacobian = np.linalg.det(gradients @ places[grid.cells_dict["hexahedron27"]][:, None])
    assert jacobian.min() > 0
    return (jacobian @ weight).sum()


def test_volume_surface_and_stress_of_a_uniform_stretch(pair, space, tmp_path):
    scene, specimen = pair
    bare = history(space, specimen).drop_dims("point")
    spline_grid(scene, specimen, bare).write(tmp_path / "yarns.vtu")
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "yarns.vtu"))
    reader.Update()
    assert reader.GetOutput().GetCellType(0) == vtk.VTK_TRIQUADRATIC_HEXAHEDRON
    grid = meshio.read(tmp_path / "yarns.vtu")
    assert "contact_pressure [Pa]" not in grid.point_data
    exact = 2 * np.pi * specimen.radius**2 * specimen.centrelines[0].length
    assert volume(grid, grid.points) == pytest.approx(exact, rel=3e-4)  # arcs of 30 degrees
    moved = grid.points + grid.point_data["displacement [m]"]
    assert volume(grid, moved) == pytest.approx(exact * np.linalg.det(STRETCH), rel=3e-4)
    np.testing.assert_allclose(moved, grid.points @ STRETCH.T + SHIFT, atol=1e-12)

    yarn = scene.yarn
    material = material_of(yarn)
    second = material.respond(0.5 * (STRETCH.T @ STRETCH - np.eye(3))[None], False).stress[0]
    stress = STRETCH @ second @ STRETCH.T / np.linalg.det(STRETCH)
    principal = np.sort(np.linalg.eigvalsh(stress))[::-1]
    np.testing.assert_allclose(grid.point_data["principal_stress [Pa]"], [principal] * len(moved), rtol=1e-8)
    a, b, c = principal
    mises = np.sqrt(0.5 * ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2))
    np.testing.assert_allclose(grid.point_data["von_mises [Pa]"], mises, rtol=1e-8)


def test_pressure_is_on_the_surface_and_adds_up(pair, space, tmp_path):
    """The drawn surface carries the force of the points in contact, on the side that they lie on."""
    scene, specimen = pair
    middle = specimen.crossings.point[0]
    towards = specimen.radius * (middle[1] - middle[0]) / np.linalg.norm(middle[1] - middle[0])
    rim = middle[0] + towards, middle[1] - towards
    points = [(0, rim[0], 2e7, 1e-9), (0, rim[0] + [1e-4, 0, 0], 1e7, 1e-9), (1, rim[1], 3e7, 2e-9)]
    grid = spline_grid(scene, specimen, history(space, specimen, points))
    pressure, yarn = (grid.point_data[name] for name in ("contact_pressure [Pa]", "yarn"))
    for number, force in ((0, 0.03), (1, 0.06)):
        touched = np.flatnonzero((pressure > 0) & (yarn == number))
        assert 0 < len(touched) <= 12
        reach = np.linalg.norm(grid.points[touched] - rim[number], axis=1)
        assert reach.max() < 0.8 * specimen.radius
        # Surface of a straight yarn that a node stands for: half the steps beside it, times 15 degrees.
        arc_length = grid.point_data["arc_length [m]"]
        stations = np.unique(arc_length[yarn == number])
        along = np.convolve(np.diff(stations), [0.5, 0.5])[np.searchsorted(stations, arc_length[touched])]
        carried = along * specimen.radius * np.radians(15.0)
        assert (pressure[touched] * carried).sum() == pytest.approx(force, rel=1e-6)


def test_a_time_series_holds_all_increments(pair, space, tmp_path):
    """Yarns of every increment, and the points in contact of those where yarns touch."""
    scene, specimen = pair
    stations = stations_of(specimen)
    rise = np.arange(3.0)[:, None, None] * np.full((1, stations.sizes["station"], 3), 1e-5)
    data = stations.assign(
        history(space, specimen, [(0, specimen.crossings.point[0, 0], 2e7, 1e-9)]).drop_vars("strain")
    )
    data = data.assign(
        load=("increment", [0.0, 0.5, 1.0]),
        strain=("increment", [0.0, 0.1, 0.0]),  # turns back: load factors are the times
        centreline_displacement=(("increment", "station", "xyz"), rise),
        contact_position=data["contact_reference"] + 1e-6,
    )
    data["contact_pressure"].attrs["units"] = "Pa"
    path, mine = tmp_path / "series.pvd", tmp_path / "series" / "my-mesh-2.vtu"
    mine.parent.mkdir()
    mine.touch()
    with refusal(r"series: must end with \.pvd"):
        write_series(scene, path.with_suffix(""), lay_out(scene), data)
    for count in (3, 2):  # a shorter history leaves nothing of the longer one
        write_series(scene, path, lay_out(scene), data.isel(increment=slice(count)))
        assert len(list((tmp_path / "series").iterdir())) == 2 * count + mine.exists()
    write_series(scene, path, lay_out(scene), data)
    reader = pyvista.get_reader(path)
    assert reader.time_values == [0.0, 0.5, 1.0]
    for time, touching in zip(reader.time_values, (0, 1, 0), strict=True):
        reader.set_active_time_value(time)
        yarns, contact, *_ = reader.read()  # and solids at full load
        assert yarns.n_cells == len(rise[0]) - 2, "no line joins the two yarns"
        np.testing.assert_allclose(yarns["displacement [m]"], 2e-5 * time)
        assert {"arc_length [m]", "radius [m]", "yarn"} <= set(yarns.point_data.keys())
        assert contact.n_points == touching
    assert pyvista.read(path.with_suffix(".vtm")).keys() == ["yarns", "contact", "solids"]
    assert meshio.read(tmp_path / "series" / "contact-0001.vtu").point_data["pressure [Pa]"] == [2e7]
