"""The honeycomb along the principal stress: it closes, has its angles, and is pulled by its own height."""

import numpy as np
import pytest
import synthetic
from refusals import refusal

from knitstudy.knit.models.rom2d.build import heights_by_stress, moved
from knitstudy.knit.simulate import build, solve
from knitstudy.measures.centre_cell import angle_to_x, angles_to_axes, central, honeycomb_segments

INTERLOCK, LEG = 40.0, 55.0


def test_segments_have_the_angles_of_the_stress(knit, contacts):
    stresses = synthetic.stresses(knit, "course", INTERLOCK, LEG)
    joints = moved(knit, contacts, heights_by_stress(knit, contacts, stresses))
    expected = {"head": 0, "sinker": 0, "interlock": INTERLOCK, "leg": LEG}
    for kind, vectors in honeycomb_segments(joints).items():
        angle = angles_to_axes(vectors)[:, 0]
        np.testing.assert_allclose(angle, expected[kind.split(",")[0]], atol=1e-6, err_msg=kind)


@pytest.mark.parametrize(("spread", "other"), [(4.0, 55.5), (1.0, 58.0)])
def test_angles_of_a_stress_are_as_sure_as_equivalent_segments_and_discretisations(knit, spread, other):
    """Half the range over equivalent segments, or the difference to another discretisation if that is larger."""
    first, second = (synthetic.stresses(knit, "course", INTERLOCK, leg) for leg in (LEG, other))
    here = central(first, "leg, left")
    assert len(here) > 1, "equivalent segments"
    turned = np.radians(-(LEG - spread))
    axis = first["segment_axis"].copy(deep=True)
    axis[here[0], :, 0, :2] = [np.cos(turned), np.sin(turned)]
    first = first.assign(segment_axis=axis)
    actual = angle_to_x([first, second], "leg, left")
    mean = LEG - spread / len(here)
    assert actual.value == pytest.approx(mean)
    assert actual.uncertainty == pytest.approx(max(spread / 2, other - mean))


@pytest.mark.parametrize("angles", [(0.0, LEG), (INTERLOCK, 89.9)])
def test_directions_without_a_height_are_refused(knit, contacts, angles):
    with refusal(r"of the centre cell is at .* degrees to x: only"):
        heights_by_stress(knit, contacts, synthetic.stresses(knit, "wale", *angles))


def test_strain_refers_to_the_height_of_the_honeycomb(knit, contacts, plain_scene):
    stresses = synthetic.stresses(knit, "course", INTERLOCK, LEG)
    keys = {"rom.honeycomb": "principal_stress", "rom.stress_from": "dns-a", "rom.contacts_from": "dns-a"}
    scene = plain_scene.vary({"fidelity": "rom2d", "load.direction": "wale"} | keys)
    history = solve(scene.vary({"solver.increments": 1}), knit, contacts=contacts, stresses=stresses)
    height = 3 * heights_by_stress(knit, contacts, stresses).course
    assert float(history["displacement"][-1]) == pytest.approx(scene.load.strain * height, rel=1e-9)
    assert float(history["strain"][-1]) == pytest.approx(scene.load.strain, rel=1e-9)


def test_stresses_are_given_where_the_scene_names_them_and_only_there(knit, contacts, plain_scene):
    scene = plain_scene.vary({"fidelity": "rom2d", "rom.contacts_from": "dns-a"})
    with refusal(r"rom\.stress_from of scene .* is empty, and stresses are"):
        build(scene, knit, contacts=contacts, stresses=synthetic.stresses(knit, "course", INTERLOCK, LEG))
