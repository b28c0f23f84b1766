"""Size and quality of the study's mesh and reduced models, compared with Table 5 of the paper."""

import numpy as np
import pytest

from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.lay_out import lay_out
from knitstudy.mesh.mesher import mesh_fabric
from knitstudy.mesh.quality import scaled_jacobian
from knitstudy.models.joints import contacts_of_crossings
from knitstudy.models.simulate import build
from knitstudy.study.configuration import load_scene


@pytest.fixture(scope="module")
def fine():
    scene = load_scene("dns-tie-course")
    return mesh_fabric(Fabric.from_dataset(lay_out(scene)), scene.mesh.size, scene.mesh.growth)


def test_elements_are_well_shaped(fine):
    # What the section's corners allow (0.86); bending the yarn to 2.3 mm costs next to nothing.
    assert scaled_jacobian(fine.nodes, fine.hexahedra).min() > 0.84
    assert (fine.section.size, fine.section.ring.size) == (41, 16)
    steps = np.diff(fine.stations[0])
    assert steps.max() / steps.min() < 1.35


def test_degrees_of_freedom_in_the_plane():
    """324: 36 zones, 12 cut legs and 6 ends at the sides are 54 nodes.

    The 72 of Table 5 also have the 12 middles of legs and 6 of sinkers at which cells meet: no node is needed there.
    """
    scene = load_scene("rom2d-tie-course")
    knit = Fabric.from_dataset(lay_out(scene))
    network = build(scene, knit, contacts=contacts_of_crossings(knit)).observer.network
    assert 6 * network.beam_nodes == 324
    assert 6 * (network.beam_nodes + 12 + 6) == 432
