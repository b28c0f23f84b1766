"""One membrane element with the deck of a fabric's law in CalculiX, on every path of the fabric's cell."""

import calculix
import numpy as np
import pytest
from fabric_states import cells_of_knits

from knitstudy.use.decks.fabric import write_membrane
from knitstudy.use.fabric_law import LARGEST_FACTOR, membrane

pytestmark = [
    pytest.mark.ccx,
    pytest.mark.needs("apt-get install calculix-ccx (Debian, Ubuntu)", program=calculix.PROGRAM),
]

# The square moves as u = (U - 1) X: nodes 2 and 4 are at the ends of its edges, 3 at the corner between. Of the total
# reactions of its right and upper edge, those along their normals are forces per width, and half of the others shear
LOAD = """*NSET, NSET=RIGHT
2, 3
*NSET, NSET=TOP
3, 4
*EQUATION
3
3, 1, 1., 2, 1, -1., 4, 1, -1.
3
3, 2, 1., 2, 2, -1., 4, 2, -1.
2
4, 1, 1., 2, 2, -1.
*BOUNDARY
1, 1, 3
2, 3, 3
3, 3, 3
4, 3, 3
*STEP, NLGEOM
*STATIC
0.25, 1.
*BOUNDARY
{driven}*NODE PRINT, NSET=RIGHT, TOTALS=ONLY
RF
*NODE PRINT, NSET=TOP, TOTALS=ONLY
RF
*END STEP
"""
DISPLACEMENTS = (
    "2, 1, 1, {:.12g}\n",
    "4, 2, 2, {:.12g}\n",
    "2, 2, 2, {:.12g}\n",
)  # of course, wale, half of shear


def forces_of_calculix(deck, stretch):
    """Forces per width (3,) of a deck's square at stretches (3,), free where they are nan."""
    moves = zip(DISPLACEMENTS, stretch * [1.0, 1.0, 0.5], strict=True)
    driven = "".join(line.format(move) for line, move in moves if np.isfinite(move))
    loaded = deck.with_name("loaded.inp")
    loaded.write_text(deck.read_text() + LOAD.format(driven=driven))
    right, top = calculix.run(loaded).force[-2:]
    return np.array([right[0], top[1], 0.5 * (right[1] + top[0])])


@pytest.mark.parametrize("fabric", cells_of_knits())
def test_a_deck_has_the_forces_that_its_head_prints(fabric, tmp_path):
    """CalculiX relaxes what is free by itself. It stops at a residual of 0.5 % of the mean force."""
    fitted, deck = membrane(cells_of_knits()[fabric]), tmp_path / "deck.inp"
    write_membrane(fitted, deck, "calculix", fabric)
    strains, printed, cell = (
        fitted[name].to_numpy() for name in ("deck_strain", "deck_force", "deck_cell_force")
    )
    for path, stretch, expected, simulated in zip(fitted["path"].values, strains, printed, cell, strict=True):
        forces = forces_of_calculix(deck, stretch)
        np.testing.assert_allclose(forces, expected, atol=5e-3 * np.abs(expected).max(), err_msg=str(path))
        along = np.nan_to_num(stretch)
        assert 1 / LARGEST_FACTOR < forces @ along / (simulated @ along) < LARGEST_FACTOR, path
