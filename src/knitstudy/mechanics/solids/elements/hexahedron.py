"""Hexahedra in total Lagrangian form, in batches: of eight nodes with one integration point, and quadratic ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.errors import MeshError
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.batches import SCRATCH, determinant, inverse
from knitstudy.mechanics.materials import FULL, Material, axes_along
from knitstudy.mechanics.solids.elements import ELEMENTS, ElementResponse, Elements

_LOWER = np.array([(-1.0, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)])
CORNERS = np.concatenate([_LOWER, _LOWER * [1, 1, -1]])  # natural coordinates (8, 3) of the nodes

GAUSS = CORNERS / np.sqrt(3)  # the eight Gauss points (8, 3); all weights are 1
STEP = 1e-30  # along the imaginary axis: nothing is subtracted
Functions = Callable[[np.ndarray], np.ndarray]  # shape functions (k, a) at natural coordinates (k, 3)


def shape(natural: np.ndarray) -> np.ndarray:
    """Return the trilinear shape functions (k, 8) at natural coordinates (k, 3).

    Examples
    --------
    >>> shape(np.zeros((1, 3)))  # the nodes count alike in the middle of an element
    array([[0.125, 0.125, 0.125, 0.125, 0.125, 0.125, 0.125, 0.125]])
    """
    return 0.125 * (1 + CORNERS * natural[:, None]).prod(axis=2)


def shape_gradient(natural: Floats, functions: Functions = shape) -> Floats:
    """Return the gradients (k, a, 3) of shape functions: exact, by a complex step (Squire and Trapp 1998)."""
    return np.stack([functions(natural + STEP * d).imag for d in 1j * np.eye(3)], axis=2) / STEP


GRADIENTS = shape_gradient(GAUSS)  # natural gradients (8 points, 8 nodes, 3) at the Gauss points


def jacobians(corners: Floats, gradient: Floats) -> tuple[Floats, Floats]:
    """Return determinant (e,) and spatial gradients (e, 8, 3) of elements (e, 8, 3) at one point.

    Raises MeshError if an element is folded there.

    Examples
    --------
    >>> corners = np.array([[x, y, z] for z in (0, 2) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
    >>> jacobians(corners[None], shape_gradient(np.zeros((1, 3)))[0])[0].tolist()  # volume 2 over that of (-1, 1)^3
    [0.25]
    """
    jacobian = np.swapaxes(corners, 1, 2) @ gradient  # dX_i / dxi_j
    size = determinant(jacobian)
    if np.any(size <= 0):
        worst = int(np.argmin(size))
        raise MeshError(
            f"element {worst} is folded: its Jacobian is {size[worst]:.3g} and has to be positive; "
            "use a finer mesh or a thinner yarn"
        )
    return size, gradient @ inverse(jacobian)[0]


def natural_axes(corners: Floats, natural: Floats) -> Floats:
    """Return local axes (q, e, 3, 3) of elements at natural coordinates (q, 3), the first along the third coordinate.

    Corners alone count; swept meshes have their yarns along it.
    """
    along = np.swapaxes(corners[:, :8], 1, 2) @ shape_gradient(natural)[:, None, :, 2:]  # (q, e, 3, 1)
    return axes_along(along.reshape(-1, 3)).reshape(len(natural), len(corners), 3, 3)


def tangent_moduli(deformation: Floats, stress: Floats, moduli: Floats, out: Floats) -> None:
    """Put A[J, L, i, k] = F_iI C_IJKL F_kK + S_JL delta_ik into `out` (e, 9, 9), rows (J, L), columns (i, k)."""
    e = len(deformation)
    full = SCRATCH.array("moduli", e, 81)  # (J, L), (I, K)
    np.take(moduli.reshape(e, 36), _PAIRS, axis=1, out=full, mode="clip")
    both = SCRATCH.array("deformation twice", e, 3, 3, 3, 3)  # F_iI F_kK, (I, K), (i, k)
    columns = np.swapaxes(deformation, 1, 2)
    np.multiply(columns[:, :, None, :, None], columns[:, None, :, None, :], out=both)
    np.matmul(full.reshape(e, 9, 9), both.reshape(e, 9, 9), out=out)
    for diagonal in (0, 4, 8):
        out[:, :, diagonal] += stress.reshape(e, 9)


# Position of C_IJKL among 6 x 6 moduli in the order J, L, I, K.
_PAIRS = (6 * FULL.T[:, None, :, None] + FULL.T[None, :, None, :]).ravel()


def gradient_stiffness(
    gradient: Floats,  # (e, a, q 3), spatial gradients g at q points
    weighted: Floats,  # (e, q, b, 3), gradients times the volumes of the points, w
    moduli: Floats,  # (e, q, 9, 9), A of `tangent_moduli`
    out: Floats,  # (e, a b, 9)
) -> None:
    """Put K[a, b, i, k] = sum over points of g_aJ A[J, L, i, k] w_bL into `out`, in two products."""
    e, q, b, _ = weighted.shape
    half = SCRATCH.array("half of the stiffness", e, q, 3, b, 9)  # J, b, (i, k)
    np.matmul(weighted[:, :, None], moduli.reshape(e, q, 3, 3, 9), out=half)
    np.matmul(gradient, half.reshape(e, 3 * q, 9 * b), out=out.reshape(e, gradient.shape[1], 9 * b))


class HexahedronElements(Elements):
    """Elements of n nodes and q points each, in total Lagrangian form.

    Forces are not numbers where an element is folded at one of its points.
    """

    def __init__(
        self,
        corners: Floats,  # (E, n, 3), undeformed nodes [m]; yarns lie along the third natural coordinate
        material: Material,
        points: Floats,  # (q, 3), natural coordinates
        weight: Floats,  # (E, q), volumes of the points [m3]
        gradient: Floats,  # (E, n, q, 3), spatial gradients of the shape functions there [1/m]
    ) -> None:
        self.material, self.weight, self.gradient = material, weight, gradient
        self.volume = weight.sum(axis=1)
        self.axes = np.swapaxes(natural_axes(corners, points), 0, 1) if material.directional else None

    def _respond(
        self, here: slice, displacement: Floats, out: Floats | None, step: Floats | None
    ) -> tuple[Floats, Floats]:
        gradient, weight = self.gradient[here], self.weight[here]
        e, n, q, _ = gradient.shape
        flat = gradient.reshape(e, n, 3 * q)
        rows = (np.swapaxes(flat, 1, 2) @ displacement).reshape(-1, 3, 3)  # H transposed, of all points
        columns = np.swapaxes(rows, 1, 2)
        strain = 0.5 * (rows + columns + rows @ columns)  # keeps the digits of small strains
        axes = None if self.axes is None else self.axes[here].reshape(-1, 3, 3)
        answer = self.material.respond(strain, out is not None, axes)
        deformation = columns + np.eye(3)
        share = weight.reshape(-1, 1, 1)
        stress = share * answer.stress
        first = stress @ np.swapaxes(deformation, 1, 2)  # P transposed, times the volume of the point
        force = flat @ first.reshape(e, 3 * q, 3)
        energy = np.einsum("eq,eq->e", weight, answer.energy.reshape(e, q))
        # An element turned inside out has no energy in terms of E: the load path has to reject it.
        force[(determinant(deformation) <= 0).reshape(e, q).any(axis=1)] = np.nan
        if out is not None:
            moduli = SCRATCH.array("tangent moduli", e * q, 9, 9)
            tangent_moduli(deformation, stress, share * answer.moduli, moduli)
            gradient_stiffness(flat, np.swapaxes(gradient, 1, 2), moduli.reshape(e, q, 9, 9), out)
        return force, energy


def integrated(corners: Floats, gradients: Floats) -> tuple[Floats, Floats]:
    """Return volumes (E, q) [m3] and spatial gradients (E, n, q, 3) [1/m] of elements (E, n, 3) at q points.

    `gradients` (q, n, 3) are those of the shape functions in natural coordinates. Raises MeshError if an element is
    folded at one of the points.
    """
    weight = np.empty((len(corners), len(gradients)))
    spatial = np.empty((*corners.shape[:2], len(gradients), 3))
    for q, natural in enumerate(gradients):
        weight[:, q], spatial[:, :, q] = jacobians(corners, natural)
    return weight, spatial


@ELEMENTS.register
class EightPointHexahedron(HexahedronElements):
    """Eight-node hexahedron with 2 x 2 x 2 Gauss points: fully integrated, which locks where it bends.

    The element that reduced integration is compared with. Raises MeshError if an element is folded at a point.
    """

    name, meaning, nodes = "eight_point", "full integration, which locks", 8
    few = 128

    def __init__(
        self,
        corners: Floats,  # (E, 8, 3), undeformed nodes [m]
        material: Material,
        coefficient: float = 0.0,  # of hourglass control, which it does without
    ) -> None:
        super().__init__(corners, material, GAUSS, *integrated(corners, GRADIENTS))


# Hexahedron with one integration point and hourglass control

_X, _Y, _Z = CORNERS.T
# Vectors (4, 8) of Flanagan and Belytschko (1981)
HOURGLASS = np.stack([_Y * _Z, _X * _Z, _X * _Y, _X * _Y * _Z])


@ELEMENTS.register
class OnePointHexahedron(HexahedronElements):
    """Mean-gradient hexahedron with stiffness hourglass control (Flanagan and Belytschko 1981).

    The mean gradient passes the patch test on any mesh. The hourglass force is a constant matrix times the
    positions of the nodes; since it is a scalar for all three components and gamma . X = 0, it is exactly
    objective and cannot do work on a linear field.
    """

    name, meaning, nodes = "one_point", "with hourglass control", 8
    few = 512

    def __init__(
        self,
        corners: Floats,  # (E, 8, 3), undeformed nodes [m]; yarns lie along the third natural coordinate
        material: Material,
        coefficient: float = 0.005,  # hourglass stiffness over shear stiffness; 0.005 as in C3D8R
    ) -> None:
        volume = np.zeros(len(corners))
        mean = np.zeros(corners.shape)
        for gradient in GRADIENTS:
            size, spatial = jacobians(corners, gradient)
            volume += size
            mean += size[:, None, None] * spatial
        mean /= volume[:, None, None]
        super().__init__(corners, material, np.zeros((1, 3)), volume[:, None], mean[:, :, None])
        # Shares (E, 4, 3) of linear fields in the hourglass patterns [m]: the vectors take 2.7 times as much memory,
        # and next to no time to be formed.
        self.tilt = HOURGLASS @ corners
        size = np.einsum("eai,eai->e", mean, mean)
        self.hourglass_stiffness = coefficient * material.shear_modulus * volume * size

    def respond(
        self,
        batch: slice,
        displacement: Floats,
        stiffness: bool,
        out: Floats | None = None,
        step: Floats | None = None,
    ) -> ElementResponse:
        """Return the response of the elements `batch` to their displacements (e, 8, 3) [m]."""
        answer = super().respond(batch, displacement, stiffness, out)
        hourglass = self.hourglass_stiffness[batch]
        # gamma_m = (Gamma_m - (Gamma_m . X_i) dN_i) / sqrt(8), (e, 4, 8): orthogonal to linear fields
        linear = self.tilt[batch] @ np.swapaxes(self.gradient[batch, :, 0], 1, 2)
        gamma = (HOURGLASS - linear) / np.sqrt(8)
        mode = gamma @ displacement  # (e, 4, 3)
        control = np.swapaxes(hourglass[:, None, None] * gamma, 1, 2)
        answer.force[:] += control @ mode
        answer.hourglass[:] = 0.5 * hourglass * np.einsum("emi,emi->e", mode, mode)
        if answer.stiffness is not None:
            for diagonal in (0, 4, 8):
                answer.stiffness[:, :, diagonal] += (control @ gamma).reshape(-1, 64)
        return answer


# Which material point lies at a place: the inverse of a map, by Newton's method in batches

CANDIDATES = 8  # elements that are tried for a point, nearest centres first
MAP_STEPS = 25
CLOSE = 1e-12  # distance from the point, over the size of the element, at which the iteration ends
FARTHEST = 2.0  # largest natural coordinate at which an element still answers for a point outside of it
# Places (m, 3) and their derivatives (m, 3, 3) of points of numbers (m,) at coordinates (m, 3).
Map = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def inverted(mapped: Map, points: Floats, start: Floats, close: Floats) -> Floats:
    """Return the coordinates (k, 3) of points (k, 3), to within distances (k,); nan where it gets nowhere.

    Examples
    --------
    >>> def doubled(number, at):
    ...     return 2 * at, np.repeat(2 * np.eye(3)[None], len(at), axis=0)
    >>> inverted(doubled, np.array([[1.0, 0.5, 0.0]]), np.zeros((1, 3)), np.array([1e-9])).tolist()
    [[0.5, 0.25, 0.0]]
    """
    solution = start.copy()
    moving = np.arange(len(points))
    for _ in range(MAP_STEPS):
        place, slope = mapped(moving, solution[moving])
        apart = points[moving] - place
        far = np.abs(apart).max(axis=1) > close[moving]
        moving = moving[far]
        if not len(moving):
            return solution
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.einsum("kij,kj->ki", inverse(slope[far])[0], apart[far])
        # Far outside of an element its map can fold; steps of bounded length come back from there.
        solution[moving] += np.clip(np.nan_to_num(step), -1, 1)
    solution[moving] = np.nan
    return solution


def require_near(near: Bools, points: Floats, yarn: Ints) -> None:
    """Raise MeshError if a point of (k, 3) is not `near` (k,) its yarn (k,)."""
    if not near.all():
        first = int(np.argmin(near))
        place = ", ".join(f"{value:.6g}" for value in points[first])
        raise MeshError(f"the place ({place}) is too far from yarn {yarn[first]} to be a part of it")


@dataclass(frozen=True, eq=False)
class InverseMap:
    """Material points of all yarns, by their places."""

    nodes: Floats  # (N, 3) [m]
    elements: np.ndarray  # (E, a), their nodes
    yarn: Ints  # (N,), of every node
    shape: Functions  # of the elements

    def locate(
        self,
        points: Floats,  # (k, 3), places in or next to yarns [m]
        yarn: Ints,  # (k,), the yarn that each belongs to
    ) -> tuple[Ints, Floats]:
        """Return the nodes (k, a) and weights (k, a) whose sum a material point is.

        A point outside is given by the element that it is least far out of, which goes on as its functions do.

        Raises MeshError if a place is too far from its yarn.
        """
        nearest = np.empty((len(points), self.elements.shape[1]), dtype=np.int64)
        natural = np.empty((len(points), 3))
        owner = self.yarn[self.elements[:, 0]]
        for number in np.unique(yarn):
            here = yarn == number
            nearest[here], natural[here] = self._nearest(self.elements[owner == number], points[here])
        require_near(np.abs(natural).max(axis=1) <= FARTHEST, points, yarn)
        return nearest, self.shape(natural)

    def _nearest(self, elements: np.ndarray, points: Floats) -> tuple[np.ndarray, Floats]:
        """Return nodes (k, a) of the elements that points lie in, or least far out of, and where in them (k, 3)."""
        count = min(CANDIDATES, len(elements))
        near = cKDTree(self.nodes[elements].mean(axis=1)).query(points, k=np.arange(1, count + 1))[1]
        best = np.full(points.shape, np.nan)
        outside = np.full(len(points), np.inf)
        chosen = near[:, 0].copy()
        for candidate in near.T:
            asked = np.flatnonzero(outside > 1)
            corners = self.nodes[elements[candidate[asked]]]
            natural = natural_coordinates(corners, points[asked], self.shape)
            reach = np.abs(natural).max(axis=1)
            better = reach < outside[asked]  # not where it is nan
            these = asked[better]
            best[these], outside[these], chosen[these] = natural[better], reach[better], candidate[these]
        return elements[chosen], best


def natural_coordinates(
    corners: Floats,  # (k, a, 3), nodes of one element for every point [m]
    points: Floats,  # (k, 3), [m]
    shape: Functions,  # of the element
) -> Floats:
    """Return the natural coordinates (k, 3) of points in elements; nan where the iteration does not get there.

    Examples
    --------
    >>> cube = 0.5 * (1 + CORNERS)[None]  # of unit edges
    >>> natural_coordinates(cube, np.array([[0.5, 0.75, 1.0]]), shape).tolist()
    [[0.0, 0.5, 1.0]]
    """

    def mapped(number: Ints, natural: Floats) -> tuple[Floats, Floats]:
        own = corners[number]
        gradient = shape_gradient(natural, shape)
        return np.einsum("ka,kai->ki", shape(natural), own), np.swapaxes(own, 1, 2) @ gradient

    return inverted(mapped, points, np.zeros_like(points), CLOSE * np.ptp(corners, axis=1).max(axis=1))


# Quadratic hexahedron with twenty nodes: edges are curved, integration is reduced
# Serendipity functions (Zienkiewicz, Taylor and Zhu 2013, section 6.7.2). Nodes are in the order of VTK, which is that
# of C3D20R in Abaqus and CalculiX as well: corners, then the middles of the lower edges, of the upper ones, and of
# those between them.

EDGES = np.array(
    [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
)
"""Corners (12, 2) that the nodes 8 to 19 lie between."""

NATURAL = np.concatenate([CORNERS, CORNERS[EDGES].mean(axis=1)])  # natural coordinates (20, 3) of the nodes
NODES = len(NATURAL)


def quadratic_shape(natural: np.ndarray) -> np.ndarray:
    """Return the shape functions (k, 20) at natural coordinates (k, 3).

    Examples
    --------
    >>> float(quadratic_shape(np.zeros((1, 3))).sum().round(12))
    1.0
    """
    factor = 1 + NATURAL * natural[:, None]  # (k, 20, 3)
    product = factor.prod(axis=2)
    reach = (CORNERS * natural[:, None]).sum(axis=2) - 2
    bubble = 1 - natural**2
    along = np.argmin(np.abs(NATURAL[8:]), axis=1)
    return np.concatenate([product[:, :8] * reach / 8, product[:, 8:] * bubble[:, along] / 4], axis=1)


# Natural gradients (8 points, 20 nodes, 3) at the Gauss points
QUADRATIC_GRADIENTS = shape_gradient(GAUSS, quadratic_shape)


@ELEMENTS.register
class QuadraticHexahedron(HexahedronElements):
    """Twenty-node hexahedron with 2 x 2 x 2 Gauss points.

    Eight points see 48 of the 54 deformations of one element: six of its modes cost no energy. A single row of elements
    has some of them as well; where two by two lie side by side, as in the section of any yarn, there are none left.

    Raises MeshError if an element is folded at one of its points.
    """

    name = "quadratic"
    meaning = "20 nodes on curved edges, reduced integration"
    nodes = NODES
    few = 64

    def __init__(
        self,
        corners: Floats,  # (E, 20, 3), undeformed nodes [m]
        material: Material,
        coefficient: float = 0.0,  # of hourglass control, which it does without
    ) -> None:
        super().__init__(corners, material, GAUSS, *integrated(corners, QUADRATIC_GRADIENTS))
