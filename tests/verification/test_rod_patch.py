"""How patches yield beyond what beams do."""

import numpy as np
import pytest

from knitstudy.mechanics import patch_compliance as rod_patch
from knitstudy.mechanics.patch_compliance import cylinder_patch

NU = 0.42


def test_what_is_local_does_not_depend_on_where_the_next_force_is(verify):
    """c_0 + c_1 A: a third distance lies on the line through the other two."""
    radius = 0.4
    values = [
        np.diag(cylinder_patch(radius, apart, NU))[:3] - rod_patch._beam_patch(radius, apart, NU)
        for apart in (*rod_patch.APART, 8.0)
    ]
    line = values[0] + (values[1] - values[0]) / 3
    verify.at_most(
        "patch beside a beam: linear in the distance of forces", np.abs(values[2] - line).max(), 5e-3
    )


def test_small_patch_yields_as_a_half_space_does(verify):
    """Two sizes differ as Boussinesq's and Cerruti's mean displacement under an even traction do."""
    small, large = 0.15, 0.3
    normal = 16 * (1 - NU**2) / (3 * np.pi**2) * (1 / small - 1 / large)
    exact = normal * np.array([1, (2 - NU) / (2 * (1 - NU)), (2 - NU) / (2 * (1 - NU))])
    found = np.subtract(rod_patch.local_compliance(small, NU), rod_patch.local_compliance(large, NU))
    verify.at_most(
        "patch beside a beam: change with its radius over a half-space's",
        np.abs(found / exact - 1).max(),
        0.06,
    )


@pytest.mark.parametrize("nu", [0.0, NU])
def test_patch_always_yields(nu):
    assert min(rod_patch.local_compliance(0.4, nu)) > 0.5
