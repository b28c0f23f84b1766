"""The quadratic hexahedron: modes without energy and folded elements; the rest is in `test_solids`."""

import numpy as np
import pytest
from hexahedral_block import connect, solid, with_middles

from knitstudy.errors import MeshError
from knitstudy.mechanics.elements.hexahedron import NATURAL, QuadraticHexahedron
from knitstudy.mechanics.materials.isotropic import Hencky


@pytest.mark.parametrize(("counts", "modes"), [((1, 1, 1), 6), ((3, 1, 1), 4), ((2, 2, 1), 0)])
def test_modes_without_energy(counts, modes):
    """Six of one cube alone; where two by two lie side by side, as in the section of a yarn, there are none."""
    nodes = np.stack(np.meshgrid(*(np.arange(n + 1.0) for n in counts), indexing="ij"), axis=-1).reshape(
        -1, 3
    )
    nodes, elements, _ = with_middles(nodes, connect(counts))
    model = solid(nodes, elements, element=QuadraticHexahedron)
    stiffness = np.linalg.eigvalsh(model.respond(model.start(), stiffness=True).stiffness.toarray())
    assert (stiffness < 1e-10 * stiffness[-1]).sum() == 6 + modes  # and rigid motions


def test_folded_elements():
    nodes = NATURAL[None] + 0.0
    element = QuadraticHexahedron(nodes, Hencky(1.0, 0.3))
    inside_out = -2 * nodes * [1, 0, 0]
    assert np.isnan(element.respond(slice(None), inside_out, stiffness=True).force).all()
    with pytest.raises(MeshError, match="folded"):
        QuadraticHexahedron(nodes * [-1, 1, 1], Hencky(1.0, 0.3))
