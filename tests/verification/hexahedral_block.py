"""Small blocks of hexahedra, for cases with exact solutions."""

import numpy as np

from knitstudy.mechanics.contact.solid import SolidModel
from knitstudy.mechanics.materials import MATERIALS
from knitstudy.mechanics.materials.transversely_isotropic import TransverselyIsotropic
from knitstudy.mechanics.solids.elements import ElementGroup
from knitstudy.mechanics.solids.elements.hexahedron import EDGES, OnePointHexahedron

LAWS = sorted(MATERIALS.names())
ISOTROPIC = [name for name in LAWS if not MATERIALS.find(name).directional]


def made_of(law, modulus=1.0, ratio=0.42):
    """The material of a law, half as stiff across its axis if it has one."""
    if law == "transversely_isotropic":
        return TransverselyIsotropic(modulus, 0.5 * modulus, ratio, 0.3, 0.25 * modulus)
    return MATERIALS.find(law)(modulus, ratio)


def block(n, distortion=0.0, seed=0):
    """Nodes (N, 3), hexahedra (n^3, 8) and the boundary's node numbers of an n x n x n block.

    Inner nodes are moved at random by `distortion` of an element's edge.
    """
    grid = np.stack(np.meshgrid(*3 * [np.linspace(0, 1, n + 1)], indexing="ij"), axis=-1).reshape(-1, 3)
    hexahedra = connect([n, n, n])
    outside = np.flatnonzero(((grid < 1e-9) | (grid > 1 - 1e-9)).any(axis=1))
    shift = np.random.default_rng(seed).uniform(-1, 1, grid.shape) * distortion / n
    shift[outside] = 0
    return grid + shift, hexahedra, outside


def connect(counts):
    """Hexahedra (E, 8) of a grid with `counts` elements along x, y and z, nodes in C order."""
    shape = np.asarray(counts) + 1
    index = np.arange(np.prod(shape)).reshape(shape)
    low, high = index[:-1], index[1:]
    bottom = [low[:, :-1, :-1], high[:, :-1, :-1], high[:, 1:, :-1], low[:, 1:, :-1]]
    top = [low[:, :-1, 1:], high[:, :-1, 1:], high[:, 1:, 1:], low[:, 1:, 1:]]
    return np.stack([corner.ravel() for corner in bottom + top], axis=1)


def solid(nodes, hexahedra, law="hencky", element=OnePointHexahedron, modulus=1300.0):
    """SolidModel of a block, nu = 0.42."""
    material = made_of(law, modulus)
    length = np.cbrt(np.ptp(nodes, axis=0).prod() / len(hexahedra))
    return SolidModel(nodes, [ElementGroup(hexahedra, element(nodes[hexahedra], material))], length)


def unknowns(nodes):
    """Unknowns of all components of some nodes."""
    return (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()


def with_middles(nodes, hexahedra):
    """Nodes (N, 3) with those in the middles of all edges after them, elements (E, 20), and the edges (M, 2)."""
    pairs = np.sort(hexahedra[:, EDGES], axis=2).reshape(-1, 2)
    edges, number = np.unique(pairs, axis=0, return_inverse=True)
    middles = len(nodes) + number.reshape(len(hexahedra), 12)
    return np.vstack([nodes, nodes[edges].mean(axis=1)]), np.hstack([hexahedra, middles]), edges
