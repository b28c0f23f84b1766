import itertools
from dataclasses import replace
from types import SimpleNamespace

import meshio
import numpy as np
import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.exchange.deck import facet_faces, specimen_deck
from knitstudy.exchange.inp import write_inp
from knitstudy.mesh import Section, Spacing, sweep

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
        crossing=np.zeros(4, dtype=int),
        nodes=nodes,
        adjustment=np.linalg.norm(nodes[slave[0]] - mesh.nodes[slave[0]], axis=1),
        area=np.ones(1),
    )


@pytest.fixture
def knit():
    crossings = SimpleNamespace(row=np.array([0]), yarn=np.array([[0, 1]]), arc_length=np.array([[3.0, 3.0]]))
    return SimpleNamespace(loops=2, rows=1, width=6.0, height=3.0, radius=RADIUS, crossings=crossings)


@pytest.fixture
def scene(plain_scene):
    """Function that makes a scene of solid yarns, of elements of 0.5 m."""
    solid = plain_scene.vary({"name": "pulled", "fidelity": "dns", "mesh.size": 0.5, "solver.increments": 12})

    def make(specimen="knit", interaction="tie", lateral="fixed", path=((0.0, 0.0, 0.0),), **contact):
        load = (
            {"load.lateral": lateral} if specimen == "knit" else {"load.path": path, "pair.support": "ends"}
        )
        touches = {"contact.tangential_stiffness": 5} | {f"contact.{name}": contact[name] for name in contact}
        kind = {"specimen": specimen, "interaction": interaction}
        return solid.vary(kind | load | (touches if interaction != "tie" else {}))

    return make


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
def test_another_reader_finds_the_mesh(mesh, tie, knit, tmp_path, dialect, constraints, scene):
    write_inp(specimen_deck(scene(), knit, mesh, tie, constraints), tmp_path / "deck.inp", dialect)
    read = meshio.read(tmp_path / "deck.inp")
    expected = tie.nodes if constraints == "equations" else mesh.nodes
    np.testing.assert_allclose(read.points, expected, rtol=1e-12, atol=1e-15)  # 13 digits are written
    np.testing.assert_array_equal(np.vstack([block.data for block in read.cells]), mesh.hexahedra)
    np.testing.assert_array_equal(read.point_sets["HELD"], np.sort(mesh.end_nodes("left")))
    np.testing.assert_array_equal(read.point_sets["DRIVEN"], np.sort(mesh.end_nodes("right")))


def test_numbers_fit_into_what_calculix_reads(mesh, tie, knit, tmp_path, scene):
    write_inp(specimen_deck(scene(), knit, mesh, tie, "equations"), tmp_path / "deck.inp", "calculix")
    lines = (tmp_path / "deck.inp").read_text().splitlines()
    numbers = [entry.strip() for line in lines if not line.startswith("*") for entry in line.split(",")]
    assert max(map(len, numbers[1:])) <= 20  # the first line is the title
    assert max(map(len, lines)) <= 132


@pytest.mark.parametrize("dialect", ["abaqus", "calculix"])
def test_ends_are_held_and_driven(mesh, tie, knit, tmp_path, dialect, scene):
    write_inp(specimen_deck(scene(), knit, mesh, tie), tmp_path / "deck.inp", dialect)
    (rows,) = data(tmp_path / "deck.inp", "*BOUNDARY")
    entries = [row.replace(" ", "").split(",") for row in rows]
    assert [entry[:3] for entry in entries] == [["HELD", "1", "3"], *(["DRIVEN", i, i] for i in "123")]
    assert [float(entry[3]) for entry in entries] == pytest.approx([0.0, 0.05 * 2 * 3.0, 0.0, 0.0])


def test_free_lateral_ends_are_driven_along_the_load_only(mesh, tie, knit, tmp_path, scene):
    write_inp(specimen_deck(scene(lateral="free"), knit, mesh, tie), tmp_path / "deck.inp", "calculix")
    (rows,) = data(tmp_path / "deck.inp", "*BOUNDARY")
    assert [row.split(",")[0] for row in rows] == ["HELD", "DRIVEN"]


def test_increments_are_those_of_the_scene_unless_left_to_the_program(mesh, tie, knit, tmp_path, scene):
    for automatic, keyword in ((False, "*STATIC, DIRECT"), (True, "*STATIC")):
        write_inp(
            specimen_deck(scene(), knit, mesh, tie, automatic=automatic), tmp_path / "deck.inp", "calculix"
        )
        step = [(card, rows) for card, rows in cards(tmp_path / "deck.inp") if card.startswith("*STATIC")]
        assert step == [(keyword, ["1.0, 12.0"])]


def test_tied_surfaces_hold_the_tied_facets(mesh, tie, knit, scene):
    (pair,) = specimen_deck(scene(), knit, mesh, tie).ties
    assert pair.slave.elements.size == 1
    corners = mesh.hexahedra[pair.slave.elements[0]][FACES[pair.slave.faces[0] - 1]]
    assert set(corners) == set(tie.slave)
    assert mesh.yarn_of_slice[mesh.slice_of_element[pair.master.elements]].max() == 0
    assert tie.adjustment.max() < pair.tolerance < 1.1 * tie.adjustment.max()


def test_equations_repeat_the_elimination(mesh, tie, knit, tmp_path, scene, contact_deck):
    tie.weight = np.array([[0.25, 0.25, 0.25, 0.25], [1, 0, 0, 0], [0, 0.5, 0.5, 0], [0.1, 0.2, 0.3, 0.4]])
    write_inp(specimen_deck(scene(), knit, mesh, tie, "equations"), tmp_path / "deck.inp", "calculix")
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


@pytest.fixture
def contact_deck(scene):
    """Function that makes a deck of yarns that are not tied."""

    def make(mesh, knit, **options):
        nothing = np.empty(0, dtype=int)
        area = np.full(len(knit.crossings.row), np.nan)
        untied = SimpleNamespace(slave=nothing, crossing=nothing, nodes=mesh.nodes, area=area)
        return specimen_deck(scene(**{"interaction": "isotropic"} | options), knit, mesh, untied)

    return make


def surface_corners(mesh, surface):
    return np.take_along_axis(mesh.hexahedra[surface.elements], FACES[surface.faces - 1], axis=1)


def test_rows_that_are_not_tied_touch(mesh, tie, knit, scene, contact_deck):
    assert not specimen_deck(scene(interaction="isotropic"), knit, mesh, tie).contacts
    (pair,) = contact_deck(mesh, knit).contacts
    for surface, yarn in ((pair.slave, 1), (pair.master, 0)):
        assert set(mesh.yarn_of_slice[mesh.slice_of_element[surface.elements]]) == {yarn}


def test_surfaces_in_contact_hold_what_the_other_yarn_can_reach(mesh, knit, contact_deck):
    """The yarns are parallel, so that every section shows the same facets."""
    (pair,) = contact_deck(mesh, knit).contacts
    upper, lower = (
        mesh.nodes[surface_corners(mesh, surface)].mean(axis=1) for surface in (pair.slave, pair.master)
    )
    every = mesh.nodes[mesh.surface_quads(1)].mean(axis=1)
    distance = np.linalg.norm(every[:, None] - mesh.nodes[mesh.surface_quads(0)].mean(axis=1), axis=2).min(1)
    assert 0 < len(upper) == (distance < RADIUS).sum() < len(every)
    assert len(lower) == len(upper)
    assert upper[:, 1].max() < 2 * RADIUS + CLEARANCE  # the half that faces the other yarn


def test_a_longer_way_widens_the_surfaces(mesh, knit, contact_deck):
    near, far = (
        contact_deck(mesh, knit, specimen="pair", path=((x, 0.0, 0.0),)).contacts[0].slave.elements.size
        for x in (0.0, 2 * RADIUS)
    )
    assert near < far


@pytest.mark.parametrize(
    ("dialect", "normal", "friction"),
    [
        (
            "abaqus",
            ("*SURFACE BEHAVIOR, PENALTY=LINEAR", [2.6e10]),
            ("*FRICTION, ELASTIC SLIP=7.600000000000e-03", [0.76]),
        ),
        (
            "calculix",
            ("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", [2.6e10, 1.0]),
            ("*FRICTION", [0.76, 1.3e10]),
        ),
    ],
)
def test_law_of_contact(mesh, knit, tmp_path, dialect, normal, friction, contact_deck):
    write_inp(contact_deck(mesh, knit), tmp_path / "deck.inp", dialect)
    found = {card: rows for card, rows in cards(tmp_path / "deck.inp")}
    for card, numbers in (normal, friction):
        assert [float(entry) for entry in found[card][0].split(",")] == pytest.approx(numbers)
    assert found["*CONTACT PAIR, INTERACTION=YARNS, TYPE=SURFACE TO SURFACE"] == ["ROW0_SLAVE, ROW0_MASTER"]


def test_stick_stiffness_is_that_of_the_law_at_the_largest_penetration(mesh, knit, contact_deck):
    interaction = contact_deck(mesh, knit).interaction
    law = interaction.law
    pressure = law.normal * interaction.penetration
    assert law.friction * pressure / interaction.elastic_slip == pytest.approx(law.tangential)


def test_rough_contact_and_none(mesh, knit, tmp_path, contact_deck):
    def friction(dialect, **options):
        write_inp(contact_deck(mesh, knit, **options), tmp_path / "deck.inp", dialect)
        return [(card, rows) for card, rows in cards(tmp_path / "deck.inp") if card.startswith("*FRICTION")]

    assert friction("abaqus", interaction="rough") == [("*FRICTION, ROUGH", [])]
    ((_, (line,)),) = friction("calculix", interaction="rough")
    assert float(line.split(",")[0]) >= 1e6
    assert not friction("abaqus", friction=0.0)
    assert not friction("calculix", friction=0.0)


@pytest.mark.parametrize("dialect", ["abaqus", "calculix"])
def test_a_path_is_one_step_a_leg(mesh, knit, tmp_path, dialect, contact_deck):
    path = ((0.0, 0.0, -0.1), (0.2, 0.0, -0.1), (0.0, 0.0, -0.1))
    write_inp(contact_deck(mesh, knit, specimen="pair", path=path), tmp_path / "deck.inp", dialect)
    ends = [
        tuple(float(row.split(",")[3]) for row in rows if row.startswith("DRIVEN"))
        for rows in data(tmp_path / "deck.inp", "*BOUNDARY")
    ]
    increments = [rows[0] for rows in data(tmp_path / "deck.inp", "*STATIC")]
    legs = slice(1, None) if dialect == "calculix" else slice(None)  # a step of rest comes first
    assert ends[legs] == list(path)
    assert increments[legs] == ["1.0, 4.0"] * 3
    read = meshio.read(tmp_path / "deck.inp")
    np.testing.assert_array_equal(read.point_sets["DRIVEN"], np.sort(mesh.slice_nodes([13, 25]).ravel()))


def test_calculix_rests_before_yarns_that_touch_are_moved(mesh, tie, knit, tmp_path, scene, contact_deck):
    write_inp(contact_deck(mesh, knit), tmp_path / "deck.inp", "calculix")
    first, second = data(tmp_path / "deck.inp", "*BOUNDARY")
    assert [float(row.split(",")[3]) for row in first] == [0.0] * 4
    assert [row.split(",")[:3] for row in first] == [row.split(",")[:3] for row in second]
    for deck in (specimen_deck(scene(), knit, mesh, tie), replace(contact_deck(mesh, knit), rests=False)):
        write_inp(deck, tmp_path / "deck.inp", "calculix")
        assert len(data(tmp_path / "deck.inp", "*BOUNDARY")) == 1


def test_what_is_not_allowed_is_refused(mesh, tie, knit, tmp_path, scene):
    with pytest.raises(ConfigurationError, match="'penalty' is not allowed; one of surfaces, equations"):
        specimen_deck(scene(), knit, mesh, tie, "penalty")
    with pytest.raises(ConfigurationError, match="'nastran' is not allowed; one of abaqus, calculix"):
        write_inp(specimen_deck(scene(), knit, mesh, tie), tmp_path / "deck.inp", "nastran")
    assert not list(tmp_path.iterdir())
