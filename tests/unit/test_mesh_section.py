import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.mesh.section import Section


def corner_sines(section):
    corners = section.points[section.quads]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cross = ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0]
    return cross / np.linalg.norm(ahead, axis=-1) / np.linalg.norm(behind, axis=-1)


@pytest.mark.parametrize(
    ("size", "nodes", "quads", "angles"),
    [(0.9, 28, 21, 12), (0.3, 41, 32, 16)],
)
def test_size_sets_the_elements_across(size, nodes, quads, angles):
    section = Section.for_size(diameter=1.8, size=size)
    assert (section.size, section.quads.shape[0], section.ring.size) == (nodes, quads, angles)


@pytest.mark.parametrize(("core", "rings"), [(3, 1), (4, 1), (4, 2), (5, 1), (6, 2), (8, 2)])
def test_elements_are_well_shaped(core, rings):
    section = Section.butterfly(core, rings)
    assert corner_sines(section).min() > np.sin(np.radians(54))  # interior angles between 54 and 126 degrees
    assert section.areas.max() < 1.6 * section.areas.min()


@pytest.mark.parametrize(("core", "rings"), [(3, 1), (4, 1), (6, 2)])
def test_polygon_has_the_area_of_the_disc(core, rings):
    section = Section.butterfly(core, rings)
    assert section.areas.sum() == pytest.approx(np.pi, rel=1e-14)
    np.testing.assert_allclose(np.diff(section.angles), 2 * np.pi / (4 * core), rtol=1e-13)
    radii = np.linalg.norm(section.points[section.ring], axis=1)
    assert np.ptp(radii) < 1e-14
    assert 1 < radii[0] < 1.025


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Section.butterfly(2, 1), "8 angles"),
        (lambda: Section.butterfly(4, 0), "rings: 0"),
        (lambda: Section.for_size(0.0, 0.3), "diameter: 0.0 m"),
        (lambda: Section.for_size(1.8, -0.3), "size: -0.3 m"),
    ],
)
def test_bad_sections_are_refused(call, message):
    with pytest.raises(MeshError, match=message):
        call()
