"""Solid yarns as ParaView shows them: read back by VTK, whose own cells are integrated here."""

import meshio
import numpy as np
import pytest
import vtk
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.exchange.vtu import write_solid_yarns
from knitstudy.geometry.lay_out import lay_out, read_specimen
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.spline_yarn.sampling import shape
from knitstudy.mechanics.spline_yarn.space import Space, sections, yarn_space
from knitstudy.models.spline_yarns import space_on, undeformed, yarn_spans

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
    return scene, read_specimen(lay_out(scene))


@pytest.fixture(scope="module")
def space(pair):
    return space_on(pair[0], yarn_spans(*pair))


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


def read(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


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


def test_vtk_takes_the_cells_for_what_they_are(pair, space, tmp_path):
    write_solid_yarns(pair[0], tmp_path / "yarns.vtu", pair[1], history(space, pair[1]))
    grid = read(tmp_path / "yarns.vtu")
    assert {grid.GetCellType(i) for i in range(grid.GetNumberOfCells())} == {vtk.VTK_TRIQUADRATIC_HEXAHEDRON}


def test_volume_surface_and_stress_of_a_uniform_stretch(pair, space, tmp_path):
    scene, specimen = pair
    write_solid_yarns(scene, tmp_path / "yarns.vtu", specimen, history(space, specimen))
    grid = meshio.read(tmp_path / "yarns.vtu")
    exact = 2 * np.pi * specimen.radius**2 * specimen.length
    assert volume(grid, grid.points) == pytest.approx(exact, rel=3e-4)  # arcs of 30 degrees
    moved = grid.points + grid.point_data["displacement"]
    assert volume(grid, moved) == pytest.approx(exact * np.linalg.det(STRETCH), rel=3e-4)
    np.testing.assert_allclose(moved, grid.points @ STRETCH.T + SHIFT, atol=1e-12)

    yarn = scene.yarn
    material = Material(yarn.material, yarn.youngs_modulus, yarn.poisson_ratio)
    second = material.respond(0.5 * (STRETCH.T @ STRETCH - np.eye(3))[None], False).stress[0]
    stress = STRETCH @ second @ STRETCH.T / np.linalg.det(STRETCH)
    principal = np.sort(np.linalg.eigvalsh(stress))[::-1]
    np.testing.assert_allclose(grid.point_data["principal_stress"], [principal] * len(moved), rtol=1e-8)
    a, b, c = principal
    mises = np.sqrt(0.5 * ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2))
    np.testing.assert_allclose(grid.point_data["von_mises"], mises, rtol=1e-8)


def test_surface_points_lie_on_the_true_circle(pair, space, tmp_path):
    scene, specimen = pair
    write_solid_yarns(scene, tmp_path / "yarns.vtu", specimen, history(space, specimen))
    grid = meshio.read(tmp_path / "yarns.vtu")
    for yarn, curve in enumerate(specimen.centrelines):
        here = grid.point_data["yarn"] == yarn
        apart = np.linalg.norm(
            grid.points[here] - curve.position(grid.point_data["arc_length"][here]), axis=1
        )
        on_rim = apart > 0.99 * specimen.radius
        assert on_rim.sum() == 24 * len(np.unique(grid.point_data["arc_length"][here]))
        np.testing.assert_allclose(apart[on_rim], specimen.radius, rtol=1e-9)


def test_pressure_is_on_the_surface_and_adds_up(pair, space, tmp_path):
    """What the drawn surface carries is the force of the points in contact, on the side that they lie on."""
    scene, specimen = pair
    middle = specimen.crossings.point[0]
    towards = middle[1] - middle[0]
    rim = [middle[0] + specimen.radius * towards / np.linalg.norm(towards), middle[1]]
    rim[1] = middle[1] - specimen.radius * towards / np.linalg.norm(towards)
    points = [(0, rim[0], 2e7, 1e-9), (0, rim[0] + [1e-4, 0, 0], 1e7, 1e-9), (1, rim[1], 3e7, 2e-9)]
    write_solid_yarns(scene, tmp_path / "yarns.vtu", specimen, history(space, specimen, points))
    grid = meshio.read(tmp_path / "yarns.vtu")
    pressure, yarn = (grid.point_data[name] for name in ("contact_pressure", "yarn"))
    for number, force in ((0, 0.03), (1, 0.06)):
        touched = np.flatnonzero((pressure > 0) & (yarn == number))
        assert 0 < len(touched) <= 12
        reach = np.linalg.norm(grid.points[touched] - rim[number], axis=1)
        assert reach.max() < 0.8 * specimen.radius
        carried = tributary(grid, number, specimen)
        assert (pressure * carried)[touched].sum() == pytest.approx(force, rel=1e-6)


def tributary(grid, number, specimen):
    """Surface (P,) that points of a straight yarn stand for, by hand: steps along times steps around."""
    data = grid.point_data
    stations = np.unique(data["arc_length"][data["yarn"] == number])
    half = np.convolve(np.diff(stations), [0.5, 0.5])
    along = half[np.searchsorted(stations, data["arc_length"]).clip(0, len(half) - 1)]
    return along * specimen.radius * np.radians(15.0)


def test_without_contact_there_is_no_pressure(pair, space, tmp_path):
    scene, specimen = pair
    bare = history(space, specimen).drop_dims("point")
    write_solid_yarns(scene, tmp_path / "yarns.vtu", specimen, bare)
    assert "contact_pressure" not in meshio.read(tmp_path / "yarns.vtu").point_data


def test_a_history_of_another_discretisation_is_refused(pair, space, tmp_path):
    scene, specimen = pair
    other = history(space, specimen).isel(node=slice(9))
    with pytest.raises(
        DataFileError, match=r"shape \(9, 3\), but the yarns .* coefficients: run the scene again"
    ):
        write_solid_yarns(scene, tmp_path / "yarns.vtu", specimen, other)
    assert not list(tmp_path.iterdir())


def test_sections_are_the_space_at_their_points():
    """Sums along first, then across, are the weighted sums of nodes, where p falls along the yarn as well."""
    rng = np.random.default_rng(2)
    space = Space((yarn_space(np.linspace(0, 1, 6), np.array([2, 2, 4, 4, 2])),))
    nodes, s = rng.standard_normal((space.size, 3)), rng.uniform(0, 1, 7)
    x = rng.uniform(-0.7, 0.7, (5, 2))
    value, slope = sections(space.yarns[0], nodes, s, x)
    at = np.zeros(35, int), np.tile(x, (7, 1)), np.repeat(s, 5)
    place, derivative = shape(space, nodes, *at)
    np.testing.assert_allclose(value.reshape(-1, 3), place, atol=1e-12)
    np.testing.assert_allclose(slope.reshape(-1, 3, 3), derivative, atol=1e-10)
