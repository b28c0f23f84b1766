import meshio
import numpy as np
import pytest

from knitstudy.errors import DataFileError, MeshError
from knitstudy.exchange.vtu import write_vtu
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import sweep


class Straight:
    length = 3.0

    def position(self, s):
        return s[:, None] * [1.0, 0.0, 0.0]

    def tangent(self, s):
        return np.ones_like(s)[:, None] * [1.0, 0.0, 0.0]


@pytest.fixture
def mesh():
    return sweep([Straight()], Section.butterfly(3, 1), 0.9, Spacing(0.5))


def test_vtu_holds_mesh_and_fields(mesh, tmp_path):
    displacement = np.random.default_rng(0).standard_normal(mesh.nodes.shape)
    write_vtu(mesh, tmp_path / "mesh.vtu", {"displacement": displacement})
    read = meshio.read(tmp_path / "mesh.vtu")
    np.testing.assert_array_equal(read.points, mesh.nodes)
    np.testing.assert_array_equal(read.cells_dict["hexahedron"], mesh.hexahedra)
    np.testing.assert_array_equal(read.point_data["displacement"], displacement)
    assert set(read.cell_data) == {"yarn", "scaled_jacobian"}
    assert [path.name for path in tmp_path.iterdir()] == ["mesh.vtu"]


def test_a_field_of_the_wrong_size_leaves_the_old_file(mesh, tmp_path):
    (tmp_path / "mesh.vtu").write_text("what was there")
    with pytest.raises(MeshError, match=r"'u' has the shape \(7, 3\)"):
        write_vtu(mesh, tmp_path / "mesh.vtu", {"u": np.zeros((7, 3))})
    assert (tmp_path / "mesh.vtu").read_text() == "what was there"


def test_a_folder_that_cannot_be_made_is_named(mesh, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(DataFileError, match="file"):
        write_vtu(mesh, tmp_path / "file" / "mesh.vtu")
