"""Fabrics: crossings that are found from curves, grips, pieces, files of one's own."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from refusals import refusal

from knitstudy.datasets import write_dataset
from knitstudy.knit.geometry import readers
from knitstudy.knit.geometry.crossings import crossings_of_loop, windows_of_loop
from knitstudy.knit.geometry.fabric import Grip, of_curves
from knitstudy.knit.geometry.fabric_file import fabric_dataset, fabric_of
from knitstudy.knit.geometry.lay_out import initial_loop, lay_out
from knitstudy.knit.geometry.loop import LoopTarget
from knitstudy.knit.geometry.readers import centreline, read_fabric
from knitstudy.knit.geometry.specimens import cut_cells, endless_cell, middles_of_legs, plain_knit, yarn_pair
from knitstudy.knit.geometry.spline import CatmullRom, Centreline
from knitstudy.knit.loading.solve import solve_load_path
from knitstudy.knit.mesh.mesher import sampled_sections
from knitstudy.knit.models.beam import build as beams_in_contact
from knitstudy.knit.models.spline_yarns import build as spline_yarns
from knitstudy.knit.simulate import build
from knitstudy.run.configuration import load_scene

RADIUS = 0.9e-3


@pytest.fixture(scope="module")
def loop(plain_scene):
    return initial_loop(plain_scene)


@pytest.mark.parametrize(("loops", "rows"), [(1, 1), (3, 2), (2, 4)])
def test_crossings_of_a_knit_are_those_of_one_cell_moved(loop, loops, rows):
    crossings = plain_knit(loop, loops, rows).crossings
    unit = loop.in_radii()
    lower, _, windows = windows_of_loop(unit)
    cell = crossings_of_loop(unit, lower, windows, 100)
    row, column, zone = (each.ravel() for each in np.indices((rows, loops, 4)))
    for name, expected in (("row", row), ("column", column), ("zone", zone)):
        np.testing.assert_array_equal(getattr(crossings, name), expected)
    np.testing.assert_array_equal(crossings.yarn, row[:, None] + [0, 1])
    moved = np.column_stack([column * loop.wale_spacing, row * loop.course_spacing, 0 * row])[:, None]
    np.testing.assert_allclose(
        crossings.point, cell.point[zone] * loop.radius + moved, atol=1e-9 * loop.radius
    )
    np.testing.assert_allclose(crossings.distance, cell.distance[zone] * loop.radius, rtol=1e-9)


def straight(start, end):
    """A straight yarn between two points, as an arc of a curve that goes on."""
    step = (np.asarray(end, dtype=float) - start) / 4
    line = Centreline(CatmullRom(start + np.arange(6)[:, None] * step, 6 * step), 1)
    return line.part(0.0, 4 * np.linalg.norm(step))


def test_crossings_of_any_curves_are_common_perpendiculars():
    up = 2.1 * RADIUS
    first = straight([-0.02, 0, 0], [0.02, 0.001, 0.0005])
    others = [straight([x - 0.004, -0.01, up], [x + 0.005, 0.012, up]) for x in (-0.013, -0.002, 0.0101)]
    fabric = of_curves([first, *others], RADIUS)
    crossings = fabric.crossings
    np.testing.assert_array_equal(crossings.yarn, [[0, 1], [0, 2], [0, 3]])
    apart = crossings.point[:, 1] - crossings.point[:, 0]
    for side in (0, 1):
        places = zip(crossings.yarn[:, side], crossings.arc_length[:, side : side + 1], strict=True)
        along = np.concatenate([fabric.centrelines[yarn].tangent(s) for yarn, s in places])
        np.testing.assert_allclose(np.einsum("ki,ki->k", apart, along), 0, atol=1e-12)


def test_a_yarn_crosses_itself():
    """A trochoid with three turns crosses itself in each, where its height has opposite signs."""
    t = np.linspace(-np.pi, np.pi, 24, endpoint=False)
    points = np.column_stack([2e-3 * t - 7e-3 * np.sin(t), -7e-3 * np.cos(t), 1.2 * RADIUS * np.sin(t)])
    yarn = Centreline(CatmullRom(points, [4e-3 * np.pi, 0, 0]), 3)
    actual = of_curves([yarn], RADIUS).crossings
    assert actual.yarn.tolist() == [[0, 0]] * 3
    np.testing.assert_allclose(
        actual.arc_length.sum(axis=1), np.array([1, 3, 5]) / 3 * yarn.length, rtol=1e-6
    )
    assert np.all(np.abs(np.diff(actual.point, axis=1)[:, 0, 2]) > 1.5 * RADIUS)


def test_yarns_that_pass_far_apart_do_not_cross():
    lines = [straight([-0.01, 0, 0], [0.01, 0, 0]), straight([0, -0.01, 4 * RADIUS], [0, 0.01, 4 * RADIUS])]
    assert len(of_curves(lines, RADIUS).crossings) == 0


def test_grips_of_a_knit(loop):
    knit = plain_knit(loop, 3, 2)
    held, driven = knit.grips["course"]
    assert held.yarn.tolist() == driven.yarn.tolist() == [0, 1, 2]
    assert not held.arc.any()
    held, driven = knit.grips["wale"]
    assert set(held.yarn) == {0}
    assert set(driven.yarn) == {2}
    assert len(knit.grip_ends("wale")[0]) == 6  # half a sinker at each end of the yarn
    assert len(knit.grip_ends("wale")[2]) == 6
    assert knit.grip_ends("course") == {}
    assert held.holds([0, 0, 1], [0.0, held.arc[1].mean(), 0.0]).tolist() == [True, True, False]


def test_cut_cells_have_the_yarn_of_an_endless_knit(loop):
    cells, cell = cut_cells(loop, 3, 2), endless_cell(loop, 3, 2)
    assert np.isclose(sum(line.length for line in cells.centrelines), 6 * loop.length)
    assert len(cells.crossings.zone) == len(cell.crossings.zone) == 24
    np.testing.assert_allclose(cells.crossings.point, cell.crossings.point)
    assert not cell.grips
    np.testing.assert_allclose(cell.periods, [[3 * loop.wale_spacing, 0, 0], [0, 2 * loop.course_spacing, 0]])


def test_rows_too_far_apart_to_cross_are_refused(loop):
    with refusal("cross 0 times"):
        plain_knit(replace(loop, course_spacing=10 * loop.course_spacing), 1, 1)


def test_a_file_that_holds_no_fabric_is_refused(loop):
    dataset = fabric_dataset(plain_knit(loop, 1, 1))
    with refusal(r"\['curve_points'\] are missing"):
        fabric_of(dataset.drop_vars("curve_points"))


RADIUS_FILE = 0.1e-3
PITCH = 20 / 3 * RADIUS_FILE


def wave(shift, sign):
    """A yarn along x that passes over and under others."""
    x = np.linspace(0, 4 * PITCH, 17)
    return np.stack([x, np.full(17, shift), sign * 1.05 * RADIUS_FILE * np.cos(np.pi * x / PITCH)], axis=1)


def warp(shift, sign):
    return wave(shift, sign)[:, [1, 0, 2]] + [0, -PITCH, 0]


YARNS = [wave(0.0, 1), wave(PITCH, -1), warp(PITCH, -1), warp(2 * PITCH, 1)]


def weave():
    """Two wefts and two warps of a plain weave."""
    return of_curves([centreline(each) for each in YARNS], RADIUS_FILE)


def test_models_take_any_fabric(plain_scene):
    """Wefts of a weave that are pulled: tied solid yarns, and beams that touch with friction."""
    wefts, fabric = np.array([0, 1]), weave()
    ends = np.array([fabric.centrelines[yarn].length for yarn in wefts])[:, None] * [1, 1]
    fabric = replace(fabric, grips={"course": (Grip(wefts, 0 * ends), Grip(wefts, ends))})
    thin = {"yarn.diameter": 2 * RADIUS_FILE, "load.strain": 0.01, "solver.increments": 1}
    scene = plain_scene.vary(thin)
    solid = scene.vary({"fidelity": "spline_yarns"})
    beams = scene.vary({"fidelity": "beam", "interaction": "isotropic", "contact.tied_edges": "none"})
    solids = solve_load_path(spline_yarns.build(solid, fabric, sampled_sections(fabric)))
    touching = solve_load_path(beams_in_contact.build(beams, fabric))
    assert float(solids["force"][-1]) == pytest.approx(float(touching["force"][-1]), rel=0.1)


def test_corrections_of_a_cell_end_where_contact_is_searched():
    """A correction that shuts a free cell brings all points of all yarns into contact, which takes hours."""
    cell = load_scene("cell-course").vary({"interaction": "isotropic"})
    problem = build(cell, fabric_of(lay_out(cell)))
    model, step = problem.model, np.zeros(problem.model.size)
    assert problem.settings.stride == model.model.contact.margin
    step[model.lattice[0]] = width = 1e-3  # images move with the cell
    assert 0.5 * width < model.motion_of_neighbours(model.start(), step) < 1.01 * width


def garter():
    return LoopTarget(0.9e-3, 1.1e-3, RADIUS_FILE, 0.01, stitches=("K", "P")).drawn()


MADE = {
    "knit": lambda loop: plain_knit(loop, 2, 3),
    "cut_knit": lambda loop: cut_cells(loop, 2, 1),
    "cell": lambda loop: endless_cell(garter(), 1, 2),
    "pair": lambda loop: yarn_pair(RADIUS_FILE, 60.0, 2e-3, 0.1),
    "curves": lambda loop: weave(),
}


@pytest.mark.parametrize("kind", MADE)
def test_a_fabric_comes_back_whole(knit, tmp_path, kind):
    fabric = MADE[kind](knit.loop)
    write_dataset(fabric_dataset(fabric), tmp_path / "a.nc")
    again = read_fabric(tmp_path / "a.nc")
    assert len(again.centrelines) == len(fabric.centrelines)
    for one, other in zip(again.centrelines, fabric.centrelines, strict=True):
        s = np.linspace(0, other.length, 7)
        assert one.position(s) == pytest.approx(other.position(s), abs=1e-9 * RADIUS_FILE)
    for name in ("size", "copy_of", "shift", "periods", "cell", "radius", "clearance", "repeats", "angle"):
        np.testing.assert_array_equal(getattr(again, name), getattr(fabric, name), err_msg=name)
    for name in vars(fabric.crossings):
        np.testing.assert_array_equal(getattr(again.crossings, name), getattr(fabric.crossings, name))
    assert again.grips.keys() == fabric.grips.keys()
    for load, pair in fabric.grips.items():
        for one, other in zip(again.grips[load], pair, strict=True):
            np.testing.assert_array_equal(one.yarn, other.yarn)
            np.testing.assert_array_equal(one.arc, other.arc)
            assert (one.side is None) == (other.side is None)
    assert (again.loop is None, again.sample is None) == (fabric.loop is None, fabric.sample is None)
    assert fabric_dataset(again).equals(fabric_dataset(fabric))


def table(**changes):
    rows = [(number, *point, RADIUS_FILE) for number, points in enumerate(YARNS) for point in points]
    return pd.DataFrame(rows, columns=list(readers.COLUMNS)).assign(**changes)


def test_a_table_of_centrelines_is_a_fabric(tmp_path):
    table().to_csv(tmp_path / "weave.csv", index=False)
    fabric = read_fabric(tmp_path / "weave.csv")
    assert len(fabric.crossings) == 4
    assert fabric.centrelines[0].position(np.zeros(1)) == pytest.approx(YARNS[0][:1], abs=1e-12)
    assert fabric_of(fabric_dataset(fabric)).radius == RADIUS_FILE


@pytest.mark.parametrize(
    ("spoilt", "message"),
    [
        (table(**{"radius [m]": 0.0}), r"column radius \[m\] holds \[0\.0\]"),
        (table()[:3], "a yarn has 3 points"),
        (table(**{"y [m]": "2 mm"}), r"row 2, column y \[m\] holds '2 mm' but must be a number"),
        (
            table(**{"radius [m]": 1e-3}),
            r"yarns overlap: .* m apart where they cross, .* radii less than a diameter",
        ),
        (table().drop(columns="z [m]"), r"z \[m\]"),
    ],
)
def test_a_table_that_is_no_fabric_is_refused(tmp_path, spoilt, message):
    spoilt.to_csv(tmp_path / "a.csv", index=False)
    with refusal(message):
        read_fabric(tmp_path / "a.csv")


def test_a_table_in_millimetres(tmp_path):
    names = {name: name.replace("[m]", "[mm]") for name in readers.COLUMNS}
    lengths = {name: 1e3 for name in readers.COLUMNS[1:]}
    (table() * ({"yarn": 1} | lengths)).rename(columns=names).to_csv(tmp_path / "a.csv", index=False)
    assert read_fabric(tmp_path / "a.csv").radius == pytest.approx(RADIUS_FILE)


def test_millimetres_that_are_called_metres_are_questioned(tmp_path, caplog):
    (table() * ({"yarn": 1} | {name: 1e3 for name in readers.COLUMNS[1:]})).to_csv(
        tmp_path / "a.csv", index=False
    )
    read_fabric(tmp_path / "a.csv")
    assert "lengths in mm?" in caplog.text


ROUND = '<Section type="CSectionEllipse" Width="{0}" Height="{0}"/>'


def texgen(path, yarns, repeats=(), section=ROUND, scale="mm", nodes="MasterNode"):
    """Write yarns through points [m] as TexGen does, with lengths in mm."""
    text = f'<?xml version="1.0" ?>\n<TexGenModel version="3.14.0"><Textile GeometryScale="{scale}">'
    for points in yarns:
        text += "<Yarn>" + section.format(2e3 * RADIUS_FILE)
        text += "".join(f'<Repeat value="{x}, {y}, {z}"/>' for x, y, z in 1e3 * np.array(repeats))
        text += "".join(f'<{nodes} Position="{x}, {y}, {z}"/>' for x, y, z in 1e3 * points) + "</Yarn>"
    path.write_text(text + "</Textile></TexGenModel>")
    return path


@pytest.mark.parametrize("scale", [1, -1])
def test_a_knit_of_texgen_is_a_cell(tmp_path, scale):
    """Written by its control points, a loop comes back as the cell that it is; the order of the repeats is TexGen's."""
    cell = endless_cell(garter(), 1, 2)
    yarns = [line.curve.control_points for line in cell.centrelines[:-1]]
    along = cell.centrelines[0].curve.advance
    yarns = [np.append(points, points[:1] + along, axis=0) for points in yarns]
    again = read_fabric(texgen(tmp_path / "a.tg3", yarns, cell.periods[::scale]))
    assert (again.specimen, len(again.centrelines)) == ("cell", 3)
    for one, other in zip(again.centrelines, cell.centrelines, strict=True):
        s = np.linspace(0, other.length, 7)
        assert one.position(s) == pytest.approx(other.position(s), abs=1e-9 * RADIUS_FILE)
    for name in ("periods", "size", "shift", "cell", "radius"):
        np.testing.assert_allclose(getattr(again, name), getattr(cell, name), atol=1e-12 * RADIUS_FILE)
    np.testing.assert_allclose(np.sort(again.crossings.distance), np.sort(cell.crossings.distance), rtol=1e-9)
    assert fabric_of(fabric_dataset(again)).specimen == "cell"


def test_a_weave_of_texgen_is_its_yarns(tmp_path, caplog):
    repeats = [(4 * PITCH, 0, 0), (0, 2 * PITCH, 0)]
    fabric = read_fabric(texgen(tmp_path / "a.tg3", YARNS, repeats, nodes="SlaveNode"))
    assert (fabric.specimen, len(fabric.crossings)) == ("curves", 4)
    assert "repeats are left out" in caplog.text


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"yarns": []}, "holds no yarns of TexGen"),
        ({"section": '<Section type="CSectionEllipse"/>'}, "each of one section with a width and a height"),
        ({"section": ROUND + ROUND.replace("Ellipse", "Rectangle")}, "each of one section"),
        ({"section": ROUND.replace("{0}", "nan")}, "each of one section"),
        (
            {"section": '<Section type="CSectionPolygon"/>'},
            "a section CSectionPolygon.*allowed are CSectionEll",
        ),
        ({"section": ROUND + '<Repeat value="1, 2"/>'}, "each of one section with a width"),
        ({"section": ROUND + '<Repeat value="1, 2, inf"/>'}, "each of one section with a width"),
        ({"section": '<Section Width="1" Height="1"/>'}, "a section without a type"),
        (
            {"section": f'<Section type="CSectionRotated" Angle="1">{ROUND}</Section>'},
            "a section CSectionRotated",
        ),
        ({"scale": "in"}, r"has no column 'x \[m\]', only 'yarn', 'x \[in\]'"),
        ({"yarns": [YARNS[0][:3]]}, "a yarn has 3 points"),
    ],
)
def test_a_file_of_texgen_without_round_yarns_is_refused(tmp_path, changes, message):
    with refusal(message):
        read_fabric(texgen(tmp_path / "a.tg3", **({"yarns": YARNS} | changes)))


def profile_of(section: str, attributes: dict[str, float], t):
    """Return x and the thickness there of a section, both (n,), by TexGen's parametric forms."""
    x = 0.5 * attributes["Width"] * np.cos(t)
    if section == "CSectionRectangle":
        return x, np.full_like(x, attributes["Height"])
    if section == "CSectionLenticular":
        rises = [0.5 * attributes["Height"] - side * attributes["Distortion"] for side in (1, -1)]
        radii = [(0.25 * attributes["Width"] ** 2 + rise**2) / (2 * rise) for rise in rises]
        return x, sum(np.sqrt(r**2 - x**2) - (r - rise) for r, rise in zip(radii, rises, strict=True))
    return x, attributes["Height"] * np.sin(t) ** attributes.get("Power", 1.0)


@pytest.mark.parametrize(
    ("section", "more"),
    [
        ("CSectionEllipse", {}),
        ("CSectionRectangle", {}),
        ("CSectionLenticular", {"Distortion": 0.0}),
        ("CSectionLenticular", {"Distortion": -0.02}),
        ("CSectionPowerEllipse", {"Power": 1.0}),
        ("CSectionPowerEllipse", {"Power": 0.3}),
    ],
)
def test_yarns_of_texgen_have_the_area_of_their_sections(tmp_path, section, more):
    attributes = {"Width": 0.6, "Height": 0.28} | more
    text = "".join(f' {name}="{value}"' for name, value in attributes.items())
    yarns = [np.linspace([0, 0, 0], [0.01, 0, 0], 5)]
    fabric = read_fabric(texgen(tmp_path / "a.tg3", yarns, section=f'<Section type="{section}"{text}/>'))
    x, thickness = profile_of(section, attributes, np.linspace(np.pi, 0, 20001))
    assert np.pi * (1e3 * fabric.radius) ** 2 == pytest.approx(np.trapezoid(thickness, x), rel=1e-5)


def test_a_file_that_is_no_xml_is_refused(tmp_path):
    (tmp_path / "a.tg3").write_text("yarn,x,y,z\n")
    with refusal("holds no yarns of TexGen"):
        read_fabric(tmp_path / "a.tg3")


PLUGIN = """
from knitstudy.knit.geometry.specimens import yarn_pair
from knitstudy.knit.geometry.readers import READERS, Reader
READERS.register(Reader(".pair", "radius of two yarns", lambda path: yarn_pair(float(path.read_text()), 90.0, 1e-2)))
"""


def test_a_plugin_of_one_file_adds_a_reader(tmp_path, plugin):
    (tmp_path / "a.pair").write_text("0.5e-3")
    with refusal(r"unknown ending of a fabric file '\.pair'.*\.csv, \.k, \.knitout, \.nc, \.tg3"):
        read_fabric(tmp_path / "a.pair")
    plugin(readers.READERS, pairs_of_a_test=PLUGIN)
    assert read_fabric(tmp_path / "a.pair").radius == 0.5e-3


@pytest.fixture(scope="module")
def scene(plain_scene):
    return plain_scene.vary({"specimen": "cut_knit", "fidelity": "spline_yarns"})


@pytest.fixture(scope="module")
def pieces(knit):
    return cut_cells(knit.loop, *knit.cells)


def test_cuts_are_half_way_up_the_legs(knit):
    """Cuts of the first and of the last yarn lie as many rows apart as there are cells: strain is of the cells."""
    legs = middles_of_legs(knit).ravel()
    low, high = (knit.centrelines[yarn].position(legs) for yarn in (0, -1))
    np.testing.assert_allclose(high - low, np.tile([0, knit.height, 0], (len(legs), 1)), atol=1e-15)
    slope = knit.centrelines[0].tangent(legs)
    assert np.all(np.abs(slope[:, 1]) > 0.6)
    assert np.all(slope[::2, 1] > 0)


def test_sinker_that_is_free_across_the_load_is_led_to_its_first_contact(scene, knit_of):
    """The middle one of four cells has no tie; its driven ends leave it x, z and a turn about y."""
    size = {"pattern.loops": 4, "pattern.rows": 1, "load.direction": "wale"}
    wide = scene.vary({"interaction": "isotropic", **size})
    fabric = cut_cells(knit_of(wide).loop, 4, 1)
    for lateral, expected in (("fixed", False), ("free", [6])):
        yarns = build(wide.replace("load.lateral", lateral), fabric).observer
        drag = yarns.model.drag
        assert (drag is not None and np.unique(yarns.parts.yarn[drag[::3] > 0]).tolist()) == expected


def test_yarns_touch_beside_every_tie(scene, knit, pieces):
    """Several arches are tied to one yarn. One that is moved into its neighbour is pressed back, but not by the tie."""
    touching = scene.vary({"interaction": "isotropic", "contact.tied_edges": "outer"})
    yarns = build(touching, pieces).observer
    model, unity = yarns.model, yarns.parts.unity
    last_arch = yarns.parts.nodes_of(2)

    def points(height):
        moved = np.zeros((len(unity), 3))
        moved[last_arch, 2] = unity[last_arch] * height * knit.radius
        state = model.advance(model.start(), moved[yarns.retained].ravel())
        return model.contact_points(state)

    pressed = max((points(height) for height in (0.2, -0.2)), key=lambda actual: actual.pressure.sum())
    assert pressed.pressure.sum() > 0
    touches = pressed.pressure > 0
    place = model.contact.reference(pressed.history.point[touches])
    discs = yarns.ties.discs
    apart = np.linalg.norm(place[:, None] - discs.centre, axis=2).min(axis=1)
    assert 1.5 * discs.radius < apart.min() < knit.radius
    assert points(0.0).pressure.sum() == 0
