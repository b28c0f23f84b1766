"""Hencky's law is that of principal stretches, for strains of any size."""

import numpy as np
import pytest

from knitstudy.mechanics.materials.isotropic import Hencky

HENCKY = Hencky(youngs_modulus=1.3, poisson_ratio=0.31)
MU, LAME = HENCKY.shear_modulus, HENCKY.lame


def strains(stretches, count=20):
    """Green strains (count, 3, 3) of three stretches in axes of any direction."""
    axes, _ = np.linalg.qr(np.random.default_rng(7).standard_normal((count, 3, 3)))
    return (axes * (0.5 * (np.square(stretches) - 1))) @ axes.transpose(0, 2, 1), axes


@pytest.mark.parametrize(
    ("stretches", "tolerance"),
    [
        ((1.0, 1.0, 1.0), 1e-15),
        ((1.2, 1.2, 1.2), 1e-14),
        ((1.1, 1.1, 0.9), 1e-14),
        ((1.5, 1.0, 0.7), 1e-13),
        ((10.0, 1.0, 0.2), 1e-10),
        ((25.0, 25.0, 0.05), 1e-9),
    ],
)
def test_stress_and_energy_are_those_of_principal_stretches(stretches, tolerance):
    strain, axes = strains(stretches)
    logs = np.log(stretches)
    principal = (2 * MU * logs + LAME * logs.sum()) / np.square(stretches)
    found = HENCKY.respond(strain, False)
    wanted = (axes * principal) @ axes.transpose(0, 2, 1)
    assert np.abs(found.stress - wanted).max() <= tolerance * max(np.abs(principal).max(), 1)
    energy = MU * (logs**2).sum() + 0.5 * LAME * logs.sum() ** 2
    np.testing.assert_allclose(found.energy, energy, rtol=tolerance, atol=1e-30)


@pytest.mark.parametrize("size", [1e-12, 1e-8, 1e-4])
def test_small_strains_lose_no_digits(size):
    strain = size * np.array([[[1.0, 0.3, 0.2], [0.3, -0.5, 0.1], [0.2, 0.1, 0.7]]])
    found = HENCKY.respond(strain, True)
    linear = 2 * MU * strain + LAME * np.trace(strain[0]) * np.eye(3)
    assert np.abs(found.stress - linear).max() < (10 * size + 1e-15) * np.abs(linear).max()
    isotropic = np.diag([2 * MU] * 3 + [MU] * 3)
    isotropic[:3, :3] += LAME
    assert np.abs(found.tangent - isotropic).max() < 100 * size + 1e-13


def test_points_far_apart_do_not_disturb_each_other():
    small, large = (strains(stretches)[0] for stretches in ((1.01, 1.0, 0.99), (8.0, 1.0, 0.3)))
    both, small = np.concatenate([small, large]), small
    together, alone = HENCKY.respond(both, True), HENCKY.respond(small, True)
    np.testing.assert_allclose(together.tangent[: len(small)], alone.tangent, rtol=0, atol=1e-12)


def test_no_volume_has_no_energy():
    sound, _ = strains((1.1, 1.0, 0.9), 1)
    gone = np.stack([-0.5 * np.eye(3), np.diag([-1.0, 0, 0])])  # C is nothing, and not positive
    found = HENCKY.respond(np.concatenate([gone, sound]), True)
    np.testing.assert_array_equal(np.isfinite(found.energy), [False, False, True])
    assert np.isfinite(found.tangent[2]).all()
