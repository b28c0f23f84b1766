"""Elements that register themselves from outside, yarns with an axis, and Hencky's law by principal stretches."""

import numpy as np
import pytest
from refusals import READ, refusal

from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.simulate import solve
from knitstudy.mechanics.materials.isotropic import Hencky, Isotropic


@pytest.fixture
def pull(plain_scene, knit_of):
    """Return the force of one cell of a knit, pulled a little."""

    def pull(**changes):
        keys = {
            "fidelity": "hexahedra",
            "pattern.loops": 1,
            "pattern.rows": 1,
            "load.strain": 0.002,
            "yarn.material": "st_venant_kirchhoff",
            "solver.increments": 1,
        } | {key.replace("__", "."): value for key, value in changes.items()}
        if keys["fidelity"] == "hexahedra":
            keys = {"mesh.size": 2 / 3, "gates.elements_across": 2.0, "solver.hourglass": 0.01} | keys
        scene = plain_scene.vary(keys)
        knit = knit_of(scene)
        mesh = mesh_fabric(knit, scene.value("mesh.size") or 1.0)
        return float(solve(scene, knit, mesh=mesh)["force"][-1])

    return pull


@pytest.mark.parametrize("fidelity", ["hexahedra", "spline_yarns"])
def test_a_yarn_with_an_axis_goes_through_a_simulation(pull, fidelity):
    """Of equal constants it carries as much as Hencky's law; softer in shear it carries less."""
    yarn = {"fidelity": fidelity, "yarn__material": "transversely_isotropic"}
    force = pull(**yarn)
    assert force == pytest.approx(pull(fidelity=fidelity, yarn__material="hencky"), rel=1e-9)
    assert 0.4 * force < pull(**yarn, yarn__axial_shear_modulus=1e8) < 0.95 * force


@pytest.mark.parametrize("ratio", [-0.999, 0.0, 0.499])
def test_isotropic_constants_up_to_their_bounds_store_energy(ratio):
    assert np.linalg.eigvalsh(Isotropic(1.0, ratio).moduli).min() > 0


@pytest.mark.parametrize(
    ("modulus", "ratio"), [(0.0, 0.3), (-1.0, 0.3), (1.0, -1.0), (1.0, -1.1), (1.0, 0.5), (1.0, 0.6)]
)
def test_isotropic_constants_without_a_positive_energy_are_refused(modulus, ratio):
    with refusal("has to"):
        Isotropic(modulus, ratio)


# Hencky's law is that of principal stretches, for strains of any size


HENCKY = Hencky(youngs_modulus=1.3, poisson_ratio=0.31)
MU, LAME = HENCKY.shear_modulus, HENCKY.lame


def strains(stretches, count=20):
    """Green strains (count, 3, 3) of three stretches in axes of any direction."""
    axes, _ = np.linalg.qr(np.random.default_rng(7).standard_normal((count, 3, 3)))
    return (axes * (0.5 * (np.square(stretches) - 1))) @ axes.transpose(0, 2, 1), axes


@pytest.mark.parametrize(("stretches", "tolerance"), READ["principal stretches"])
def test_stress_and_energy_are_those_of_principal_stretches(stretches, tolerance):
    strain, axes = strains(stretches)
    logs = np.log(stretches)
    principal = (2 * MU * logs + LAME * logs.sum()) / np.square(stretches)
    actual = HENCKY.respond(strain, False)
    expected = (axes * principal) @ axes.transpose(0, 2, 1)
    assert np.abs(actual.stress - expected).max() <= tolerance * max(np.abs(principal).max(), 1)
    energy = MU * (logs**2).sum() + 0.5 * LAME * logs.sum() ** 2
    np.testing.assert_allclose(actual.energy, energy, rtol=tolerance, atol=1e-30)


@pytest.mark.parametrize("size", [1e-12, 1e-8, 1e-4])
def test_small_strains_lose_no_digits(size):
    strain = size * np.array([[[1.0, 0.3, 0.2], [0.3, -0.5, 0.1], [0.2, 0.1, 0.7]]])
    actual = HENCKY.respond(strain, True)
    linear = 2 * MU * strain + LAME * np.trace(strain[0]) * np.eye(3)
    assert np.abs(actual.stress - linear).max() < (10 * size + 1e-15) * np.abs(linear).max()
    isotropic = np.diag([2 * MU] * 3 + [MU] * 3)
    isotropic[:3, :3] += LAME
    assert np.abs(actual.tangent - isotropic).max() < 100 * size + 1e-13


def test_no_volume_has_no_energy():
    sound, _ = strains((1.1, 1.0, 0.9), 1)
    gone = np.stack([-0.5 * np.eye(3), np.diag([-1.0, 0, 0])])  # C is nothing, and not positive
    actual = HENCKY.respond(np.concatenate([gone, sound]), True)
    np.testing.assert_array_equal(np.isfinite(actual.energy), [False, False, True])
    assert np.isfinite(actual.tangent[2]).all()
