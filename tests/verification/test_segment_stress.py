"""Stress of solid yarns after the fact: uniform stretch, balance with the grips."""

import numpy as np
import pytest
import xarray as xr

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.loading.history import DIRECTIONS
from knitstudy.knit.mesh.mesher import mesh as mesh_stage
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.knit.models.hexahedra import build as hexahedra
from knitstudy.knit.models.spline_yarns import build as spline_yarns
from knitstudy.knit.simulate import simulate
from knitstudy.knit.stress import stress
from knitstudy.mechanics.contact.solid import cauchy_stress
from knitstudy.mechanics.materials import material_of
from knitstudy.run.configuration import load_scene

DISCRETISE = {"hexahedra": hexahedra.discretise, "spline_yarns": spline_yarns.discretise}

DISCRETISED = {
    "one_point": {"fidelity": "hexahedra", "mesh.element": "one_point"},
    "quadratic": {"fidelity": "hexahedra", "mesh.element": "quadratic"},
    "polynomials": {"fidelity": "spline_yarns"},
}

STRETCH = np.array([[1.02, 0.05, 0.0], [0.0, 0.97, 0.01], [-0.03, 0.0, 1.01]])


@pytest.mark.parametrize("kind", DISCRETISED)
def test_uniform_stretch_of_a_knit(kind):
    """All averages are the stress of that stretch, volumes grow alike, and rotations are its own."""
    scene = load_scene("dns-tie-course-coarse").vary(
        DISCRETISED[kind] | {"pattern.loops": 1, "pattern.rows": 2}
    )
    geometry = lay_out(scene)
    mesh = mesh_stage(scene, geometry)
    specimen = fabric_of(geometry)
    parts = DISCRETISE[scene.fidelity](scene, specimen, SweptMesh.from_dataset(mesh))
    nodes = parts.nodes
    moved = nodes @ (STRETCH - np.eye(3)).T
    history = xr.Dataset(
        {
            "node_displacement": (("node", "xyz"), moved),
            "strain": ("increment", [0.05]),
            "force": ("increment", [1.0]),
        }
    )
    actual = stress(scene, geometry, mesh, history)
    yarn = scene.yarn
    expected = cauchy_stress(STRETCH[None], material_of(yarn))[0]
    scale = np.abs(expected).max()
    # Hourglass control sees nothing of a linear field: rounding is what is left.
    assert np.abs(actual["segment_stress"] - expected).max() < 1e-8 * scale
    assert np.abs(actual["piece_stress"] - expected).max() < 1e-8 * scale
    left, _, right = np.linalg.svd(STRETCH)
    assert np.abs(actual["segment_rotation"] - left @ right).max() < 1e-8
    whole = actual["piece_volume"].sel(extent="whole").sum()
    assert float(whole) == pytest.approx(float(actual["cell_volume"].sum()), rel=1e-12)
    # Sections of polynomials are drawn as polygons of the circle's area.
    volume = np.pi * yarn.radius**2 * sum(each.length for each in fabric_of(geometry).centrelines)
    assert float(whole) == pytest.approx(np.linalg.det(STRETCH) * volume, rel=5e-3)


@pytest.fixture(scope="module", params=["wale"])
def pulled(request, full):
    """The 3 x 3 knit, to little strain unless at full resolution."""
    keys = {} if full else {"load.strain": 0.005, "solver.increments": 1}
    scene = load_scene(f"yarns-tie-{request.param}").vary(keys)
    geometry = lay_out(scene)
    mesh = mesh_stage(scene, geometry)
    history = simulate(scene, geometry, mesh)
    return request.param, stress(scene, geometry, mesh, history)


SLAB = 0.4  # Width of the slab around a cut, over the length of the knit: about a cell

# Equilibrium holds in the mean for every function phi(x) that is constant at both grips; with psi = phi',
#     integral of sigma_xx psi dv = F * integral of psi dx.
# Stresses averaged over a slab with the weight psi give the force F through the knit. Contact adds nothing where both
# of its sides lie at one place.


def cut_force(stresses: xr.Dataset, share: float) -> float:
    """Return the force through a cut across the load, at a share of the deformed length of the knit [N].

    The weight is psi = 1 + cos over a slab (`SLAB`), which should lie between the grips. It is smooth, since elements
    are in equilibrium in their mean only.
    """
    axis = DIRECTIONS.index(stresses.attrs["direction"])
    place = stresses["cell_place"].to_numpy()[:, axis]
    length = np.ptp(place)
    away = (place - place.min() - share * length) / (SLAB * length)
    weight = np.where(np.abs(away) < 0.5, 1 + np.cos(2 * np.pi * away), 0.0)
    stress = stresses["cell_stress"].to_numpy()[:, axis]  # xx, yy, zz come first
    return float(np.sum(stress * stresses["cell_volume"].to_numpy() * weight) / (SLAB * length))


def test_forces_from_stresses_balance_the_grips(pulled, verify):
    """Splines balance in the mean of their spans; pieces of yarn carry what their cells do."""
    way, stresses = pulled
    grips = stresses.attrs["force"]
    for share in (0.3, 0.5, 0.7):
        through = cut_force(stresses, share)
        verify.within(f"3 x 3 knit in {way} tension: force through a cut at {share:g}", through, grips, 0.02)
    pieces, axis = stresses.sel(extent="whole"), DIRECTIONS.index(way)
    carried = float(pieces["piece_stress"][:, axis, axis] @ pieces["piece_volume"])
    assert carried == pytest.approx(
        float(stresses["cell_stress"][:, axis] @ stresses["cell_volume"]), rel=1e-9
    )
