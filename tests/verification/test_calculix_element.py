"""What CalculiX's hexahedra and laws compute (docs/decks.md), from single elements."""

import calculix
import numpy as np
import pytest

from knitstudy.exchange.deck import Deck, Prescribed, Step
from knitstudy.exchange.inp import write_inp
from knitstudy.mechanics.materials import MATERIALS

pytestmark = [
    pytest.mark.ccx,
    pytest.mark.skipif(not calculix.available(), reason="CalculiX (ccx) is not installed"),
]

CORNER = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]], dtype=float)
CORNER = np.vstack([CORNER, CORNER * [1, 1, -1]])
HOURGLASS = np.stack(
    [
        CORNER[:, 1] * CORNER[:, 2],
        CORNER[:, 0] * CORNER[:, 2],
        CORNER[:, 0] * CORNER[:, 1],
        CORNER.prod(axis=1),
    ],
    axis=1,
)
E, NU = 1300.0, 0.42
LAMBDA, MU = E * NU / (1 + NU) / (1 - 2 * NU), E / 2 / (1 + NU)
DRIVEN_NODE = 6


def reaction(folder, corners, displacement, law="st_venant_kirchhoff", element="one_point"):
    """Total reaction of node 6 of one element whose nodes are all displaced."""
    moved = tuple(Prescribed(f"N{k}", i + 1, i + 1, displacement[k, i]) for k in range(8) for i in range(3))
    held = tuple(Prescribed(f"N{k}", 1, 3 if k < 15 else 2, 0.0) for k in range(8, 16))
    # A second element with one free component keeps CalculiX from ending for lack of equations.
    deck = Deck(
        title="one element",
        nodes=np.vstack([corners, 0.5 * CORNER + [10, 0, 0]]),
        elements={"SOLID0": np.arange(16).reshape(2, 8)},
        node_sets={f"N{k}": np.array([k]) for k in range(16)},
        element=element,
        material=MATERIALS.find(law)(E, NU),
        hourglass=0.005,
        steps=(Step(moved + held, increments=1),),
        driven=f"N{DRIVEN_NODE}",
    )
    write_inp(deck, folder / "element.inp", "calculix")
    return calculix.run(folder / "element.inp").force[-1]


def predicted(corners, displacement):
    """Force on node 6 by the formulas of docs/decks.md."""
    mean, volume = np.zeros((8, 3)), 0.0
    for point in CORNER / np.sqrt(3):
        factor = 1 + CORNER * point
        natural = CORNER * factor[:, [1, 0, 0]] * factor[:, [2, 2, 1]] / 8
        jacobian = corners.T @ natural
        volume += np.linalg.det(jacobian)
        mean += np.linalg.det(jacobian) * natural @ np.linalg.inv(jacobian)
    F = np.eye(3) + displacement.T @ mean / volume
    strain = 0.5 * (F.T @ F - np.eye(3))
    S = LAMBDA * np.trace(strain) * np.eye(3) + 2 * MU * strain
    gamma = HOURGLASS - np.outer(mean[:, 2], corners[:, 2] @ HOURGLASS) / volume
    a = 0.0005 * (mean**2).sum() / volume
    return (mean @ (F @ S).T + E * a * gamma @ (gamma.T @ displacement))[DRIVEN_NODE]


@pytest.mark.parametrize(("stretch", "force"), [(0.2, 876.12676), (-0.2, -477.88732)])
def test_elastic_is_st_venant_kirchhoff(tmp_path, stretch, force):
    corners = 0.5 * CORNER + 0.5
    green = stretch + stretch**2 / 2
    assert (1 + stretch) * (LAMBDA + 2 * MU) * green == pytest.approx(force, rel=1e-7)
    found = reaction(tmp_path, corners, corners * [stretch, 0, 0])[0]
    assert found == pytest.approx(force / 4, rel=1e-6)  # a quarter of the face; seven digits are printed


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_hourglass_of_distorted_elements(tmp_path, seed):
    random = np.random.default_rng(seed)
    corners = CORNER * [0.5, 0.65, 0.4] + 0.08 * random.standard_normal((8, 3))
    displacement = 0.1 * random.standard_normal((8, 3))
    expected = predicted(corners, displacement)
    found = reaction(tmp_path, corners, displacement)
    np.testing.assert_allclose(
        found, expected, atol=1e-6 * np.abs(expected).max()
    )  # seven digits are printed


def test_linear_fields_meet_a_hourglass_force(tmp_path):
    random = np.random.default_rng(4)
    corners = CORNER * [0.5, 0.65, 0.4] + 0.08 * random.standard_normal((8, 3))
    turn = np.array([[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]])
    found = reaction(tmp_path, corners, corners @ (turn - np.eye(3)).T)
    assert np.abs(found).max() > 1e-5 * E * 0.5  # a rigid rotation; an objective element would carry nothing


@pytest.mark.parametrize("stretch", [0.2, -0.2])
def test_neo_hooke_keeps_volume_and_shape_apart(tmp_path, stretch):
    """P = G J^(-5/3) 2/3 (J^2 - 1) + K (J - 1) of W = G/2 (J^(-2/3) tr C - 3) + K/2 (J - 1)^2, confined."""
    corners, ratio = 0.5 * CORNER + 0.5, 1 + stretch
    shape = MU * ratio ** (-5 / 3) * 2 / 3 * (ratio**2 - 1)
    expected = shape + (LAMBDA + 2 / 3 * MU) * stretch
    found = reaction(tmp_path, corners, corners * [stretch, 0, 0], "neo_hookean")[0]
    assert found == pytest.approx(expected / 4, rel=1e-6)
