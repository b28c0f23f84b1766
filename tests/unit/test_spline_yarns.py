"""Spline yarns: their space, their places, and cells that repeat themselves in a deck."""

import numpy as np
import pytest
import xarray as xr
from refusals import refusal
from scipy.interpolate import BSpline

from knitstudy.knit.mesh.mesher import sampled_sections
from knitstudy.knit.models.spline_yarns.build import discretise
from knitstudy.mechanics.core import basis as disc
from knitstudy.mechanics.core.basis import Spline
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.solids.spline_yarn.space import Space, locate, shape, yarn_space
from knitstudy.mechanics.solids.spline_yarn.span import span_groups
from knitstudy.paper.tables.endless_knit import moduli
from knitstudy.run.configuration import load_scene
from knitstudy.use.decks.fabric import SHELL_ENTRIES, section_matrix, shell_entries, write_shell

BREAKS = np.array([0.0, 0.3, 1.0, 1.4, 2.0, 2.5])
INSIDE = np.random.default_rng(0).uniform(-0.7, 0.7, (20, 2))


@pytest.mark.parametrize("degree", [1, 4, 12])
def test_functions_on_the_disc_are_orthonormal(degree):
    points, weights = disc.quadrature(degree)
    phi = disc.values(degree, points)
    np.testing.assert_allclose(
        phi.T @ (weights[:, None] * phi) / np.pi, np.eye(disc.size(degree)), atol=1e-13
    )


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_splines_and_derivatives(degree):
    spline = Spline.on(BREAKS, degree, sharp=[2])
    s = np.linspace(-0.05, 2.55, 57)
    coefficients = np.random.default_rng(1).normal(size=spline.size)
    reference = BSpline(spline.knots, coefficients, degree)
    first, values = spline.basis(s, orders=2)
    np.testing.assert_allclose(values[0].sum(axis=1), 1.0, atol=1e-13)
    for order in range(3):
        mine = (values[order] * coefficients[first[:, None] + np.arange(degree + 1)]).sum(axis=1)
        np.testing.assert_allclose(mine, reference(s, order), rtol=1e-10, atol=1e-10)


def two_yarns():
    """Two straight yarns of radius 1 that differ in degrees, the second one 5 to the side."""
    yarns = (yarn_space(BREAKS, [2, 2, 4, 3, 2]), yarn_space(BREAKS, 3, 2))
    nodes = []
    for number, yarn in enumerate(yarns):
        s = np.linspace(0, 2.5, 40)
        fixed = np.tile(np.eye(3)[None], (40, 1, 1))
        centre = np.column_stack([0 * s + 5 * number, 0 * s, s])
        c, d1, d2 = (yarn.spline.fit(s, each) for each in (centre, fixed[:, 0], fixed[:, 1]))
        nodes.append(yarn.coefficients(c, d1, d2, 1.0))
    return Space(yarns), np.concatenate(nodes)


def test_places_are_found_again():
    space, nodes = two_yarns()
    yarn, s = np.arange(20) % 2, np.linspace(0.1, 2.4, 20)
    places, _ = shape(space, nodes, yarn, 1.5 * INSIDE, s)
    np.testing.assert_allclose(
        places, np.column_stack([1.5 * INSIDE + [[5, 0]] * yarn[:, None], s]), atol=1e-12
    )
    x, along = locate(space, nodes, places, yarn)
    np.testing.assert_allclose(x, 1.5 * INSIDE, atol=1e-10)
    np.testing.assert_allclose(along, s, atol=1e-10)


@pytest.mark.parametrize(
    ("degree", "message"), [(1, "2.1 at nu = 0.4"), (0, "from 2 to 12"), (13, "from 2 to 12")]
)
def test_degrees_that_are_refused(degree, message):
    with refusal(message):
        yarn_space(BREAKS, degree)


def test_a_yarn_tighter_than_its_radius():
    yarn = yarn_space(np.linspace(0, 2, 9), 2)
    s = np.linspace(0, 2, 60)
    t = 1.2 * s
    centre = np.stack([1 - np.cos(t), 0 * t, np.sin(t)], axis=-1) / 1.2
    d1 = np.stack([np.cos(t), 0 * t, -np.sin(t)], axis=-1)
    d2 = np.tile([0.0, 1.0, 0.0], (60, 1))
    nodes = yarn.coefficients(*(yarn.spline.fit(s, each) for each in (centre, d1, d2)), 1.0)
    with refusal("bent tighter than its radius"):
        span_groups(Space((yarn,)), nodes, Hencky(1.0, 0.3))


@pytest.fixture(scope="module")
def scene(plain_scene):
    return plain_scene.vary(
        {"fidelity": "spline_yarns", "mesh.degree": 3, "mesh.crossing_degree": 4, "mesh.crossing_span": 0.6}
    )


@pytest.fixture(scope="module")
def mesh(knit):
    return sampled_sections(knit)


@pytest.fixture(scope="module")
def yarns(scene, mesh, knit):
    return discretise(scene, knit, mesh)


def test_yarns_are_where_their_centrelines_are(yarns, knit, mesh):
    apart = np.linalg.norm(yarns.sampled(yarns.nodes) - mesh.nodes, axis=1)
    assert apart.max() < 0.02 * mesh.radius  # the curvature of the centreline jumps at control points
    volume = yarns.volume(yarns.groups(yarns.nodes))
    length = sum(curve.length for curve in knit.centrelines)
    assert volume @ yarns.unity == pytest.approx(np.pi * mesh.radius**2 * length, rel=1e-3)
    points = mesh.nodes[mesh.slice_nodes(np.array([7, 60]))].reshape(-1, 3)
    nodes, weights = yarns.locate(points, np.repeat(mesh.yarn_of_slice[[7, 60]], mesh.section.size))
    np.testing.assert_allclose(np.einsum("ka,kai->ki", weights, yarns.nodes[nodes]), points, atol=1e-12)
    np.testing.assert_allclose((weights * yarns.unity[nodes]).sum(axis=1), 1.0, atol=1e-12)


def test_moduli_of_a_sheet():
    compliance = np.array([[1 / 10, -0.2 / 10, 0], [-0.2 / 10, 1 / 40, 0], [0, 0, 1 / 3]])
    assert list(moduli(np.linalg.inv(compliance)).values()) == pytest.approx([10, 40, 3, 0.2, 0.8])


def random_stiffness():
    root = np.random.default_rng(2).standard_normal((6, 6))
    return root @ root.T + 6 * np.eye(6)


def cell_history(strain=0.05, matrix=None):
    matrix = random_stiffness() if matrix is None else matrix
    strains = np.array([[0, 0, 0], [strain, -0.2 * strain, 0]])
    return xr.Dataset(
        {
            "cell_strain": (("increment", "plane"), strains),
            "force_per_width": (("increment", "plane"), np.array([[0, 0, 0], [10 * strain, 0, 0]])),
            "tangent_per_width": (("increment", "plane", "of_plane"), np.stack(2 * [matrix[:3, :3]])),
            "membrane_stiffness": (("plane", "of_plane"), matrix[:3, :3]),
            "coupling_stiffness": (("plane", "of_plane"), matrix[:3, 3:]),
            "bending_stiffness": (("plane", "of_plane"), matrix[3:, 3:]),
        }
    )


def test_the_deck_has_the_section_column_by_column(tmp_path):
    path = tmp_path / "cell.inp"
    write_shell(load_scene("cell-course"), path, cell_history())
    lines = path.read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("*SHELL GENERAL SECTION, ELSET=FABRIC"))
    rows = [[float(value) for value in line.split(",")] for line in lines[at + 1 :]]
    assert [len(row) for row in rows] == [8, 8, 5]
    matrix, numbers = random_stiffness(), np.concatenate(rows)
    assert SHELL_ENTRIES[:7] == ("D11", "D12", "D22", "D13", "D23", "D33", "D14")
    assert (SHELL_ENTRIES[-1], len(SHELL_ENTRIES)) == ("D66", 21)
    for name, number in zip(SHELL_ENTRIES, numbers, strict=True):
        assert number == pytest.approx(matrix[int(name[1]) - 1, int(name[2]) - 1], rel=1e-12)
    np.testing.assert_allclose(section_matrix(cell_history()), matrix)
    np.testing.assert_allclose(shell_entries(matrix), numbers, rtol=1e-12)
