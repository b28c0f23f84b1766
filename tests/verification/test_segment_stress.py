"""Stress of solid yarns after the fact: closed forms of straight yarns, uniform stretch, balance with the grips."""

import numpy as np
import pytest
import xarray as xr

from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.lay_out import lay_out
from knitstudy.loading.history import DIRECTIONS
from knitstudy.measures.centre_cell import cut_force
from knitstudy.mechanics.materials import material_of
from knitstudy.mechanics.solid import cauchy_stress, principal_axes
from knitstudy.mesh.mesher import mesh as mesh_stage
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models import hexahedra, spline_yarns
from knitstudy.models.simulate import simulate
from knitstudy.models.stress import hexahedral_cell_stress as hexahedral
from knitstudy.models.stress import spline_cell_stress as polynomial
from knitstudy.models.stress import stress
from knitstudy.study.configuration import load_scene

SMALL = 1e-5  # largest strain of the closed forms: what is not linear in it turns no axis by more than this

DISCRETISE = {"hexahedra": hexahedra.discretise, "spline_yarns": spline_yarns.discretise}

DISCRETISED = {
    "one_point": ({"fidelity": "hexahedra", "mesh.element": "one_point"}, hexahedral),
    "quadratic": ({"fidelity": "hexahedra", "mesh.element": "quadratic"}, hexahedral),
    "polynomials": ({"fidelity": "spline_yarns"}, polynomial),
}

STRETCH = np.array([[1.02, 0.05, 0.0], [0.0, 0.97, 0.01], [-0.03, 0.0, 1.01]])


class Yarn:
    """The lower yarn of a pair: straight, along x, and the nodes of both yarns."""

    def __init__(self, kind):
        keys, self._stress = DISCRETISED[kind]
        if self._stress is hexahedral:
            keys = keys | {"mesh.size": 0.28}  # pairs need seven elements across
        touching = {"interaction": "isotropic", "specimen": "pair", "pair.support": "ends"}
        scene = load_scene("dns-tie-course-coarse").vary({**touching, "load.path": [[0, 0, -1e-5]]} | keys)
        self.scene = scene
        geometry = lay_out(scene)
        self.specimen = Fabric.from_dataset(geometry)
        self.mesh = SweptMesh.from_dataset(mesh_stage(scene, geometry))
        self.parts = DISCRETISE[scene.fidelity](scene, self.specimen, self.mesh)
        self.radius = self.specimen.radius
        centreline = self.specimen.centrelines[0].position(np.array([0.0]))[0]
        self.level = centreline[2]

    def cells(self, field):
        """Return mean stress and middle of cells away from the ends, y and z from the axis, of a displacement field."""
        nodes, sampling = self.parts.nodes, self.parts.sampling
        if self._stress is hexahedral:
            moved = field(nodes - [0, 0, self.level])
        else:
            # Coefficients that fit the field best at the drawn places of the yarn: exactly, as it is quadratic across.
            own = self.parts.nodes_of(0)
            rows = self.mesh.slice_nodes(np.flatnonzero(self.mesh.yarn_of_slice == 0)).ravel()
            unit = np.zeros((len(nodes), len(own)))
            unit[own, np.arange(len(own))] = 1
            matrix = (sampling @ unit)[rows]
            wanted = field(self.mesh.nodes[rows] - [0, 0, self.level])
            moved = np.zeros_like(nodes)
            moved[own] = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
        found = self._stress(self.scene, self.mesh, self.specimen, moved)
        lower = np.repeat(np.arange(2), [self.mesh.slice_of_element.size // 2] * 2) == 0
        inside = lower & (np.abs(found.reference[:, 0]) < 2 * self.radius)
        return found.mean[inside], found.reference[inside] - [0, 0, self.level]


@pytest.fixture(scope="module", params=DISCRETISED)
def yarn(request):
    return Yarn(request.param)


def off(stress, wanted):
    """Return the largest angle between the axes of the maximum principal stress and lines wanted (k, 3) [deg]."""
    axis = principal_axes(stress)[1][:, 0]
    cosine = np.abs(np.einsum("ki,ki->k", axis, wanted)) / np.linalg.norm(wanted, axis=1)
    return float(np.degrees(np.arccos(np.clip(cosine, 0, 1))).max())


def test_axes_in_torsion(yarn, request, verify):
    """Halfway between the yarn and the way around it."""
    twist = SMALL / yarn.radius

    def field(x):
        x, y, z = x.T
        return twist * np.stack([0 * x, -x * z, x * y], axis=1)

    stress, place = yarn.cells(field)
    distance = np.hypot(place[:, 1], place[:, 2])
    outer = distance > 0.4 * yarn.radius
    around = np.column_stack([0 * distance, -place[:, 2], place[:, 1]])[outer] / distance[outer, None]
    case = f"straight yarn in torsion, {request.node.callspec.id}"
    helix = off(stress[outer], np.array([1.0, 0, 0]) + around)
    verify.at_most(f"{case}: axis of principal stress [deg]", helix, 1)


@pytest.mark.parametrize("kind", ["one_point", "polynomials"])
def test_uniform_stretch_of_a_knit(kind):
    """All averages are the stress of that stretch, volumes grow alike, and rotations are its own."""
    keys, _ = DISCRETISED[kind]
    scene = load_scene("dns-tie-course-coarse").vary(keys | {"pattern.loops": 1, "pattern.rows": 2})
    geometry = lay_out(scene)
    mesh = mesh_stage(scene, geometry)
    specimen = Fabric.from_dataset(geometry)
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
    found = stress(scene, geometry, mesh, history)
    yarn = scene.yarn
    wanted = cauchy_stress(STRETCH[None], material_of(yarn))[0]
    scale = np.abs(wanted).max()
    # Hourglass control sees nothing of a linear field: rounding is what is left.
    assert np.abs(found["segment_stress"] - wanted).max() < 1e-8 * scale
    assert np.abs(found["piece_stress"] - wanted).max() < 1e-8 * scale
    left, _, right = np.linalg.svd(STRETCH)
    assert np.abs(found["segment_rotation"] - left @ right).max() < 1e-8
    whole = found["piece_volume"].sel(extent="whole").sum()
    assert float(whole) == pytest.approx(float(found["cell_volume"].sum()), rel=1e-12)
    # Sections of polynomials are drawn as polygons of the circle's area.
    volume = np.pi * yarn.radius**2 * sum(each.length for each in Fabric.from_dataset(geometry).centrelines)
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
