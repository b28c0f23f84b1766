"""Every figure on small made-up results, drawn by matplotlib alone."""

from pathlib import Path

import numpy as np
import pytest
import study
import sweeping
import synthetic
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.image import imread
from PIL import Image

from knitstudy.contacts.contacts import extract
from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.figures import catalogue, fig05_contact_points, shapes, style
from knitstudy.figures.fig_pair_slip import Slide
from knitstudy.figures.interlock import InterlockSide
from knitstudy.figures.picture import CHOICE, is_fallback
from knitstudy.figures.saving import FALLBACK_RENDERER, describe, save
from knitstudy.files import read_table
from knitstudy.geometry.fabric import plain_knit
from knitstudy.geometry.lay_out import initial_loop
from knitstudy.measures.selection import CASES
from knitstudy.mesh.mesher import mesh_fabric
from knitstudy.models import network_2d
from knitstudy.models.joints import contacts_of_crossings

PAPER = Path(__file__).resolve().parents[2] / "resources" / "reference" / "paper_tables.csv"

SOLID = (
    "fig01_unit_cell",
    "fig03a_interactions",
    "fig03b_interactions",
    "fig04_honeycomb",
    "fig05_contact_points",
    "fig06_joints",
    "fig07c_contact_area",
    "fig08_out_of_plane",
    "fig13_principal_stress",
    "fig14_segments",
    "fig16_out_of_plane",
    "fig16_wale",
    "fig_cut_rows",
)

IN_CONTACT = (
    "fig03a_interactions",
    "fig03b_interactions",
    "fig10_kinematics",
    "fig07a_zones",
    "fig07b_force",
    "fig07c_contact_area",
    "fig08_out_of_plane",
)

NORMALS = {r"$\mathbf{n}_1$", r"$\mathbf{n}_2$"}

PAPER = Path(__file__).resolve().parents[2] / "resources" / "reference" / "paper_tables.csv"


@pytest.fixture(scope="module")
def knit(plain_scene):
    return plain_knit(initial_loop(plain_scene), 2, 2)


@pytest.fixture(scope="module")
def results(knit, plain_scene, touching):
    """Results by what figures call them; those of models are replaced where a figure needs stations."""
    lifts = {"dns": 2e-4, "rom3d": 1e-4}
    cases = {
        f"{case}_{model}": synthetic.history(lift=lift) for case in CASES for model, lift in lifts.items()
    }
    mesh = mesh_fabric(knit, 1.2e-3)
    stresses = {
        f"isotropic_{way}_dns_{name}": each
        for way, angles in (("course", (33, 33)), ("wale", (82, 82)))
        for name, each in (
            ("mesh", mesh.to_dataset()),
            ("stress", synthetic.stresses(knit, way, *angles, mesh)),
        )
    }
    # All rows of a knit of 2 x 2 are outer ones.
    varied = {name: each for name, each in study.varied(plain_scene).items() if "untied" not in name}
    variations = {
        "variations": {
            name: study.in_contact(touching["dns"], scene.interaction) for name, scene in varied.items()
        },
        "variations_contacts": dict.fromkeys(varied, touching["contacts"]),
    }
    return (
        cases
        | stresses
        | variations
        | {
            "reference": study.reference(study.scenes(plain_scene)),
            "paper": read_table(PAPER),
            "domain": study.domain(plain_scene)[1],
            "domain_contacts": {},
            "every": {
                name: each
                for name, each in study.histories(study.scenes(plain_scene)).items()
                if not name.startswith("beam")
            },
            "every_contacts": {},
            "geometry": synthetic.geometry(knit),
            "mesh": mesh.to_dataset(),
            "contacts": contacts_of_crossings(knit),
            "dns": synthetic.history(scene="dns-a", digest="abcd"),
            "rom3d": synthetic.history(force=(0, 6, 12)),
            "rom2d": synthetic.history(force=(0, 10, 20)),
            "tie": synthetic.history(force=(0, 9, 18), lift=1e-4),
            "rough": synthetic.history(force=(0, 8, 16), lift=3e-4),
            "isotropic": synthetic.history(force=(0, 6, 12), lift=2e-4),
            "cut": synthetic.history(force=(0, 5, 10), lift=1e-4),
            "drawn": {},
            "loops": read_table(PAPER.with_name("loops.csv")),
            "sweeps": sweeping.histories(sweeping.scenes(), {"shape": 1.0}),
            "others": {"dns-tie-course-medium": synthetic.history(force=(0, 5.5, 11))},
            "reduced": {
                name: synthetic.history(force=(0, 7, 14))
                for name in ("rom3d-tie-course", "rom3d-printed-tie-course")
            },
            "beams": {
                f"beam-{kind}isotropic-course": synthetic.history(force=(0, 4, 8))
                for kind in ("", "pinned-", "hertz-")
            },
        }
    )


@pytest.fixture(scope="module")
def touching(knit):
    """Results of a knit with friction."""
    history = synthetic.contact_history(knit)
    contacts = synthetic.with_kinematics(extract(knit, history))
    return {"geometry": synthetic.geometry(knit), "dns": history, "contacts": contacts}


@pytest.fixture(scope="module")
def pairs(plain_scene):
    """Contacts and scenes of a pair that slides, and of one that slides and comes back."""
    there, press = [2e-5, 0.0, -1e-5], [0.0, 0.0, -1e-5]
    made = {
        "slid": ([press, there], [0.0, 0.0, 1e-6, 2e-5]),
        "reversed": ([press, there, press], [0.0, 0.0, 2e-5, 1.9e-5, 0.0]),
    }
    return {
        "pairs_contacts": {
            name: synthetic.contacts_of_slide(distance) for name, (_, distance) in made.items()
        },
        "scenes": {name: synthetic.pair_scene(plain_scene, path) for name, (path, _) in made.items()},
    }


@pytest.fixture(scope="module")
def scenes(plain_scene):
    """Scenes of a whole study by name, and those of ties in course tension by what figures call them."""
    found = study.scenes(plain_scene)
    roles = {model: f"{model}-tie-course" for model in ("dns", "rom3d", "rom2d")}
    cases = {f"{case}_dns": found[f"dns-{case.replace('_', '-')}"] for case in CASES}
    beside = study.varied(plain_scene) | study.domain(plain_scene)[0]
    return beside | found | sweeping.scenes() | cases | {role: found[name] for role, name in roles.items()}


@pytest.fixture
def drawn(results, knit, touching, pairs, scenes, monkeypatch):
    """Function that draws a figure, coarsely and without VTK."""
    monkeypatch.setenv(CHOICE, "matplotlib")
    monkeypatch.setattr(shapes, "AROUND", 12)
    monkeypatch.setenv(style.RESOLUTION, "50")

    def draw(name):
        stations = {"rom3d": synthetic.history_of(knit)} if name == "fig06_joints" else {}
        contact = touching if name in IN_CONTACT else {}
        of = {"scenes": scenes | pairs["scenes"]}
        if name == "fig03b_interactions":
            of["scenes"]["dns"] = scenes["dns-isotropic-wale"]
        return catalogue.draw(name, **results | pairs | stations | contact | of)

    return draw


def texts(figure):
    return [text.get_text() for axes in figure.axes for text in [*axes.texts, axes.title]]


@pytest.mark.parametrize("name", catalogue.FIGURES.names())
def test_every_figure_is_written_whole_with_its_origin(drawn, results, pairs, name, tmp_path):
    figure = drawn(name)
    sources = {
        need: (results | pairs)[need] for need in catalogue.FIGURES.find(name).needed if need != "scenes"
    }
    save(figure, [tmp_path / "a.png", tmp_path / "a.pdf"], sources, "A title")
    assert imread(tmp_path / "a.png")[..., :3].std() > 0.02
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    information = Image.open(tmp_path / "a.png").info
    assert information["Title"] == "A title"
    assert ("abcd" in information["Source"]) == ("dns" in sources)
    assert (information.get("Renderer") == FALLBACK_RENDERER) == (name in SOLID)
    assert is_fallback(figure) == (name in SOLID)


def test_unknown_figure_names_the_known_ones():
    with pytest.raises(
        ConfigurationError, match=r"unknown figure 'fig15'; allowed are fig15a_force_strain.*fig01_unit_cell"
    ):
        catalogue.draw("fig15")


def test_missing_result_is_named(results):
    with pytest.raises(ConfigurationError, match=r"fig04_honeycomb' needs .*: mesh is missing"):
        catalogue.draw("fig04_honeycomb", geometry=results["geometry"], contacts=results["contacts"])


def test_force_curves_and_stiffness_ratios(drawn):
    figure = drawn("fig15a_force_strain")
    (axes,) = figure.axes
    curves = [line.get_xydata() for line in axes.get_lines()]
    assert any(np.array_equal(curve, [[0, 0], [2.5, 5], [5, 10]]) for curve in curves)
    assert any(np.array_equal(curve, [[0, 0], [2.5, 10], [5, 20]]) for curve in curves)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert sorted(legend) == [
        "2D ROM (1.67 ± 0.03)",
        "3D ROM (1.00 ± 0.02)",
        "3D ROM, printed joints (1.17 ± 0.02)",
        "DNS (0.83 ± 0.02)",
        "DNS, one-point hexahedra of 0.45 mm (0.92 ± 0.02)",
        "reference",
    ]
    assert axes.get_xlabel() == "strain in course direction (%)"
    assert "(N)" in axes.get_ylabel()


def test_the_band_is_the_uncertainty_of_the_reference(drawn):
    (band,) = [
        each for each in drawn("fig15a_force_strain").axes[0].collections if isinstance(each, PolyCollection)
    ]
    x, y = band.get_paths()[0].vertices.T
    assert sorted(set(np.round(y[np.isclose(x, 5)], 9))) == [0.98 * 12, 1.02 * 12]


def test_models_alone_are_drawn_without_reference_and_variants(results, scenes):
    alone = {name: results[name] for name in ("dns", "rom3d", "rom2d")} | {"reference": study.NO_REFERENCE}
    figure = catalogue.draw("fig15a_force_strain", **alone, scenes=scenes)
    (axes,) = figure.axes
    assert len(axes.get_lines()) == 3
    assert not axes.collections
    assert "DNS (no reference)" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_no_two_of_ten_variants_look_alike(results, scenes):
    """The reduced models of friction come in eight variants, and there are five dashes."""
    printed = scenes["rom3d-printed-tie-course"]
    named = {f"variant-{number}": printed for number in range(10)}
    reduced = {name: synthetic.history(force=(0, 7, 14)) for name in named}
    shown = {name: results[name] for name in ("dns", "rom3d", "rom2d")} | {"reference": study.NO_REFERENCE}
    (axes,) = catalogue.draw("fig15a_force_strain", **shown, reduced=reduced, scenes=scenes | named).axes
    variants = axes.get_lines()[3:]
    assert len({(line.get_color(), str(line._unscaled_dash_pattern)) for line in variants}) == 10


def test_beams_are_compared_with_solids_and_reduced_models(drawn):
    figure = drawn("fig12b_beam_contact")
    legend = {text.get_text() for text in figure.legends[0].get_texts()}
    assert legend == {
        "DNS, isotropic friction (0.83 ± 0.02)",
        "3D ROM, isotropic friction (1.00 ± 0.02)",
        "3D ROM, ties (0.83 ± 0.02)",
        "beams, point contact, rigid (0.67 ± 0.01)",
        "beams, point contact, rigid, pinned (0.67 ± 0.01)",
        "beams, point contact, Hertzian (0.67 ± 0.01)",
        "reference",
    }
    lines = [line for line in figure.axes[0].get_lines() if line.get_linestyle() != "None"]
    looks = [(line.get_color(), line.get_linestyle()) for line in lines]
    assert len(set(looks)) == len(looks) == 6


@pytest.mark.parametrize("name", ["fig16_out_of_plane", "fig16_wale"])
def test_out_of_plane_motion_of_both_models_side_by_side(drawn, name):
    titles = [axes.get_title(loc="left") for axes in drawn(name).axes]
    assert titles[0].startswith("(a)  DNS, tie constraint: largest $|u_z|$ 0.4 mm")
    assert titles[3].startswith("(d)  3D ROM, isotropic friction: largest $|u_z|$ 0.2 mm")
    assert titles[3].endswith("correlation 1.00, amplitude 0.250 ± 0.005")


def test_names_of_near_curves_stand_apart(results, scenes):
    near = results | {"rom3d": synthetic.history(force=(0, 5, 10.01)), "scenes": scenes}
    (axes,) = catalogue.draw("fig15a_force_strain", **near).axes
    heights = sorted(text.xy[1] for text in axes.texts)
    assert np.diff(heights).min() > 0.05 * axes.get_ylim()[1]


def test_unit_cell_says_what_penetrates(drawn):
    said = " ".join(texts(drawn("fig01_unit_cell")))
    assert "deepest penetration 0.40 mm (0.44 $R$)" in said
    assert "no penetration, smallest gap\n0.018 mm (0.020 $R$)" in said


def test_unit_cell_marks_overlaps_before_only(drawn):
    """White appears where centrelines are nearer than a diameter: eight crossings of the flat cell."""
    white = [
        np.sum(np.ptp(collection.get_facecolor()[:, :3], axis=1) < 1e-9)
        for axes in drawn("fig01_unit_cell").axes
        for collection in axes.collections
        if isinstance(collection, PolyCollection)
    ]
    assert white[0] > 0
    assert white[1] == 0


def test_honeycomb_shows_every_beam_and_zone(drawn, knit, results):
    (axes,) = drawn("fig04_honeycomb").axes
    beams = next(each for each in axes.collections if isinstance(each, LineCollection))
    network = network_2d.planar_network(knit, results["contacts"])
    assert len(beams.get_segments()) == len(network.ends)
    np.testing.assert_allclose(beams.get_segments()[0], 1e3 * network.nodes[network.ends[0], :2])
    sizes = [len(each.get_offsets()) for each in axes.collections if not isinstance(each, LineCollection)]
    assert 16 in sizes  # 4 zones of 2 x 2 interlocks


@pytest.mark.parametrize(
    ("name", "labels"),
    [
        ("fig05_contact_points", {"$C_1$", "$C_2$", "$C_3$", "$C_4$", "$P_1$", "$P_2$", *NORMALS}),
        ("fig06_joints", {"$C_1$", "$C_3$", "$P_1$"}),
    ],
)
def test_points_are_named(drawn, name, labels):
    assert labels <= set(texts(drawn(name)))


def test_solid_pictures_have_scale_bars(drawn):
    assert "5 mm" in texts(drawn("fig04_honeycomb"))
    assert "1 mm" in texts(drawn("fig05_contact_points"))


@pytest.fixture
def side(knit, results):
    return InterlockSide.in_the_middle(knit, results["contacts"])


def test_points_are_those_on_the_left_of_the_middle_interlock(side, knit):
    assert list(side.yarn) == [1, 2]
    middle = 1.5 * knit.cell[0]
    assert (np.abs(middle - side.P[:, 0]) < middle / 3).all()
    assert (side.P[:, 0] < middle).all()
    assert side.P[0, 1] < side.P[1, 1], "P1 is the lower contact"


def test_each_plane_holds_both_centroids_and_what_belongs_to_its_contact(side):
    for contact in range(2):
        held = np.stack([*side.P, *side.C[contact], side.P[contact] + side.normal[contact]])
        np.testing.assert_allclose((held - side.P[0]) @ side.plane[contact], 0, atol=1e-12)


def test_drawn_planes_reach_beyond_what_they_hold(side, knit):
    radius = knit.radius
    for contact in range(2):
        corners = fig05_contact_points.corners_of_plane(side, contact, radius)
        held = np.stack([*side.P, *side.C[contact], side.P[contact] + 2 * radius * side.normal[contact]])
        edges = np.roll(corners, -1, axis=0) - corners
        outwards = np.cross(edges, np.cross(edges[0], edges[1]))
        outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
        depth = np.einsum("kei,ei->ke", corners - held[:, None], outwards)
        assert depth.min() > 0.3 * radius


def test_yarns_have_the_colours_of_the_whole_knit(side):
    assert side.colours == style.YARNS[1:3]


def test_contacts_without_the_middle_interlock_are_refused(knit, results):
    with pytest.raises(DataFileError, match=r"row 1, column 1 must have the zones \(0, 2\)"):
        InterlockSide.in_the_middle(knit, results["contacts"].isel(crossing=slice(0, 14)))


def test_unknown_format_is_refused(drawn, tmp_path):
    with pytest.raises(ConfigurationError, match=r"a\.bmp: figures are written as \.png and \.pdf"):
        save(drawn("fig02_interfaces"), [tmp_path / "a.bmp"], {}, "")
    assert list(tmp_path.iterdir()) == []


def test_origin_of_several_results_of_one_name():
    several = {
        "pairs": {
            "a": synthetic.history(scene="a", digest="1"),
            "b": synthetic.history(scene="b", digest="2"),
        }
    }
    assert describe(several) == "pairs of a [1]; pairs of b [2]"


def test_interactions_mark_every_crossing(drawn, knit):
    (axes,) = drawn("fig03a_interactions").axes
    marks = [
        len(each.get_offsets())
        for each in axes.collections
        if each.get_label() in ("tied", "contact with friction")
    ]
    assert sorted(marks) == [0, len(knit.crossings.row)], "a knit of two rows has no row between tied ones"


def test_grips_are_ends_in_course_and_arcs_in_wale_tension(drawn, knit):
    lines = {}
    for name in ("fig03a_interactions", "fig03b_interactions"):
        drawing = [line for line in drawn(name).axes[0].get_lines() if len(line.get_xdata()) == 40]
        lines[name] = np.array([line.get_xydata() for line in drawing])
    course, wale = 1e-3 * lines["fig03a_interactions"], 1e-3 * lines["fig03b_interactions"]
    yarns = knit.cells[1] + 1
    assert (course[:yarns, :, 0] < knit.cell[0] / 2).all()
    assert (course[yarns:, :, 0] > knit.width - knit.cell[0] / 2).all()
    held, driven = wale[: knit.cells[0] + 1], wale[knit.cells[0] + 1 :]
    assert len(driven) == knit.cells[0]
    assert held[..., 1].max() < driven[..., 1].min()
    assert driven[..., 1].max() == pytest.approx(
        knit.centrelines[-1].position(np.linspace(0, knit.centrelines[-1].length, 2000))[:, 1].max(), rel=1e-3
    )


def test_zones_and_area_of_the_centre_cell(drawn):
    zones, area = drawn("fig07a_zones").axes
    np.testing.assert_array_equal(zones.get_lines()[0].get_ydata(), [0, 0, 1, 2, 4, 4])
    np.testing.assert_allclose(area.get_lines()[0].get_ydata(), 2e-2 * np.array([0, 0, 1, 2, 4, 4]))
    assert "(mm²)" in area.get_ylabel()


@pytest.mark.parametrize("name", ["fig07a_zones", "fig07b_force"])
def test_points_1_to_4_are_marked_and_explained(drawn, name):
    figure = drawn(name)
    assert {"1", "2", "3", "4"} <= set(texts(figure))
    assert [text.get_text() for text in figure.texts] == ["1: 0.05 %;  2: 0.33 %;  3: 0.45 %;  4: 1.95 %"]


def test_contact_areas_are_pointed_at(drawn):
    panels = [axes for axes in drawn("fig07c_contact_area").axes if axes.get_title(loc="left")]
    arrows = [
        sum(text.arrow_patch is not None for text in axes.texts if hasattr(text, "arrow_patch"))
        for axes in panels
    ]
    assert arrows == [0, 1, 2, 4]
    assert "no contact" in [text.get_text() for text in panels[0].texts]
    assert [axes.get_title(loc="left") for axes in panels][3] == "(4)  1.95 % strain"


def test_out_of_plane_says_contraction_and_largest_force(drawn, touching):
    figure = drawn("fig08_out_of_plane")
    largest = float(np.linalg.norm(touching["contacts"]["force"][-1], axis=1).max())
    assert f"longest arrow {largest:.3g} N" in texts(figure)
    assert "(a)  5.00% strain, 2.50% transverse contraction" in [
        axes.get_title(loc="left") for axes in figure.axes
    ]


def test_interactions_are_compared_over_strain(drawn):
    for name, ends in (("fig09a_force", [18, 16, 12]), ("fig09b_out_of_plane", [0.2, 0.6, 0.4])):
        (axes,) = drawn(name).axes
        np.testing.assert_allclose([line.get_ydata()[-1] for line in axes.get_lines()], ends)
        legend = [text.get_text() for text in axes.get_legend().get_texts()]
        assert legend == ["tie constraint", "rough contact", "isotropic friction"]


def test_slide_of_a_pair_by_hand(pairs):
    slide = Slide.of(pairs["pairs_contacts"]["reversed"], pairs["scenes"]["reversed"])
    np.testing.assert_allclose(slide.distance, [0, 0, 2e-5, 1.9e-5, 0])
    np.testing.assert_allclose(slide.tangential, [0, 0, 2, 2, 0])
    np.testing.assert_allclose(slide.normal, [0, 4, 4, 4, 4])
    assert slide.kind == "slid and reversed"


def test_slides_are_drawn_with_the_limit_of_friction(drawn):
    tangential, _ = drawn("fig_pair_slip").axes
    labels = [line.get_label() for line in tangential.get_lines() if not line.get_label().startswith("_")]
    assert labels == ["slid", "slid and reversed", "± friction coefficient times normal force"]


def test_graded_tube_has_all_faces_of_a_tube_once():
    line = np.column_stack([np.linspace(0, 2, 5), np.zeros(5), np.zeros(5)])
    parts = shapes.graded_tube(line, 0.5, ["#ff0000", "#ff0000", "#0000ff", "#ff0000", "#ff0000"])
    assert [part.colour for part in parts] == ["#0000ff", "#ff0000"]
    faces = np.concatenate([part.faces for part in parts])
    whole = shapes.tube(line, 0.5, "#ff0000").faces
    np.testing.assert_array_equal(np.unique(faces, axis=0), np.unique(whole, axis=0))
    assert len(faces) == len(whole)
    assert len(parts[0].faces) == shapes.AROUND
