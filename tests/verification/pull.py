"""Pull a knit of hexahedra."""

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.loading.run import IN_MEMORY
from knitstudy.knit.mesh.mesher import mesh_scene
from knitstudy.knit.simulate import solve


def knit_and_mesh(scene):
    """Knit and mesh of a scene."""
    knit = fabric_of(lay_out(scene))
    return knit, mesh_scene(scene, knit)


def pull(scene, run=IN_MEMORY):
    """History of a scene."""
    knit, mesh = knit_and_mesh(scene)
    return solve(scene, knit, run, mesh=mesh)
