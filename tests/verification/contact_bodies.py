"""Bodies in contact, for cases with closed forms: yarns, plates and what drives them."""

from dataclasses import dataclass, replace

import numpy as np
from curves import Straight
from hexahedral_block import connect, unknowns

from knitstudy.knit.mesh.section import SectionMesh, Spacing
from knitstudy.knit.mesh.sweep import Targets, sweep
from knitstudy.knit.yarns.discretisation import yarn_surfaces
from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.contact.grids import Grid, Grids
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.contact.solid import Penetration, SolidModel
from knitstudy.mechanics.core.increment import PrescribedDisplacement
from knitstudy.mechanics.materials import MATERIALS
from knitstudy.mechanics.solids.elements import ElementGroup
from knitstudy.mechanics.solids.elements.hexahedron import OnePointHexahedron

MODULUS = 1300.0
POISSON = 0.4


@dataclass(frozen=True)
class Body:
    """Nodes (N, 3), elements (E, 8) and the grid of one surface; numbers count from the body's own first node."""

    nodes: np.ndarray
    hexahedra: np.ndarray
    surface: Grid

    def moved(self, shift):
        return replace(self, nodes=self.nodes + shift)


def yarn(curve, radius, section, size, facing=None):
    """A swept yarn of circular section; a facet's middle faces the point `facing` from the middle of the curve."""
    middle = 0.5 * curve.length
    targets = None if facing is None else [Targets(np.array([middle]), np.array([facing]))]
    mesh = sweep([curve], section, radius, Spacing(size, stations=(middle,)), targets=targets)
    return Body(mesh.nodes, mesh.hexahedra, yarn_surfaces(mesh)[0])


def crossed_yarns(core, rings, *, radius=1.0, length=6.0, angle=90.0, gap=0.0):
    """Two straight yarns: the lower one along x, the upper one turned by `angle` degrees, `gap` apart.

    Elements are as long as they are wide.
    """
    section, size = SectionMesh.butterfly(core, rings), 2 * radius / (core + 2 * rings)
    turn = np.radians(angle)
    bodies = []
    for side, along in ((-1, np.array([1.0, 0, 0])), (1, np.array([np.cos(turn), np.sin(turn), 0]))):
        middle = np.array([0, 0, side * (radius + 0.5 * gap)])
        curve = Straight(length, middle - 0.5 * length * along, along)
        bodies.append(yarn(curve, radius, section, size, facing=np.zeros(3)))
    return bodies


def back(body, away):
    """Nodes of a straight yarn's surface on the half that is turned to the direction `away`."""
    grid = body.surface.nodes
    middle = body.nodes[grid[0]].mean(axis=0)  # of the first slice: no grading shifts its nodes
    height = (body.nodes[grid] - middle) @ away
    return np.sort(grid[height > 1e-6 * np.abs(height).max()])


def plate(counts, size, *, up, distortion=0.0):
    """A block from the origin to `size` whose surface is the upper or the lower face.

    Nodes inside, and on the other faces within their planes, are moved at random by `distortion` of an edge.
    """
    counts = np.asarray(counts)
    index = np.stack(np.meshgrid(*map(np.arange, counts + 1), indexing="ij"), axis=-1)
    edge = np.asarray(size) / counts
    shift = np.random.default_rng(0).uniform(-1, 1, index.shape) * distortion * edge
    shift[(index == 0) | (index == counts)] = 0
    numbers = np.arange(index[..., 0].size).reshape(counts + 1)
    # The normal is around x along: x runs around on top, along at the bottom.
    surface = numbers[:, :, -1].T if up else numbers[:, :, 0]
    return Body(
        (index * edge + shift).reshape(-1, 3),
        connect(counts),
        Grid(np.ascontiguousarray(surface), closed=False),
    )


def law(size, friction=0.0, normal=10.0, tangential=10.0, modulus=MODULUS):
    """Coulomb's law with stiffnesses as multiples of E / size."""
    return Coulomb(normal * modulus / size, tangential * modulus / size, friction)


def together(
    bodies,
    law,
    *,
    size,
    modulus=MODULUS,
    poisson=POISSON,
    material="hencky",
    points=3,
    overlap=None,
    **options,
):
    """SolidModel of bodies, and the first node of each body.

    Further options are those of SolidModel.
    """
    nodes, hexahedra, first, contact = touching(
        bodies, law, points=points, margin=0.5 * size, overlap=overlap or 1e-3 * size
    )
    elements = OnePointHexahedron(nodes[hexahedra], MATERIALS.find(material)(modulus, poisson))
    options = {"penetration": Penetration(0.1 * size)} | options
    return SolidModel(nodes, [ElementGroup(hexahedra, elements)], size, contact=contact, **options), first


def touching(bodies, law, **options):
    """Nodes, hexahedra and first nodes of bodies, and the contact of each with all others."""
    nodes, hexahedra, grids, first = joined(bodies)
    apart = ~np.eye(len(bodies), dtype=bool)
    return nodes, hexahedra, first, Contact(nodes, Grids(grids), law, **{"meets": apart} | options)


def joined(bodies):
    """Nodes, hexahedra and grids of all bodies in one numbering, and the first node of each."""
    first = np.concatenate([[0], np.cumsum([len(body.nodes) for body in bodies])])
    pairs = list(zip(bodies, first[:-1], strict=True))
    return (
        np.concatenate([body.nodes for body in bodies]),
        np.concatenate([body.hexahedra + low for body, low in pairs]),
        [replace(body.surface, nodes=body.surface.nodes + low) for body, low in pairs],
        first,
    )


def drive(held, driven, path, **options):
    """Hold some nodes, and move others to the corners `path` (m, 3) one after another, each leg as long a part."""
    path = np.atleast_2d(path)
    values = np.zeros((len(path), 3 * (len(held) + len(driven))))
    values[:, 3 * len(held) :] = np.tile(path, (1, len(driven)))
    corners = tuple((np.arange(len(path)) + 1) / len(path))
    return PrescribedDisplacement(unknowns(np.concatenate([held, driven])), values, corners, **options)


def reaction(increment, nodes):
    """Force (3,) that the outside puts on some nodes."""
    return increment.response.force.reshape(-1, 3)[nodes].sum(axis=0)
