"""Tables of whole studies: responses, distances of models, beams and cost, by hand."""

import numpy as np
import pytest
import study

from knitstudy.measures.response import tangent_stiffness
from knitstudy.run.catalogue import TABLES


@pytest.fixture(scope="module")
def every(cases):
    return study.histories(cases)


@pytest.fixture(scope="module")
def reference(cases):
    return study.reference(cases)


@pytest.mark.wings
def test_distances_of_all_models_from_the_reference(every, cases, reference):
    sources = {"models": every, "scenes": cases, "reference": reference}
    table = TABLES.make("rom_distance", **sources).set_index("model")
    assert table.index.is_unique
    assert len(table) == 4 * 7
    of = table.loc["3D ROM, printed joints; tie constraint, wale"]
    assert of["scene"] == "rom3d-printed-tie-wale"
    assert of["discretisation"] == "beams"
    assert of["L2 distance of force to the reference [1]"] == pytest.approx(0.5)
    assert of["force over the reference's [1]"] == pytest.approx(1.5)
    assert of["correlation of u_z with DNS [1]"] == pytest.approx(1)
    assert of["amplitude of u_z over the reference's [1]"] == pytest.approx(0.5)
    # 1.5 times the reference's value is 1.5 / 0.98 times the least that this may be.
    assert of["uncertainty of that ratio [1]"] == pytest.approx(1.5 / 0.98 - 1.5)
    assert of["uncertainty of that distance [1]"] == pytest.approx(1.5 / 0.98 - 1.5)
    other_mesh = table.loc["DNS, one-point hexahedra of 0.45 mm; isotropic friction, course"]
    assert other_mesh["L2 distance of force to the reference [1]"] == pytest.approx(0.02)
    assert other_mesh["discretisation"] == "one-point hexahedra of 0.45 mm"


@pytest.mark.wings
def test_responses_by_hand(every, cases):
    """10 N at 5 % on 3 loops and rows: widths are 3 w and 3 c."""
    table = TABLES.make("responses", every=every, scenes=cases).set_index("scene")
    assert list(table.index) == list(every)
    pattern = cases["dns-isotropic-course"].pattern
    height, width = 3 * pattern.course_spacing, 3 * pattern.wale_spacing
    for way, along, across in (("course", width, height), ("wale", height, width)):
        of = table.loc[f"dns-isotropic-{way}"]
        assert of["width across the load [m]"] == pytest.approx(across)
        assert of["force at 1% strain [N]"] == pytest.approx(2)
        assert of["force per width [N/m]"] == pytest.approx(10 / across)
        # The synthetic specimen is 10 mm long: its displacement is 0.5 mm.
        assert of["secant stiffness, force per width [N/m]"] == pytest.approx(10 / 0.5e-3 * along / across)
        assert of["tangent stiffness, force per width [N/m]"] == pytest.approx(10 / 0.5e-3 * along / across)
        assert of["internal energy per area [J/m2]"] == pytest.approx(4e-3 / (width * height))
        assert of["dissipated energy per area [J/m2]"] == pytest.approx(1e-3 / (width * height))


@pytest.mark.parametrize("power", [1, 2])
def test_tangent_of_a_power(power):
    """F = (strain / 1 %)^p at 5 % of 10 mm: p 5^(p-1) N a percent, that is a tenth of a millimetre."""
    strain = np.linspace(0, 0.05, 6)
    history = study.history(strain=strain, force=(100 * strain) ** power)
    assert tangent_stiffness(history) == pytest.approx(power * 5 ** (power - 1) / 1e-4)
    one_increment = study.history(strain=(0, 0.05), force=(0, 10))
    assert tangent_stiffness(one_increment) == pytest.approx(10 / 0.5e-3)
