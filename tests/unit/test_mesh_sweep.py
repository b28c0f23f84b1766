from dataclasses import dataclass

import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.files import read_dataset, write_dataset
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing, place_slices
from knitstudy.mesh.sweep import SweptMesh, rotation_minimising, sweep


@dataclass
class Straight:
    length: float
    y: float = 0.0

    def position(self, s):
        return np.stack([s, np.full_like(s, self.y), np.zeros_like(s)], axis=-1)

    def tangent(self, s):
        return np.broadcast_to([1.0, 0.0, 0.0], (s.size, 3)).copy()


@dataclass
class Helix:
    radius: float
    rise: float  # along the axis, a radian
    turns: float

    @property
    def pace(self):
        return np.hypot(self.radius, self.rise)

    @property
    def length(self):
        return 2 * np.pi * self.turns * self.pace

    def position(self, s):
        t = s / self.pace
        return np.stack([self.radius * np.cos(t), self.radius * np.sin(t), self.rise * t], axis=-1)

    def tangent(self, s):
        t = s / self.pace
        return (
            np.stack([-self.radius * np.sin(t), self.radius * np.cos(t), 0 * t + self.rise], axis=-1)
            / self.pace
        )


def volumes(mesh):
    """Volumes of hexahedra as the Jacobian at the centre times 8."""
    corner = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]])
    corner = np.vstack([corner, corner * [1, 1, -1]]) / 8
    return 8 * np.linalg.det(np.einsum("eci,cj->eij", mesh.nodes[mesh.hexahedra], corner))


@pytest.fixture
def two_yarns():
    return sweep([Straight(12.0), Straight(12.0, y=3.0)], Section.butterfly(3, 1), 0.9, Spacing(0.5))


def test_numbering_follows_the_contract(two_yarns):
    mesh = two_yarns
    q = mesh.section.size
    assert mesh.first_slice.tolist() == [0, 25, 50]
    assert mesh.nodes.shape == (50 * q, 3)
    assert mesh.hexahedra.shape == (48 * mesh.section.quads.shape[0], 8)
    assert mesh.hexahedra.dtype == np.int32
    assert mesh.yarn_of_slice.tolist() == [0] * 25 + [1] * 25
    k, i, yarn = 7, 3, 1
    node = mesh.nodes[(mesh.first_slice[yarn] + i) * q + k]
    slice_ = mesh.first_slice[yarn] + i
    expected = mesh.centres[slice_] + 0.9 * mesh.section.points[k] @ mesh.frames[slice_, :2]
    np.testing.assert_allclose(node, expected, atol=1e-14)
    assert np.ptp(mesh.hexahedra, axis=1).max() == q + mesh.section.bandwidth


def test_ends_and_surface(two_yarns):
    mesh = two_yarns
    np.testing.assert_array_equal(mesh.nodes[mesh.end_nodes("left"), 0], 0.0)
    np.testing.assert_array_equal(mesh.nodes[mesh.end_nodes("right"), 0], 12.0)
    surface = mesh.nodes[mesh.surface_nodes(1)]
    assert surface.shape == (25, 12, 3)
    radius = np.linalg.norm(surface - mesh.centres[25:, None], axis=-1)
    np.testing.assert_allclose(radius, radius[0, 0], rtol=1e-14)
    quads = mesh.nodes[mesh.surface_quads(1)]
    normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    outward = quads.mean(axis=1) - [0, 3, 0]
    assert (np.einsum("fi,fi->f", normal, outward * [0, 1, 1]) > 0).all()


def test_volume_of_a_straight_yarn_is_the_cylinder_s():
    mesh = sweep([Straight(12.0)], Section.butterfly(4, 1), 0.9, Spacing(0.3))
    assert volumes(mesh).min() > 0
    assert volumes(mesh).sum() == pytest.approx(np.pi * 0.9**2 * 12, rel=1e-13)


def test_curved_yarns_keep_positive_volumes():
    mesh = sweep([Helix(2.4, 0.5, 1.0)], Section.butterfly(4, 1), 0.9, Spacing(0.3))
    assert volumes(mesh).min() > 0
    identity = np.broadcast_to(np.eye(3), mesh.frames.shape)
    np.testing.assert_allclose(mesh.frames @ mesh.frames.transpose(0, 2, 1), identity, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(mesh.frames), 1.0, atol=1e-12)


def test_frames_turn_about_a_helix_by_its_total_torsion():
    helix = Helix(2.0, 1.0, 1.0)
    errors = []
    for count in (40, 80):
        s = np.linspace(0, helix.length, count + 1)
        d1 = rotation_minimising(helix.position(s), helix.tangent(s))[:, 0]
        t = s[-1] / helix.pace
        normal = -np.array([np.cos(t), np.sin(t), 0.0])
        binormal = np.cross(helix.tangent(s)[-1], normal)
        start = np.arctan2(d1[0] @ np.cross(helix.tangent(s)[0], [-1.0, 0, 0]), d1[0] @ [-1.0, 0, 0])
        end = np.arctan2(d1[-1] @ binormal, d1[-1] @ normal)
        torsion = helix.rise / helix.pace**2  # of the curve, rad/m; the frame falls behind the normal by it
        errors.append(abs(np.angle(np.exp(1j * (end - start + torsion * helix.length)))))
    assert errors[1] < 1e-5
    assert errors[0] / errors[1] > 2**3.5  # fourth order


def test_a_mesh_survives_its_file(two_yarns, tmp_path):
    write_dataset(two_yarns.to_dataset(), tmp_path / "mesh.nc")
    again = SweptMesh.from_dataset(read_dataset(tmp_path / "mesh.nc"))
    np.testing.assert_array_equal(again.nodes, two_yarns.nodes)
    np.testing.assert_array_equal(again.hexahedra, two_yarns.hexahedra)
    assert again.hexahedra.dtype == np.int32


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sweep([], Section.butterfly(3, 1), 0.9, Spacing(0.5)), "no centrelines"),
        (lambda: sweep([Straight(1.0)], Section.butterfly(3, 1), -0.9, Spacing(0.5)), "radius: -0.9"),
        (lambda: Spacing(0.0), "size: 0.0"),
        (lambda: Spacing(0.3, growth=0.5), "growth: 0.5"),
        (lambda: place_slices(0.0, Spacing(0.3)), "length: 0.0"),
        (lambda: place_slices(1.0, lambda s: 0.5 - s), "spacing: "),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(MeshError, match=message):
        call()
