import itertools
from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar

import meshio
import numpy as np
import pytest
from scipy.optimize import brentq

from knitstudy.errors import ConfigurationError
from knitstudy.exchange.deck import Interaction, facet_faces, specimen_deck
from knitstudy.exchange.dialects import dialect
from knitstudy.exchange.inp import write_inp
from knitstudy.mechanics.materials import Material
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import sweep
from knitstudy.models.facet_tie import FacetTie
from knitstudy.study.kinds import INTERACTIONS

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
    return FacetTie(
        slave=slave[0],
        master=np.tile(master[-1], (4, 1)),
        weight=weight,
        crossing=np.zeros(4, dtype=int),
        nodes=nodes,
        adjustment=np.linalg.norm(nodes[slave[0]] - mesh.nodes[slave[0]], axis=1),
        area=np.ones(1),
        centroid=np.zeros((1, 3)),
        tolerance=0.0,
        facet=0.5,
    )


@pytest.fixture
def knit():
    crossings = SimpleNamespace(row=np.array([0]), yarn=np.array([[0, 1]]), arc_length=np.array([[3.0, 3.0]]))
    return SimpleNamespace(loops=2, rows=1, width=6.0, height=3.0, radius=RADIUS, crossings=crossings)


class Scene(SimpleNamespace):
    def value(self, key):
        found = self
        for part in key.split("."):
            found = getattr(found, part, None)
        return found


def scene(
    specimen="knit",
    interaction="tie",
    lateral="fixed",
    path=(),
    element="one_point",
    material="hencky",
    hourglass=0.005,
    stabilisation=0.0,
    stops=(),
    **contact,
):
    return Scene(
        name="pulled",
        specimen=specimen,
        interaction=interaction,
        kind=SimpleNamespace(interaction=INTERACTIONS.find(interaction)),
        yarn=SimpleNamespace(youngs_modulus=1.3e9, poisson_ratio=0.42, material=material),
        pair=SimpleNamespace(angle=90.0, support="ends"),
        load=SimpleNamespace(direction="course", strain=0.05, lateral=lateral, path=path, stops=stops),
        mesh=SimpleNamespace(size=0.5, smallest=0.5, element=element),
        contact=SimpleNamespace(
            **{
                "friction": 0.76,
                "normal_stiffness": 10,
                "tangential_stiffness": 5,
                "penetration": 0.01,
                "augmentations": 0,
            }
            | contact
        ),
        solver=SimpleNamespace(increments=12, hourglass=hourglass, stabilisation=stabilisation),
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
    write_inp(specimen_deck(scene(), knit, mesh, tie, constraints), tmp_path / "deck.inp", dialect)
    read = meshio.read(tmp_path / "deck.inp")
    expected = tie.nodes if constraints == "equations" else mesh.nodes
    np.testing.assert_allclose(read.points, expected, rtol=1e-12, atol=1e-15)  # 13 digits are written
    np.testing.assert_array_equal(np.vstack([block.data for block in read.cells]), mesh.hexahedra)
    np.testing.assert_array_equal(read.point_sets["HELD"], np.sort(mesh.end_nodes("left")))
    np.testing.assert_array_equal(read.point_sets["DRIVEN"], np.sort(mesh.end_nodes("right")))


def test_numbers_fit_into_what_calculix_reads(mesh, tie, knit, tmp_path):
    write_inp(specimen_deck(scene(), knit, mesh, tie, "equations"), tmp_path / "deck.inp", "calculix")
    lines = (tmp_path / "deck.inp").read_text().splitlines()
    numbers = [entry.strip() for line in lines if not line.startswith("*") for entry in line.split(",")]
    assert max(map(len, numbers[1:])) <= 20  # the first line is the title
    assert max(map(len, lines)) <= 132


@pytest.mark.parametrize("dialect", ["abaqus", "calculix"])
def test_ends_are_held_and_driven(mesh, tie, knit, tmp_path, dialect):
    write_inp(specimen_deck(scene(), knit, mesh, tie), tmp_path / "deck.inp", dialect)
    (rows,) = data(tmp_path / "deck.inp", "*BOUNDARY")
    entries = [row.replace(" ", "").split(",") for row in rows]
    assert [entry[:3] for entry in entries] == [["HELD", "1", "3"], *(["DRIVEN", i, i] for i in "123")]
    assert [float(entry[3]) for entry in entries] == pytest.approx([0.0, 0.05 * 2 * 3.0, 0.0, 0.0])


def test_free_lateral_ends_are_driven_along_the_load_only(mesh, tie, knit, tmp_path):
    write_inp(specimen_deck(scene(lateral="free"), knit, mesh, tie), tmp_path / "deck.inp", "calculix")
    (rows,) = data(tmp_path / "deck.inp", "*BOUNDARY")
    assert [row.split(",")[0] for row in rows] == ["HELD", "DRIVEN"]


def test_increments_are_those_of_the_scene(mesh, tie, knit, tmp_path):
    write_inp(specimen_deck(scene(), knit, mesh, tie), tmp_path / "deck.inp", "calculix")
    step = [(card, rows) for card, rows in cards(tmp_path / "deck.inp") if card.startswith("*STATIC")]
    assert step == [("*STATIC, DIRECT", ["1.0, 12.0"])]


def test_tied_surfaces_hold_the_tied_facets(mesh, tie, knit):
    (pair,) = specimen_deck(scene(), knit, mesh, tie).ties
    assert pair.slave.elements.size == 1
    corners = mesh.hexahedra[pair.slave.elements[0]][FACES[pair.slave.faces[0] - 1]]
    assert set(corners) == set(tie.slave)
    assert mesh.yarn_of_slice[mesh.slice_of_element[pair.master.elements]].max() == 0
    assert tie.adjustment.max() < pair.tolerance < 1.1 * tie.adjustment.max()


def test_equations_repeat_the_elimination(mesh, tie, knit, tmp_path):
    weight = np.array([[0.25, 0.25, 0.25, 0.25], [1, 0, 0, 0], [0, 0.5, 0.5, 0], [0.1, 0.2, 0.3, 0.4]])
    tie = replace(tie, weight=weight)
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


def contact_deck(mesh, knit, **options):
    nothing = np.empty(0, dtype=int)
    area = np.full(len(knit.crossings.row), np.nan)
    untied = SimpleNamespace(slave=nothing, crossing=nothing, nodes=mesh.nodes, area=area)
    return specimen_deck(scene(**{"interaction": "isotropic"} | options), knit, mesh, untied)


def surface_corners(mesh, surface):
    return np.take_along_axis(mesh.hexahedra[surface.elements], FACES[surface.faces - 1], axis=1)


def test_rows_that_are_not_tied_touch(mesh, tie, knit):
    assert not specimen_deck(scene(interaction="isotropic"), knit, mesh, tie).contacts
    (pair,) = contact_deck(mesh, knit).contacts
    for surface, yarn in ((pair.slave, 1), (pair.master, 0)):
        assert set(mesh.yarn_of_slice[mesh.slice_of_element[surface.elements]]) == {yarn}


def test_surfaces_in_contact_hold_what_the_other_yarn_can_reach(mesh, knit):
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


def test_a_longer_way_widens_the_surfaces(mesh, knit):
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
def test_law_of_contact(mesh, knit, tmp_path, dialect, normal, friction):
    write_inp(contact_deck(mesh, knit), tmp_path / "deck.inp", dialect)
    found = {card: rows for card, rows in cards(tmp_path / "deck.inp")}
    for card, numbers in (normal, friction):
        assert [float(entry) for entry in found[card][0].split(",")] == pytest.approx(numbers)
    assert found["*CONTACT PAIR, INTERACTION=YARNS, TYPE=SURFACE TO SURFACE"] == ["ROW0_SLAVE, ROW0_MASTER"]


def test_stick_stiffness_is_that_of_the_law_at_the_largest_penetration(mesh, knit):
    interaction = contact_deck(mesh, knit).interaction
    law = interaction.law
    pressure = law.normal * interaction.penetration
    assert law.friction * pressure / interaction.elastic_slip == pytest.approx(law.tangential)


def test_rough_contact_and_none(mesh, knit, tmp_path):
    def friction(dialect, **options):
        write_inp(contact_deck(mesh, knit, **options), tmp_path / "deck.inp", dialect)
        return [(card, rows) for card, rows in cards(tmp_path / "deck.inp") if card.startswith("*FRICTION")]

    assert friction("abaqus", interaction="rough") == [("*FRICTION, ROUGH", [])]
    ((_, (line,)),) = friction("calculix", interaction="rough")
    assert float(line.split(",")[0]) >= 1e6
    assert not friction("abaqus", friction=0.0)
    assert not friction("calculix", friction=0.0)


@pytest.mark.parametrize("dialect", ["abaqus", "calculix"])
def test_a_path_is_one_step_a_leg(mesh, knit, tmp_path, dialect):
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


def test_calculix_rests_before_yarns_that_touch_are_moved(mesh, tie, knit, tmp_path):
    write_inp(contact_deck(mesh, knit), tmp_path / "deck.inp", "calculix")
    first, second = data(tmp_path / "deck.inp", "*BOUNDARY")
    assert [float(row.split(",")[3]) for row in first] == [0.0] * 4
    assert [row.split(",")[:3] for row in first] == [row.split(",")[:3] for row in second]
    for deck in (specimen_deck(scene(), knit, mesh, tie), replace(contact_deck(mesh, knit), rests=False)):
        write_inp(deck, tmp_path / "deck.inp", "calculix")
        assert len(data(tmp_path / "deck.inp", "*BOUNDARY")) == 1


def test_what_is_not_allowed_is_refused(mesh, tie, knit, tmp_path):
    with pytest.raises(ConfigurationError, match="'penalty' is not allowed; one of surfaces, equations"):
        specimen_deck(scene(), knit, mesh, tie, "penalty")
    with pytest.raises(
        ConfigurationError, match="unknown deck dialect 'nastran'; allowed are abaqus, calculix"
    ):
        write_inp(specimen_deck(scene(), knit, mesh, tie), tmp_path / "deck.inp", "nastran")
    assert not list(tmp_path.iterdir())


E, NU = 1.3e9, 0.42
G, K = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))


@pytest.mark.parametrize(
    ("dialect", "hourglass", "rows"),
    [("abaqus", 0.005, ["1.0"]), ("abaqus", 0.02, ["4.0"]), ("calculix", 0.005, None)],
)
def test_one_point_element_and_its_hourglass_control(mesh, tie, knit, tmp_path, dialect, hourglass, rows):
    deck = specimen_deck(scene(hourglass=hourglass), knit, mesh, tie)
    write_inp(deck, tmp_path / "deck.inp", dialect)
    assert {
        card.split(",")[1] for card, _ in cards(tmp_path / "deck.inp") if card.startswith("*ELEMENT,")
    } == {" TYPE=C3D8R"}
    controls = data(tmp_path / "deck.inp", "*SECTION CONTROLS, NAME=HOURGLASS, HOURGLASS=STIFFNESS")
    assert [[float(row) for row in each] for each in controls] == ([list(map(float, rows))] if rows else [])
    (section,) = [card for card, _ in cards(tmp_path / "deck.inp") if card.startswith("*SOLID SECTION")]
    assert section.endswith("CONTROLS=HOURGLASS") == bool(rows)


@pytest.mark.parametrize("dialect", ["abaqus", "calculix"])
@pytest.mark.parametrize(
    ("law", "card", "numbers"),
    [
        ("hencky", "*ELASTIC", [E, NU]),
        ("st_venant_kirchhoff", "*ELASTIC", [E, NU]),
        ("neo_hookean", "*HYPERELASTIC, NEO HOOKE", [G / 2, 2 / K]),
    ],
)
def test_material(mesh, tie, knit, tmp_path, dialect, law, card, numbers):
    write_inp(specimen_deck(scene(material=law), knit, mesh, tie), tmp_path / "deck.inp", dialect)
    place = [name for name, _ in cards(tmp_path / "deck.inp")]
    assert place[place.index("*MATERIAL, NAME=YARN") + 1] == card
    ((row,),) = data(tmp_path / "deck.inp", card)
    assert [float(entry) for entry in row.split(",")] == pytest.approx(numbers, rel=1e-12)


def remarks(path):
    text = " ".join(line[3:] for line in path.read_text().splitlines() if line.startswith("** "))
    return [sentence.split(":")[0].split(" is ")[0] for sentence in text.split("NOT QUITE THE SCENE: ")[1:]]


@pytest.mark.parametrize(
    ("dialect", "options", "keys"),
    [
        ("abaqus", {}, ["yarn.material"]),
        ("abaqus", {"material": "neo_hookean"}, ["yarn.material"]),
        ("abaqus", {"material": "st_venant_kirchhoff"}, ["yarn.material"]),
        ("abaqus", {"interaction": "rough"}, ["yarn.material"]),
        ("abaqus", {"interaction": "isotropic"}, ["yarn.material", "contact.tangential_stiffness"]),
        ("calculix", {}, ["solver.hourglass", "yarn.material"]),
        ("calculix", {"material": "st_venant_kirchhoff"}, ["solver.hourglass"]),
        ("calculix", {"material": "neo_hookean"}, ["solver.hourglass", "yarn.material"]),
        ("calculix", {"interaction": "rough"}, ["solver.hourglass", "yarn.material", "interaction"]),
        (
            "calculix",
            {"interaction": "isotropic", "stops": (0.01,), "augmentations": 10, "stabilisation": 1e-9},
            [
                "solver.hourglass",
                "yarn.material",
                "load.stops",
                "contact.augmentations",
                "solver.stabilisation",
            ],
        ),
    ],
)
def test_what_a_deck_leaves_unsaid_is_in_it_and_in_the_log(
    mesh, tie, knit, tmp_path, caplog, dialect, options, keys
):
    tied = options.get("interaction", "tie") == "tie"
    deck = specimen_deck(scene(**options), knit, mesh, tie) if tied else contact_deck(mesh, knit, **options)
    write_inp(deck, tmp_path / "deck.inp", dialect)
    assert remarks(tmp_path / "deck.inp") == keys
    assert [record.levelname for record in caplog.records] == ["WARNING"] * len(keys)
    assert max(map(len, (tmp_path / "deck.inp").read_text().splitlines())) <= 132


def uniaxial(law, strain):
    """Nominal stress in simple tension over E, of a law whose lateral stretch leaves no stress."""
    material = Material(law, 1.0, NU)

    def stress(lateral):
        stretch = np.array([1 + strain, lateral, lateral])
        return material.respond(np.diag((stretch**2 - 1) / 2)[None], False).stress[0]

    lateral = brentq(lambda value: stress(value)[1, 1], 1 - 2 * abs(strain), 1 + 2 * abs(strain), xtol=1e-15)
    return (1 + strain) * stress(lateral)[0, 0], lateral


def test_departures_of_laws_are_as_large_as_said():
    strain = 0.01
    (hencky, lateral), (kirchhoff, _) = uniaxial("hencky", strain), uniaxial("st_venant_kirchhoff", strain)
    assert kirchhoff / hencky - 1 == pytest.approx(0.03, abs=0.002)
    # Cauchy stress E ln(lambda) on an area that shrinks by lambda^(-2 nu), for Abaqus.
    logarithmic = np.log1p(strain) * (1 + strain) ** (-2 * NU)
    assert kirchhoff / logarithmic - 1 == pytest.approx(0.03, abs=0.002)
    assert logarithmic / hencky == pytest.approx((1 + strain) * lateral**2, rel=1e-9)  # J


@pytest.mark.parametrize("dialect", ["abaqus", "calculix"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"element": "shell"}, "mesh.element is 'shell'.*has words for one_point, quadratic"),
        (
            {"material": SimpleNamespace(law="mooney", poisson_ratio=NU)},
            "yarn.material is 'mooney'.*has words for hencky, neo_hookean, st_venant_kirchhoff",
        ),
        (
            {"interaction": Interaction("sticky", None, 0.1)},
            "interaction is 'sticky'.*has words for rough, isotropic",
        ),
    ],
)
def test_what_a_dialect_has_no_word_for_is_refused(mesh, tie, knit, tmp_path, dialect, change, message):
    deck = replace(specimen_deck(scene(), knit, mesh, tie), **change)
    with pytest.raises(ConfigurationError, match=message):
        write_inp(deck, tmp_path / "deck.inp", dialect)
    assert not list(tmp_path.iterdir())


def test_a_dialect_is_one_class_that_registers_itself(mesh, tie, knit, tmp_path):
    @dialect.DIALECTS.register
    class Terse(dialect.Dialect):
        name, program = "terse", "Terse"
        elements: ClassVar = {"one_point": lambda deck: dialect.Element("BRICK")}
        materials: ClassVar = {"hencky": lambda material: dialect.Wording("*HENCKY\n")}
        interactions: ClassVar = {}

        def tie(self, name, tolerance):
            return "*GLUE\n"

        def outputs(self, deck):
            return ""

    write_inp(specimen_deck(scene(), knit, mesh, tie), tmp_path / "deck.inp", "terse")
    assert {"*HENCKY", "*GLUE"} <= {card for card, _ in cards(tmp_path / "deck.inp")}
    with pytest.raises(ConfigurationError, match="interaction is 'rough', which Terse has no word for"):
        write_inp(contact_deck(mesh, knit, interaction="rough"), tmp_path / "rough.inp", "terse")
    dialect.DIALECTS.forget("terse")
