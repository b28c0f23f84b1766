"""Files for ParaView, read back by meshio; cells of spline yarns are integrated by VTK's own shape functions."""

import meshio
import numpy as np
import pytest
import pyvista
import vtk
import xarray as xr
from synthetic import history_of

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.models.spline_yarns.build import undeformed, undeformed_yarns
from knitstudy.mechanics.materials import material_of
from knitstudy.use.series import write_series
from knitstudy.use.vtu import write_spline_yarns

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
    write_spline_yarns(scene, tmp_path / "yarns.vtu", specimen, bare)
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
    write_spline_yarns(scene, tmp_path / "yarns.vtu", specimen, history(space, specimen, points))
    grid = meshio.read(tmp_path / "yarns.vtu")
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
    stations = history_of(specimen)
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
    path = tmp_path / "series.pvd"
    for count in (3, 2):  # a shorter history leaves nothing of the longer one
        write_series(scene, path, lay_out(scene), data.isel(increment=slice(count)))
        assert len(list((tmp_path / "series").iterdir())) == 2 * count
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
    assert meshio.read(tmp_path / "series" / "contact-0001.vtu").point_data["pressure [Pa]"] == [2e7]
