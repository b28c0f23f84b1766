"""Decks of a tied knit and of two yarns in contact, read back by meshio and by keyword."""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import meshio
import numpy as np
import pytest
from refusals import READ, refusal

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import initial_loop, lay_out
from knitstudy.knit.geometry.specimens import endless_cell, plain_knit
from knitstudy.knit.mesh.mesher import mesh_scene
from knitstudy.knit.models.hexahedra.build import divide
from knitstudy.mechanics.solids.elements.hexahedron import QuadraticHexahedron
from knitstudy.use.decks.cell import cell_deck
from knitstudy.use.decks.deck import DeckInteraction, specimen_deck
from knitstudy.use.decks.inp import write_inp

E, NU = 1.3e9, 0.42
G, K = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))
DIALECTS = pytest.mark.parametrize("dialect", ["abaqus", "calculix"])


@pytest.fixture(scope="module")
def made(plain_scene):
    """Return a function that gives a deck and its inputs: a tied 1 x 1 knit, or two yarns in contact."""
    knit = {"fidelity": "hexahedra", "pattern.loops": 1, "pattern.rows": 1, "mesh.size": 2 / 3}
    knit |= {"tie.radius": 0.3}
    down = {"pair.support": "ends", "load.path": [[0, 0, -1e-4]], "interaction": "isotropic"}
    pair = {"specimen": "pair", "fidelity": "hexahedra", "mesh.size": 2 / 3} | down
    meshes = {}

    def make(specimen, changes=None):
        scene = plain_scene.vary({"knit": knit, "pair": pair}[specimen] | (changes or {}))
        if specimen not in meshes:
            body = plain_knit(initial_loop(scene), 1, 1) if specimen == "knit" else fabric_of(lay_out(scene))
            meshes[specimen] = body, mesh_scene(scene, body)
        body, mesh = meshes[specimen]
        return SimpleNamespace(
            deck=specimen_deck(scene, body, mesh), scene=scene, mesh=mesh, parts=divide(scene, mesh, body)
        )

    return make


@pytest.fixture
def written(made, tmp_path):
    """Return a function that writes a deck and returns its path."""

    def write(dialect, specimen="knit", changes=None, **deck):
        write_inp(replace(made(specimen, changes).deck, **deck), tmp_path / "deck.inp", dialect)
        return tmp_path / "deck.inp"

    return write


def cards(path):
    """Keyword lines with the data lines that follow each."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("**")]
    starts = [i for i, line in enumerate(lines) if line.startswith("*")] + [len(lines)]
    return [(lines[a], lines[a + 1 : b]) for a, b in itertools.pairwise(starts)]


def data(path, keyword):
    return [rows for card, rows in cards(path) if card.startswith(keyword)]


def boundaries(path):
    return [[row.replace(" ", "").split(",") for row in rows] for rows in data(path, "*BOUNDARY")]


@DIALECTS
@pytest.mark.parametrize(("element", "kind"), [("one_point", "C3D8R"), ("quadratic", "C3D20R")])
@pytest.mark.parametrize("specimen", ["knit", "pair"])
def test_another_reader_finds_the_mesh(made, written, dialect, element, kind, specimen):
    changes = {"mesh.element": element}
    path, parts = written(dialect, specimen, changes), made(specimen, changes).parts
    assert {card.split(",")[1] for card, _ in cards(path) if card.startswith("*ELEMENT,")} == {
        f" TYPE={kind}"
    }
    read = meshio.read(path)
    np.testing.assert_allclose(read.points, parts.nodes, rtol=1e-12, atol=1e-15)  # 13 digits are written
    np.testing.assert_array_equal(np.vstack([block.data for block in read.cells]), parts.connectivity)
    np.testing.assert_array_equal(read.point_sets["HELD"], np.sort(parts.ends.held))
    np.testing.assert_array_equal(read.point_sets["DRIVEN"], np.sort(parts.ends.driven))


@DIALECTS
def test_ends_are_held_and_driven(made, written, dialect):
    path, scene = written(dialect), made("knit").scene
    (rows,) = boundaries(path)
    assert [row[:3] for row in rows] == [["HELD", "1", "3"], *(["DRIVEN", i, i] for i in "123")]
    travel = scene.load.strain * scene.pattern.wale_spacing
    assert [float(row[3]) for row in rows] == pytest.approx([0.0, travel, 0.0, 0.0])
    assert data(path, "*STATIC, DIRECT") == [[f"1.0, {scene.solver.increments}.0"]]


def test_equations_tie_the_moments_of_both_yarns(made, written):
    """The deck has these equations; they let both yarns move as one, and join nothing that is held."""
    deck, parts = made("knit").deck, made("knit").parts
    (rows,) = data(written("calculix"), "*EQUATION")
    entries = iter(",".join(rows).replace(" ", "").split(","))
    held = np.union1d(parts.ends.held, parts.ends.driven)
    equations = deck.equations
    assert len(equations.slave) == 3 * 4  # moments of four crossings
    assert not np.isin(equations.slave, held).any()
    for slave, masters, weights in zip(equations.slave, equations.master, equations.weight, strict=True):
        for component in (1, 2, 3):
            terms = [
                (int(next(entries)), int(next(entries)), float(next(entries)))
                for _ in range(int(next(entries)))
            ]
            assert terms[0] == (slave + 1, component, -1.0)
            actual = np.zeros(len(deck.nodes))
            np.add.at(actual, [node - 1 for node, _, _ in terms[1:]], [value for _, _, value in terms[1:]])
            expected = np.zeros(len(deck.nodes))
            np.add.at(expected, masters, weights)
            np.testing.assert_allclose(actual, expected, atol=1e-12)
            assert {own for _, own, _ in terms} == {component}
    shift = np.array([1e-3, 0, 2e-3])
    rigid = shift + np.cross(deck.nodes, [0.3, -0.2, 0.5])
    followed = np.einsum("km,kmi->ki", equations.weight, rigid[equations.master])
    np.testing.assert_allclose(followed, rigid[equations.slave], atol=1e-12)


@pytest.mark.parametrize(("dialect", "friction", "expected"), READ["contact in decks"])
def test_law_of_contact(made, written, dialect, friction, expected):
    changes = {"contact.friction": friction}
    path, law = written(dialect, "pair", changes), made("pair", changes).deck.interaction.law
    numbers = {"k": law.normal, "mu": law.friction, "t": law.tangential}
    assert law.normal == pytest.approx(10 * E / 0.6e-3)
    for card, entries in expected.items():
        ((row,),) = data(path, card)
        assert [float(entry) for entry in row.split(",")] == pytest.approx(
            [numbers.get(entry, entry) for entry in entries]
        )
    assert bool(data(path, "*FRICTION")) == bool(friction)
    (row,) = data(path, "*CONTACT PAIR, INTERACTION=YARNS, TYPE=SURFACE TO SURFACE")
    assert row == ["YARNS0_1_SLAVE, YARNS0_1_MASTER"]


@DIALECTS
def test_a_path_is_one_step_a_leg(written, dialect):
    """CalculiX rests for a step before yarns that touch are moved."""
    legs = [[0.0, 0.0, -1e-4], [2e-4, 0.0, -1e-4], [0.0, 0.0, -1e-4]]
    path = written(dialect, "pair", {"load.path": legs, "solver.increments": 12})
    ends = [[float(row[3]) for row in rows if row[0] == "DRIVEN"] for rows in boundaries(path)]
    steps = [rows[0] for rows in data(path, "*STATIC")]
    rest = [([0.0] * 3, "1.0, 1.0")] if dialect == "calculix" else []
    assert list(zip(ends, steps, strict=True)) == rest + [(leg, "1.0, 4.0") for leg in legs]
    assert len(boundaries(written(dialect))) == 1


@DIALECTS
@pytest.mark.parametrize(
    ("law", "card", "numbers"),
    [
        ("hencky", "*ELASTIC", [E, NU]),
        ("st_venant_kirchhoff", "*ELASTIC", [E, NU]),
        ("neo_hookean", "*HYPERELASTIC, NEO HOOKE", [G / 2, 2 / K]),
    ],
)
def test_material(written, dialect, law, card, numbers):
    path = written(dialect, changes={"yarn.material": law})
    place = [name for name, _ in cards(path)]
    assert place[place.index("*MATERIAL, NAME=YARN") + 1] == card
    ((row,),) = data(path, card)
    assert [float(entry) for entry in row.split(",")] == pytest.approx(numbers, rel=1e-12)


def remarks(path):
    text = " ".join(line[3:] for line in path.read_text().splitlines() if line.startswith("** "))
    return [sentence.split(":")[0].split(" is ")[0] for sentence in text.split("NOT QUITE THE SCENE: ")[1:]]


@pytest.mark.parametrize(("dialect", "specimen", "changes", "keys"), READ["omissions of decks"])
def test_omissions_of_a_deck_are_named_in_it_and_in_the_log(
    written, caplog, dialect, specimen, changes, keys
):
    base = {"contact.augmentations": 0, "solver.stabilisation": 0} if specimen == "pair" else {}
    path = written(dialect, specimen, base | changes)
    assert remarks(path) == keys
    assert [record.levelname for record in caplog.records] == ["WARNING"] * len(keys)
    assert max(map(len, path.read_text().splitlines())) <= 132


@pytest.mark.parametrize(
    ("dialect", "change", "message"),
    [
        ("nastran", {}, "unknown deck dialect 'nastran'; allowed are abaqus, calculix"),
        (
            "abaqus",
            {"element": "shell"},
            "mesh.element is 'shell'.*allowed are one_point, eight_point, quadratic",
        ),
        ("calculix", {"material": SimpleNamespace(name="mooney")}, "yarn.material is 'mooney'.*allowed are"),
        (
            "calculix",
            {"interaction": DeckInteraction("sticky", None, 0.1)},
            "interaction is 'sticky'.*isotropic, rough",
        ),
    ],
)
def test_scenes_that_no_deck_can_express_are_refused(made, tmp_path, dialect, change, message):
    with refusal(message):
        write_inp(replace(made("knit").deck, **change), tmp_path / "deck.inp", dialect)
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def cell(plain_scene):
    """Return a function that gives a cell of so many rows whose yarns touch, its fabric and its deck."""

    def make(rows=1, **changes):
        keys = {"specimen": "cell", "fidelity": "spline_yarns", "interaction": "isotropic", "mesh.span": 1.8}
        scene = plain_scene.vary(
            keys | {"pattern.loops": 1, "pattern.rows": rows, "load.lateral": "free"} | changes
        )
        fabric = endless_cell(initial_loop(scene), 1, rows)
        return SimpleNamespace(scene=scene, fabric=fabric, deck=cell_deck(scene, fabric))

    return make


@pytest.mark.parametrize("rows", [1, 2])
def test_a_cell_has_every_yarn_and_every_crossing_once(cell, rows):
    made = cell(rows)
    deck, fabric = made.deck, made.fabric
    elements = np.vstack([*deck.elements.values()])
    length = sum(line.length for line in fabric.centrelines[:-1])
    volume = QuadraticHexahedron(deck.nodes[elements], deck.material).volume.sum()
    assert volume == pytest.approx(
        np.pi * fabric.radius**2 * length, rel=2e-3
    )  # arcs of 30 degrees, spans of 1.8 R
    sides = [
        np.concatenate([getattr(pair, side).elements for pair in deck.contacts])
        for side in ("slave", "master")
    ]
    for point in fabric.crossings.point.reshape(-1, 3):
        apart = [
            np.linalg.norm(deck.nodes[elements[side]].mean(axis=1) - point, axis=1).min() for side in sides
        ]
        assert max(apart) < 2.5 * fabric.radius


@pytest.mark.parametrize("rows", [1, 2])
def test_an_even_strain_of_a_cell_meets_its_equations(cell, rows):
    """Both sides of a cut move by E X; a row is cut where it goes on as its image, whole or in pieces."""
    made = cell(rows)
    lengths = np.linalg.norm(made.fabric.periods, axis=1)[[0, 1, 1]]
    x, y, xy = strain = np.array([0.02, -0.01, 0.03])
    even = made.deck.nodes[:, :2] @ [[x, 0.5 * xy], [0.5 * xy, y]]
    for jump in made.deck.jumps:
        moved = np.tile((jump.rate @ (strain * lengths))[:2], (len(jump.slave), 1))
        np.testing.assert_allclose(even[jump.slave] - even[jump.master], moved, atol=1e-15)
    assert sum(len(set(jump.slave)) for jump in made.deck.jumps) == 76 * len(made.deck.jumps)
    assert len(made.deck.jumps) == len(made.deck.elements) == {1: 3, 2: 4}[rows]


@DIALECTS
def test_a_cell_is_written(cell, tmp_path, dialect):
    deck = cell(**{"load.strain": 0.02}).deck
    path = tmp_path / "cell.inp"
    write_inp(deck, path, dialect)
    (rows,) = boundaries(path)[-1:]
    travel = 0.02 * cell().fabric.periods[0, 0]
    assert [row[1] for row in rows] == ["1", "1"]  # the held node, and the course strain: others are free
    assert float(rows[1][3]) == pytest.approx(travel)
    (equations,) = data(path, "*EQUATION")
    assert sum(row.isdigit() for row in equations) == 3 * sum(len(jump.slave) for jump in deck.jumps)
    assert [len(rows) for card, rows in cards(path) if "TYPE=SPRING1" in card] == 3 * [
        len(deck.springs[0][0])
    ]
    assert [len(rows) for card, rows in cards(path) if "TYPE=SPRING2" in card] == [1, 1, 1]
    first = sum(map(len, deck.elements.values())) + 1
    springs = [int(row.split(",")[0]) for card, rows in cards(path) if "TYPE=SPRING" in card for row in rows]
    assert springs == list(range(first, first + len(springs)))
    assert len(data(path, "*SURFACE, NAME")) == 2 * len(deck.contacts)


def test_a_cell_of_beams_has_no_deck(plain_scene):
    keys = {"specimen": "cell", "fidelity": "beam", "interaction": "isotropic", "outputs": ["deck"]}
    with refusal("use fidelity spline_yarns"):
        plain_scene.vary(keys)
