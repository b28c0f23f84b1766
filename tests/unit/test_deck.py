import itertools
from types import SimpleNamespace

import meshio
import numpy as np
import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.mesh import Section, Spacing, sweep
from knitstudy.mesh.deck import facet_faces, tied_knit
from knitstudy.mesh.inp import write_inp

# Corners of the faces S1 to S6 of C3D8, from its definition.
FACES = np.array([[1, 2, 3, 4], [5, 8, 7, 6], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 8, 4], [4, 8, 5, 1]]) - 1
RADIUS, CLEARANCE = 0.9, 0.02


class Straight:
    def __init__(self, y):
        self.length, self.y = 6.0, y

    def position(self, s):
        return np.stack([s, np.full_like(s, self.y), np.zeros_like(s)], axis=-1)

    def tangent(self, s):
        return np.ones_like(s)[:, None] * [1.0, 0.0, 0.0]


@pytest.fixture
def mesh():
    return sweep(
        [Straight(0.0), Straight(2 * RADIUS + CLEARANCE)], Section.butterfly(3, 1), RADIUS, Spacing(0.5)
    )


@pytest.fixture
def tie(mesh):
    """One facet of the upper yarn that hangs on one facet of the lower, node by node."""
    slave, master = (
        quads[mesh.nodes[quads].mean(axis=1)[:, 1].argsort(kind="stable")]
        for quads in (mesh.surface_quads(1), mesh.surface_quads(0)[:, [1, 0, 3, 2]])
    )
    nodes = mesh.nodes.copy()
    weight = np.eye(4)
    nodes[slave[0]] = mesh.nodes[master[-1]]
    return SimpleNamespace(
        slave=slave[0],
        master=np.tile(master[-1], (4, 1)),
        weight=weight,
        nodes=nodes,
        adjustment=np.linalg.norm(nodes[slave[0]] - mesh.nodes[slave[0]], axis=1),
    )


@pytest.fixture
def knit():
    return SimpleNamespace(loops=2, rows=1, width=6.0)


def scene(direction="course", lateral="fixed"):
    return SimpleNamespace(
        name="pulled",
        yarn=SimpleNamespace(youngs_modulus=1.3e9, poisson_ratio=0.42),
        load=SimpleNamespace(direction=direction, strain=0.05, lateral=lateral),
        solver=SimpleNamespace(increments=12),
    )


def cards(path):
    """Keyword lines with the data lines that follow each."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("**")]
    starts = [i for i, line in enumerate(lines) if line.startswith("*")] + [len(lines)]
    return [(lines[a], lines[a + 1 : b]) for a, b in itertools.pairwise(starts)]


def data(path, keyword):
    return [rows for card, rows in cards(path) if card.startswith(keyword)]


@pytest.mark.parametrize("yarn", [0, 1])
def test_facets_are_faces_of_their_hexahedra(mesh, yarn):
    facets = mesh.surface_quads(yarn)
    surface = facet_faces(mesh, yarn, np.ones(len(facets), dtype=bool))
    corners = np.take_along_axis(mesh.hexahedra[surface.elements], FACES[surface.faces - 1], axis=1)
    np.testing.assert_array_equal(np.sort(corners, axis=1), np.sort(facets, axis=1))


@pytest.mark.parametrize("dialect", ["abaqus", "calculix"])
@pytest.mark.parametrize("constraints", ["surfaces", "equations"])
def test_another_reader_finds_the_mesh(mesh, tie, knit, tmp_path, dialect, constraints):
    write_inp(tied_knit(scene(), knit, mesh, tie, constraints), tmp_path / "deck.inp", dialect)
    read = meshio.read(tmp_path / "deck.inp")
    expected = tie.nodes if constraints == "equations" else mesh.nodes
    np.testing.assert_allclose(read.points, expected, rtol=1e-12, atol=1e-15)  # 13 digits are written
    np.testing.assert_array_equal(np.vstack([block.data for block in read.cells]), mesh.hexahedra)
    np.testing.assert_array_equal(read.point_sets["LEFT"], np.sort(mesh.end_nodes("left")))
    np.testing.assert_array_equal(read.point_sets["RIGHT"], np.sort(mesh.end_nodes("right")))


def test_numbers_fit_into_what_calculix_reads(mesh, tie, knit, tmp_path):
    write_inp(tied_knit(scene(), knit, mesh, tie, "equations"), tmp_path / "deck.inp", "calculix")
    lines = (tmp_path / "deck.inp").read_text().splitlines()
    numbers = [entry.strip() for line in lines if not line.startswith("*") for entry in line.split(",")]
    assert max(map(len, numbers[1:])) <= 20  # the first line is the title
    assert max(map(len, lines)) <= 132


@pytest.mark.parametrize("dialect", ["abaqus", "calculix"])
def test_ends_are_held_and_driven(mesh, tie, knit, tmp_path, dialect):
    write_inp(tied_knit(scene(), knit, mesh, tie), tmp_path / "deck.inp", dialect)
    (rows,) = data(tmp_path / "deck.inp", "*BOUNDARY")
    entries = [row.replace(" ", "").split(",") for row in rows]
    assert [entry[:3] for entry in entries] == [["LEFT", "1", "3"], ["RIGHT", "1", "1"], ["RIGHT", "2", "3"]]
    assert [float(entry[3]) for entry in entries] == pytest.approx([0.0, 0.05 * 2 * 3.0, 0.0])


def test_free_lateral_ends_are_driven_along_the_load_only(mesh, tie, knit, tmp_path):
    write_inp(tied_knit(scene(lateral="free"), knit, mesh, tie), tmp_path / "deck.inp", "calculix")
    (rows,) = data(tmp_path / "deck.inp", "*BOUNDARY")
    assert [row.split(",")[0] for row in rows] == ["LEFT", "RIGHT"]


def test_increments_are_those_of_the_scene_unless_left_to_the_program(mesh, tie, knit, tmp_path):
    for automatic, keyword in ((False, "*STATIC, DIRECT"), (True, "*STATIC")):
        write_inp(tied_knit(scene(), knit, mesh, tie, automatic=automatic), tmp_path / "deck.inp", "calculix")
        step = [(card, rows) for card, rows in cards(tmp_path / "deck.inp") if card.startswith("*STATIC")]
        assert step == [(keyword, ["1.0, 12.0"])]


def test_tied_surfaces_hold_the_tied_facets(mesh, tie, knit):
    (pair,) = tied_knit(scene(), knit, mesh, tie).ties
    assert pair.slave.elements.size == 1
    corners = mesh.hexahedra[pair.slave.elements[0]][FACES[pair.slave.faces[0] - 1]]
    assert set(corners) == set(tie.slave)
    assert mesh.yarn_of_slice[mesh.slice_of_element[pair.master.elements]].max() == 0
    assert tie.adjustment.max() < pair.tolerance < 1.1 * tie.adjustment.max()


def test_equations_repeat_the_elimination(mesh, tie, knit, tmp_path):
    tie.weight = np.array([[0.25, 0.25, 0.25, 0.25], [1, 0, 0, 0], [0, 0.5, 0.5, 0], [0.1, 0.2, 0.3, 0.4]])
    write_inp(tied_knit(scene(), knit, mesh, tie, "equations"), tmp_path / "deck.inp", "calculix")
    (rows,) = data(tmp_path / "deck.inp", "*EQUATION")
    entries = iter(",".join(rows).replace(" ", "").split(","))
    found = np.zeros((12, 3 * len(mesh.nodes)))
    for k in range(12):
        for _ in range(int(next(entries))):
            node, component, factor = int(next(entries)), int(next(entries)), float(next(entries))
            found[k, 3 * (node - 1) + component - 1] += factor
    for k, (slave, master, weight) in enumerate(zip(tie.slave, tie.master, tie.weight, strict=True)):
        for i in range(3):
            expected = np.zeros(3 * len(mesh.nodes))
            expected[3 * slave + i] = -1
            expected[3 * master + i] = weight
            np.testing.assert_allclose(found[3 * k + i], expected, atol=1e-12)
    assert not data(tmp_path / "deck.inp", "*TIE")


def test_what_is_not_allowed_is_refused(mesh, tie, knit, tmp_path):
    with pytest.raises(ConfigurationError, match="'penalty' is not allowed; one of surfaces, equations"):
        tied_knit(scene(), knit, mesh, tie, "penalty")
    with pytest.raises(ConfigurationError, match=r"load.direction 'wale' has no deck"):
        tied_knit(scene(direction="wale"), knit, mesh, tie)
    with pytest.raises(ConfigurationError, match="'nastran' is not allowed; one of abaqus, calculix"):
        write_inp(tied_knit(scene(), knit, mesh, tie), tmp_path / "deck.inp", "nastran")
    assert not list(tmp_path.iterdir())
