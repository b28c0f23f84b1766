"""Every figure on small made-up results; solids are recorded instead of rendered."""

import logging
import re
from itertools import chain, product
from operator import attrgetter
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import study
import synthetic
from matplotlib.image import imread
from matplotlib.text import Text
from PIL import Image
from refusals import refusal

from knitstudy.datasets import read_table
from knitstudy.knit.contacts.contacts import extract
from knitstudy.knit.geometry.fabric_file import fabric_dataset
from knitstudy.knit.geometry.lay_out import initial_loop
from knitstudy.knit.geometry.loop import LoopTarget
from knitstudy.knit.geometry.specimens import endless_cell, plain_knit
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.yarns.joints import contacts_of_crossings
from knitstudy.measures.centre_cell import closest_neighbour
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import FORCE
from knitstudy.paper import figures
from knitstudy.paper.claims.verdicts import under_readings
from knitstudy.paper.figures.fig10_kinematics import QUANTITIES, SIDES, ZONES
from knitstudy.paper.figures.fig15_force_strain import (
    BEYOND,
    BREAK,
    CUT,
    Curve,
    draw_curves,
    draw_reference,
)
from knitstudy.paper.figures.fig_readings import cannot_be, decided
from knitstudy.paper.tables import table2_meshes
from knitstudy.run.catalogue import FIGURES, TABLES
from knitstudy.use import solids, style
from knitstudy.use.solids import Picture, RenderingError, Surface, View, arrow, sphere, tube
from knitstudy.use.style import describe, save

ROUNDING = 0.01  # inches, half the width of an axis
REFERENCE = Path(__file__).resolve().parents[2] / "resources" / "reference"


@pytest.fixture(scope="module")
def knit(plain_scene):
    return plain_knit(initial_loop(plain_scene), 2, 2)


@pytest.fixture(scope="module")
def touching(knit):
    """Results of a knit with friction."""
    history = synthetic.contact_history(knit)
    contacts = synthetic.with_kinematics(extract(knit, history))
    return {"geometry": synthetic.geometry(knit), "dns": history, "contacts": contacts}


@pytest.fixture(scope="module")
def results(knit, plain_scene, touching, paper, cases):
    """Function of the results that a figure takes, by argument."""
    histories = study.histories(cases)
    every = {name: each for name, each in histories.items() if not name.startswith("beam")}
    varied, mesh, curve = study.varied(plain_scene), mesh_fabric(knit, 4 / 3), synthetic.history
    # All rows of a knit of 2 x 2 are outer ones.
    inputs = {name: scene for name, scene in varied.items() if "untied" not in name}
    ways = [(way, other) for way in ("course", "wale") for other in ("free", "held")] + [("shear", "free")]
    garter = LoopTarget(0.9e-3, 1.1e-3, 1e-4, 0.01, stitches=("K", "P")).drawn()
    tied = {
        "geometry": synthetic.geometry(knit),
        "mesh": mesh.to_dataset(),
        "contacts": contacts_of_crossings(knit),
        "dns": curve(scene="dns-a", digest="abcd"),
        "reference": study.reference(cases),
        "paper": paper,
        "every": every,
        "every_contacts": {},
        "scenes": study.swept_scenes() | varied | cases | {"dns": cases["dns-tie-course"]},
        "course": touching["contacts"],
        "wale": touching["contacts"],
        "whole": curve(force=(0, 5, 10), lift=1e-4),
        "drawn": {},
        "sweeps": study.swept_histories(study.swept_scenes(), {"shape": 1.0}),
        "beams": {
            f"beam-{kind}isotropic-course": curve(force=(0, 4, 8)) for kind in ("", "pinned-", "hertz-")
        },
        "claims": read_table(REFERENCE / "paper_claims.csv"),
        "readings": read_table(REFERENCE / "readings.csv"),
        "mechanisms": study.mechanisms(),
        "histories": {
            name: study.in_contact(touching["dns"], each.interaction) for name, each in inputs.items()
        },
        "knits": {"stitches-garter-course": fabric_dataset(endless_cell(garter, 1, 2))},
        "cells": {
            f"fabric-cotton-stockinette-{way}-{other}": synthetic.fabric_cell(other, way)
            for way, other in ways
        },
    }
    for kind, force, lift in (("tie", 18, 1e-4), ("rough", 16, 3e-4), ("isotropic", 12, 2e-4)):
        tied[kind] = curve(force=(0, force / 2, force), lift=lift)
        tied |= {f"{kind}_dns": curve(lift=2e-4), f"{kind}_rom3d": curve(lift=1e-4)}
    for way, angles in (("course", (33, 33)), ("wale", (82, 82))):
        tied[f"isotropic_{way}_dns_mesh"] = mesh.to_dataset()
        tied[f"isotropic_{way}_dns_stress"] = synthetic.stresses(knit, way, *angles, mesh)
    main = {"dns": cases["dns-isotropic-course"], "geometry": cases["dns-tie-course"]}
    friction = tied | touching | {"rom3d": curve(force=(0, 6, 12)), "scenes": tied["scenes"] | main}
    models = tied | {model: every[f"{model}-tie-course"] for model in ("dns", "rom3d", "rom2d")}
    solids = {f"{kind}_dns": cases[f"dns-{kind}-course"] for kind in ("tie", "isotropic")}
    own = dict.fromkeys(
        ("fig03_interactions", "fig07_contact", "fig08_out_of_plane", "fig10_kinematics"), friction
    )
    own |= dict.fromkeys(("fig15_force_strain", "fig15_variants"), models)
    own |= dict.fromkeys(("fig16_out_of_plane", "fig16_wale"), tied | {"scenes": solids})
    of_course = {kind: cases[f"dns-{kind}-course"] for kind in ("tie", "isotropic")}
    rough = next(scene for scene in inputs.values() if scene.interaction == "rough")
    exact = {"tie": (study.FORCE["tie"], study.LIFT["tie"]), "rough": study.ROUGH}
    exact["isotropic"] = study.FORCE["isotropic"], study.LIFT["isotropic"]
    own["fig09_interactions"] = tied | {"scenes": of_course | {"rough": rough}}
    for kind, (force, lift) in exact.items():
        own["fig09_interactions"][kind] = curve(force=(0, force / 2, force), lift=lift)
    own["fig06_joints"] = tied | {"rom3d": synthetic.history_of(knit)}
    own["fig12_size_and_beams"] = friction | {"dns": curve()}
    judged = tied | {"contacts": dict.fromkeys(inputs, touching["contacts"]), "scenes": inputs}
    networks = {name: each for name, each in every.items() if name.startswith("rom3d-")}
    direct = {name: each for name, each in every.items() if name.startswith("dns-")}
    joints = TABLES.make("joints", networks=networks, solids=direct, scenes=cases)
    own["fig_joints"] = tied | {"joints": joints}
    own["fig_readings"] = tied | {
        "findings": TABLES.make("findings", **judged, counted_unknowns=study.counted())
    }
    own["fig_table2_springs"] = tied | {"springs": springs_by_mesh()}
    return lambda name: own.get(name, tied)


def springs_by_mesh():
    """Springs of three meshes and of the resolved contact in both tensions, stiffer on finer meshes."""
    runs = product(("0.45 mm", "0.30 mm", "0.20 mm", table2_meshes.RESOLVED), table2_meshes.WAYS)
    strain = np.linspace(0.01, 0.05, 5)
    parts = []
    for place, (contact, way) in enumerate(runs):
        stiffness = 1e5 * (1 + place) * strain / 0.05
        names = (
            *chain.from_iterable(table2_meshes.SPRINGS.values()),
            table2_meshes.HERTZ,
            *table2_meshes.PAPER,
        )
        part = {"contact": contact, "tension": way, table2_meshes.STRAIN: strain}
        part |= {table2_meshes.FORCE: 100 * strain, **dict.fromkeys(names, stiffness)}
        parts.append(pd.DataFrame(part))
    return pd.concat(parts)


@pytest.fixture
def pictures(monkeypatch):
    """Pictures that a figure shows, recorded instead of rendered."""
    shown = []

    def record(picture):
        shown.append(picture)
        return np.full((4, 4, 4), 128, dtype=np.uint8)

    monkeypatch.setattr(solids, "rendered", record)
    return shown


@pytest.fixture
def drawn(results, pictures, monkeypatch):
    """Function that draws a figure, coarsely, from scenes by the names that the workflow gives them."""
    monkeypatch.setattr(solids, "AROUND", 12)
    monkeypatch.setenv(style.RESOLUTION, "50")

    def draw(name, **others):
        sources, taken = results(name) | others, FIGURES.find(name).results
        named = [sources.get(argument, ()) if taken[argument].several else [argument] for argument in taken]
        named = set(chain.from_iterable(named))
        scenes = {each: scene for each, scene in sources.get("scenes", {}).items() if each in named}
        return figures.draw(name, **sources | {"scenes": scenes})

    return draw


@pytest.mark.parametrize("name", FIGURES.names())
def test_every_figure_is_written_with_units_and_its_origin(drawn, results, name, tmp_path):
    figure = drawn(name)
    taken = FIGURES.find(name).takes
    sources = {
        argument: each
        for argument, each in results(name).items()
        if argument in taken and argument != "scenes"
    }
    save(figure, [tmp_path / "a.png", tmp_path / "a.pdf"], sources, "A title")
    assert imread(tmp_path / "a.png")[..., :3].std() > 0.02
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    information = Image.open(tmp_path / "a.png").info
    assert information["Title"] == "A title"
    assert ("abcd" in information["Source"]) == ("[abcd]" in describe(sources))
    labels = [label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel())]
    assert all("(" in label for label in labels if label), "units"
    legends = [*figure.legends, *filter(None, (axes.get_legend() for axes in figure.axes))]
    assert all(len(legend.get_texts()) <= 7 for legend in legends)
    small = {
        text.get_text()
        for text in figure.findobj(Text)
        if text.get_text().strip() and text.get_fontsize() < 8
    }
    assert not small, "labels of eight points at least"
    assert min(study.room_around(figure)) > -ROUNDING, "nothing is cut off"
    for axes in filter(attrgetter("axison"), figure.axes):
        curves = [line for line in axes.lines if len(line.get_xdata()) > 2 and line.get_linestyle() != "None"]
        assert len(curves) <= 5, "no more can be told apart"


def test_figure_that_cannot_be_rendered_is_left_out_with_a_note(results, monkeypatch, caplog):
    def fail(picture):
        raise RenderingError("VTK cannot render here")

    monkeypatch.setattr(solids, "rendered", fail)
    with caplog.at_level(logging.ERROR):
        figure = figures.draw("fig01_unit_cell", **results("fig01_unit_cell"))
    (note,) = figure.texts
    assert "is left out: VTK cannot render here" in note.get_text().replace("\n", " ")
    assert caplog.messages == ["fig01_unit_cell is left out: VTK cannot render here"]


def test_marks_of_the_reference_end_where_the_axis_ends():
    reference = Reference({(FORCE, strain): Estimate(100 * strain, 0.1) for strain in (0.01, 0.02, 0.05)})
    for end, marks in ((5.0, [1.0, 2.0, 5.0]), (1.0, [1.0]), (0.6, None)):
        axes = style.figure(80.0, 60.0).subplots()
        axes.set_xlim(0, end)
        draw_reference(axes, reference)
        assert [list(line.get_xdata()) for line in axes.lines[:1]] == ([] if marks is None else [marks])


def test_force_curves_end_with_their_names_and_the_highest_is_cut(drawn, cases):
    axes, histories = drawn("fig15_force_strain").axes[0], study.histories(cases)
    for model in ("dns", "rom3d", "rom2d"):
        history = histories[f"{model}-tie-course"]
        curve = np.column_stack([100 * history["strain"], history["force"]])
        assert any(np.array_equal(line.get_xydata(), curve) for line in axes.get_lines())
    assert [text.get_text() for text in axes.texts] == [
        "2D ROM\n24.0 N\n(2.00 ± 0.04)",
        "3D ROM\n14.4 N\n(1.20 ± 0.02)",
        "DNS\n12.0 N\n(1.00 ± 0.02)",
    ]
    assert axes.get_ylim()[1] == pytest.approx(1.05 * 24.0)


def test_an_axis_is_broken_where_one_curve_rises_far_above_the_others():
    """All curves stay in the axes; a label stands at the height at which its curve ends."""
    look = figures.MODELS["rom2d"]
    for highest, heights in ((20.0, [20 / 21, 10 / 21]), (60.0, [1 - BEYOND * 3 / 50, (1 - BEYOND) / BREAK])):
        axes = style.figure(80.0, 160.0).subplots()
        curves = [Curve(look, np.array([0, 0.05]), np.array([0, end])) for end in (highest, 10.0)]
        draw_curves(axes, curves, "force", "N", cut=CUT)
        ends = axes.transData.transform([(5.0, highest), (5.0, 10.0)])
        drawn_at = axes.transAxes.inverted().transform(ends)[:, 1]
        np.testing.assert_allclose(drawn_at, heights)
        assert axes.texts[1].xy[1] == pytest.approx(heights[1])


def test_variants_stand_below_the_models_of_the_paper_with_their_ratios(drawn):
    axes = drawn("fig15_variants").axes[0]
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names[:3] == ["DNS, main", "3D ROM, main", "2D ROM, main"]
    beside = {names[round(text.get_position()[1])]: text.get_text() for text in axes.texts[:2]}
    assert beside == {"DNS, main": "1.00", "3D ROM, main": "1.20"}
    assert "3D ROM, pinned joints" in names
    lacking = {names[round(text.get_position()[1])]: text.get_text() for text in axes.texts}
    assert lacking["3D ROM, springs along x, y, z"] == "no springs"


def test_interactions_end_beside_their_references_with_uncertainty(drawn):
    """Bars of (a) are the force of the reference, 2 % off at most; names stand beside with the same numbers."""
    axes = drawn("fig09_interactions").axes[0]
    assert [text.get_text() for text in axes.texts] == [
        "tie constraint\n12.0 N\n(reference:\n12.00 ± 0.24)",
        "rough contact\n11.0 N\n(reference:\n11.00 ± 0.22)",
        "isotropic friction\n10.0 N\n(reference:\n10.00 ± 0.20)",
    ]
    bars = [bar.get_segments()[-1][:, 1] for bar in axes.collections]
    np.testing.assert_allclose(sorted(map(tuple, bars)), [(9.8, 10.2), (10.78, 11.22), (11.76, 12.24)])


def test_two_values_of_a_sweep_are_no_trend(drawn):
    """A line joins three values or more, and a panel says how many lack."""
    swept = study.swept_histories(study.swept_scenes(), {"shape": 1.0})
    two = {name: swept[name] for name in swept if re.match(r"sweep-shape-c0[89]0-isotropic", name)}
    for sweeps, line in ((swept, "-"), (two, "None")):
        axes = drawn("fig11_sweeps", sweeps=sweeps).axes[0]
        assert axes.lines[0].get_linestyle() == line
        assert ("drawn shape held: 2 of 5 values" in axes.texts[0].get_text()) == (line == "None")


def test_all_motions_out_of_plane_have_one_scale_of_colours(drawn):
    """So that the interaction with the larger motion has the stronger colours; only the bar has an axis."""
    (bar,) = [axes for axes in drawn("fig16_out_of_plane").axes if axes.axison]
    assert "u_z" in bar.get_xlabel()


def test_a_matrix_of_verdicts_has_what_a_reading_decides_and_names_the_rest(drawn, results):
    figure = drawn("fig_readings")
    found = under_readings(results("fig_readings")["findings"], results("fig_readings")["readings"])
    shown = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert shown == ["base", *(each.reading.reading for each in found[1:] if decided(each))]
    (notes,) = [" ".join(text.get_text().split()) for text in figure.texts]
    left_out = notes.partition("to decide a claim: ")[2]
    names = left_out.partition(". Claims")[0].split("; ")
    assert names == [each.reading.reading for each in found[1:] if not decided(each)]
    friction = next(each for each in found if each.reading.choice == "friction")
    assert [claim for claim in ("K5", "K13") if cannot_be(friction, claim)] == ["K13"]


def test_every_crossing_of_the_centre_cell_has_its_kinematics(drawn, touching):
    panels = drawn("fig10_kinematics").axes[-len(QUANTITIES) * len(SIDES) :]
    for axes in panels:
        assert {line.get_label() for line in axes.get_lines()} >= {label for label, _ in ZONES}
    ends = [axes.get_lines()[1].get_ydata()[-1] for axes in panels]
    turned, spun = np.degrees(0.1), np.degrees(0.2)
    np.testing.assert_allclose(ends, [turned, turned, 1.0, 1.0, 100.0, 90.0, 100.0, 90.0, spun, spun])
    with refusal(r"section_rotation is missing.*run the direct simulation again"):
        drawn("fig10_kinematics", contacts=touching["contacts"].drop_vars("section_rotation"))


def test_neighbour_that_comes_closer_at_the_end_is_followed(touching):
    """One that comes closer on the way only, or that is not there, does not count."""
    contacts = touching["contacts"]
    contraction = contacts["segment_contraction"].copy(deep=True)
    contraction[:, 0, 0] = [[0.5, 0.1]] * 5 + [[-0.1, 0.2]]
    contraction[:, 1, 1] = [[np.nan, -0.3]] * 6
    closer = closest_neighbour(contacts.assign(segment_contraction=contraction))
    np.testing.assert_allclose(closer[:, 0, 0], [0.1] * 5 + [0.2])
    np.testing.assert_allclose(closer[:, 1, 1], -0.3)


def volume(surface: Surface) -> float:
    """Volume inside a closed surface by the divergence theorem; positive if faces look outward."""
    a, b, c, d = np.moveaxis(surface.points[surface.faces], 1, 0)
    return float(np.sum(np.cross(a, b) * c + np.cross(a, c) * d) / 6)


def test_surfaces_are_closed_and_look_outward():
    """Volumes of inscribed bodies: below the exact ones by the sag of 40 facets around, at most 1.5 %."""
    line = np.column_stack([np.linspace(0, 2, 9), np.zeros(9), np.zeros(9)])
    bodies = {
        "tube": (tube(line, 0.5, "red"), np.pi * 0.25 * 2),
        "rod": (tube([np.zeros(3), np.array([0, 0, 2.0])], 0.5, "red"), np.pi * 0.25 * 2),
        "arrow": (
            arrow(np.zeros(3), np.array([0, 0, 2.0]), 0.1, "red"),
            np.pi * (0.01 * 1.2 + 0.09 * 0.8 / 3),
        ),
        "sphere": (sphere(np.array([3.0, 1, 2]), 0.5, "red"), np.pi / 6),
    }
    for name, (surface, exact) in bodies.items():
        assert 0.985 * exact < volume(surface) < exact, name


@pytest.mark.parametrize("opacity", [1.0, 0.5])
def test_rendered_sphere_is_round_and_in_its_place(opacity, not_run_here):
    """A pixel of 0.02 mm on the rim is 3 % of the shadow's area; its centre is found within half a pixel."""
    view, centre, radius = View.orbit(30, 20), np.array([1e-3, 2e-3, -1e-3]), 1.2e-3
    left, right, bottom, top = window = (-1.5, 4.5, 0.5, 3.5)
    surfaces = (sphere(centre, radius, "#0072B2", opacity),)
    try:
        image = solids.rendered(Picture(surfaces, view, window, pixels=(300, 150)))
    except RenderingError as error:
        not_run_here(str(error))
    covered = image[..., 3] > 0.25 * opacity * 255
    rows, columns = covered.shape
    pixel = (right - left) / columns
    assert covered.sum() * pixel**2 == pytest.approx(np.pi * 1.2**2, rel=0.03)
    y, x = (np.nonzero(covered)[i].mean() + 0.5 for i in (0, 1))
    actual = [left + x * pixel, top - y * (top - bottom) / rows]
    np.testing.assert_allclose(actual, 1e3 * view.project(centre), atol=0.01)
