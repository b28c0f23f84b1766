"""Increments along a load path, their settings, the line search, and springs that hold unknowns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.model import Model, Response

# Motion that drives a model along its load path, settings of accuracy, and the increments that result

# Phases of a Newton iteration whose time is recorded; line searches count as elements and assembly.
PHASES = ("elements", "assembly", "constraints", "setup", "solve")

FLAT = 1e-6  # extent of the prescribed nodes in a direction, over the largest, up to which it counts as zero


@dataclass(frozen=True, eq=False)
class PrescribedDisplacement:
    """Prescribed unknowns along the load path.

    Raises ConfigurationError for an unknown with a negative number, values that are not one for each unknown and
    corner, or an unknown that is prescribed twice with two values.
    """

    fixed: Ints  # (k,) indices of the prescribed unknowns
    # (k,) their change from the undeformed state, at full load or at each of the corners of the path
    value: Floats
    # Load factors of the corners, rising to 1; between them, and from zero to the first, the way is straight
    corners: tuple[float, ...] = (1.0,)
    stops: tuple[float, ...] = ()  # further load factors at which an increment has to end

    def __post_init__(self) -> None:
        value = np.atleast_2d(self.value)
        if value.shape != (len(self.corners), len(self.fixed)):
            raise ConfigurationError(
                f"{value.shape[0]} x {value.shape[1]} values are prescribed, but must be one for each of "
                f"{len(self.corners)} corners and {len(self.fixed)} unknowns"
            )
        number, first, same = np.unique(self.fixed, return_index=True, return_inverse=True)
        if len(number) and number[0] < 0:
            raise ConfigurationError(f"unknown {number[0]} is prescribed, but unknowns are numbered from 0")
        twice = (value != value[:, first[same]]).any(axis=0)
        if twice.any():
            one = value[:, first[same[twice]][0]]
            other = value[:, twice][:, 0]
            raise ConfigurationError(
                f"unknown {self.fixed[twice][0]} is prescribed twice, as {one.tolist()} and {other.tolist()}"
            )

    def require_of(self, size: int) -> None:
        """Refuse prescribed unknowns beyond the size of the model."""
        last = int(np.max(self.fixed, initial=-1))
        if last >= size:
            raise ConfigurationError(
                f"unknown {last} is prescribed, but the model has {size}, numbered from 0"
            )

    def at(self, load: float) -> Floats:
        """Return the prescribed changes (k,) at a load factor."""
        return between_corners(np.atleast_2d(self.value), self.corners, load)

    def affine(self, nodes: Floats, block: int, load: float) -> Floats:
        """Return the affine motion (N block,) of all nodes (N, 3) [m] that fits the prescribed displacements best.

        Of the unknowns of a node, the first three are its displacement; the others stay zero.

        Examples
        --------
        >>> nodes, ends = np.outer([0.0, 1.0, 4.0], [1.0, 0.0, 0.0]), np.array([0, 6])
        >>> PrescribedDisplacement(ends, np.array([0.0, 0.2])).affine(nodes, 3, load=1.0).round(6).tolist()
        [0.0, 0.0, 0.0, 0.05, 0.0, 0.0, 0.2, 0.0, 0.0]
        """
        motion = np.zeros((len(nodes), block))
        moved = self.at(load)
        node, component = np.divmod(self.fixed, block)
        for axis in range(3):
            here = np.flatnonzero(component == axis)
            if len(here):
                middle = nodes[node[here]].mean(axis=0)
                mean = moved[here].mean()
                gradient = np.linalg.lstsq(nodes[node[here]] - middle, moved[here] - mean, rcond=FLAT)[0]
                motion[:, axis] = mean + (nodes - middle) @ gradient
        return motion.ravel()

    def next_stop(self, load: float) -> float:
        """Return the next load factor at which an increment has to end."""
        return min(stop for stop in (*self.corners, *self.stops) if stop > load + 1e-12)

    def turns(self, load: float) -> bool:
        """Return whether the path has a corner at a load factor, where earlier rates are of no use."""
        return any(abs(load - corner) < 1e-12 for corner in self.corners)


def between_corners(
    values: Floats,  # (m, k), at the corners
    corners: tuple[float, ...],  # their load factors, rising
    load: float,
) -> Floats:
    """Return the linear interpolation (k,) at a load factor, from zero to the first of the values and on.

    Examples
    --------
    >>> between_corners(np.array([[1.0], [0.0]]), (0.5, 1.0), load=0.75).tolist()  # there and half of the way back
    [0.5]
    """
    loads = (0.0, *corners)
    leg = min(int(np.searchsorted(corners, load)), len(values) - 1)
    start = values[leg - 1] if leg else np.zeros_like(values[0])
    return start + (load - loads[leg]) / (loads[leg + 1] - loads[leg]) * (values[leg] - start)


@dataclass(frozen=True)
class Settings:
    """Accuracy and limits of the load path."""

    increments: int = 12  # number of equal increments; their size is the largest that is tried
    residual_tolerance: float = 1e-6  # largest unbalanced force over the mean internal force
    # largest last correction over the element size h; where a full step has balanced the state well, the next
    # one's estimate: corrections fall as residuals do
    correction_tolerance: float = 1e-6
    iterations: int = 60  # Newton iterations after which an increment counts as failed
    patience: int = 15  # iterations without a smaller residual than before after which it does
    cutbacks: int = 8  # halvings in a row after which the path counts as unreachable
    # iterations of failed attempts without progress after which a viscous flow continues: more than one may take
    vain: int = 60
    # iterations without progress after which the path counts as unreachable, of 10,000 unknowns or more
    waste: int = 240
    growth: float = 1.5  # factor on the increment after a quick one (at most `quick` iterations)
    quick: int = 6  # see `growth`
    predictor: int = 3  # largest order of the extrapolation from the increments before; 0 for none
    # largest displacement of one correction, or largest relative motion of neighbours where a model has
    # `motion_of_neighbours` [m]. Long yarns that hardly touch yet are so compliant that a correction, which includes
    # closed contacts only, would take them through each other
    stride: float = float("inf")
    # stiffness of springs around the first guess of a guide, over that of a typical unknown
    hold: float = 0.0
    remedy: str = (  # what may help where the path ends early
        "Results up to there are kept. More increments, a finer mesh, a contact stiffness nearer to that of the "
        "elements or a smaller load may help."
    )
    exact: bool = False  # solve every linear system to 1e-12 instead of as far as Newton profits


@dataclass(frozen=True)
class Rate:
    """Change of the unknowns over a converged increment: step (size,) over the increment of the load factor."""

    increment: float
    step: Floats


@dataclass(frozen=True)
class Increment:
    """A converged state on the load path and how it was reached."""

    index: int  # 0 for the undeformed state
    load: float  # load factor, 0 to 1
    state: Any  # the model's state
    response: Response  # forces and energies in this state, without tangent
    size: float  # increment of the load factor to try next
    rates: tuple[Rate, ...] = ()  # the last converged increments, newest first, for the predictor
    # (size,), change by every settling of the state, such as an update of multipliers: the first guess for
    # the next one
    updates: tuple[np.ndarray, ...] = ()
    damped: float = 0.0  # work of viscous flows so far [J]
    # most work that forces within the tolerance of the residual can have done: in this increment, and so far [J]
    unbalanced: float = 0.0
    unbalanced_so_far: float = 0.0
    newton_iterations: int = 0  # iterations spent on this increment, failed attempts included
    krylov_iterations: int = 0
    residual: float = 0.0  # final values of the two measures that `Settings` bounds
    correction: float = 0.0
    largest: float = 1.0  # largest increment to try from there on
    # load factor at which the path last made progress, and iterations since then: failed ones and all
    headway: tuple[float, int, int] = (0.0, 0, 0)
    # of the tangent of the last iteration, the prescribed unknowns held: see `LinearSolver.negative_eigenvalues`
    negative_eigenvalues: int | None = None
    residuals: tuple[float, ...] = ()  # residual measure of every iteration of the successful attempt
    timings: dict[str, float] = field(default_factory=dict)  # seconds by `PHASES`

    @property
    def dragged(self) -> float:
        """Work so far of drag and of viscous forces, without that of viscous flows [J]."""
        return self.response.energy.get("stabilisation", 0.0) - self.damped


# Line search: how much of a Newton step is taken (Crisfield 1991, section 9.2)
# Where a step closes a gap, force along it is nearly constant up to there and steep beyond. A step that is shortened
# until the residual has just fallen ends far before; the root of the force along the step, kept between brackets, does
# not.

TRIALS = 8  # states at most along one step
CLOSE = 0.5  # force along the step over that at its start, at which the root counts as found
STEEP = 0.1  # residual over that at the start of the step, at which a trial is good in any case


@dataclass(frozen=True)
class Trial:
    """A state some share along a step."""

    share: float
    step: Floats  # (size,), that share of the step
    state: Any
    response: Response
    along: float  # force along the whole step [J]
    residual: float

    @property
    def finite(self) -> bool:
        """Whether no element has folded there."""
        return bool(np.isfinite(self.along))


def line_search(
    trial: Callable[[float], Trial],  # the trial at a share of the step
    slope: float,  # force along the step at its start [J]
    residual: float,  # residual there
    tolerance: float,  # residual of a balanced state
) -> Trial | None:
    """Return the trial to go on with, or None if there is none that helps."""
    low, high = (0.0, slope), (np.inf, np.nan)  # brackets: shares, and the forces there
    share = 1.0
    best: Trial | None = None
    # Full steps from a balanced state may go back and forth across a kink of the force.
    enough = max(STEEP * residual, tolerance if residual > tolerance else 0.0)
    for _ in range(TRIALS):
        tried = trial(share)
        if not tried.finite:
            high = share, np.nan
            share = low[0] + 0.25 * (share - low[0])
            continue
        if tried.residual <= enough or abs(tried.along) <= CLOSE * abs(slope):
            return tried
        if best is None or abs(tried.along) < abs(best.along):
            best = tried
        before_root = tried.along * slope > 0
        if before_root and np.isnan(high[1]):
            if _is_nearer(tried, residual, slope):
                return tried
            high = share, np.nan
        elif before_root:
            low = share, tried.along
        else:
            high = share, tried.along
        share = _between(low, high, first=high[0] == 1.0 and low[0] == 0.0)
    return best if best is not None and _helps(best, max(residual, tolerance)) else None


def _is_nearer(trial: Trial, residual: float, slope: float) -> bool:
    """Whether a full step is nearer to balance, as where the tangent is too stiff for the root to lie within it."""
    return trial.residual <= residual or abs(trial.along) <= abs(slope)


def _helps(trial: Trial, residual: float) -> bool:
    """Whether a trial is worth going on with, though its force along the step is not small.

    Where points begin to touch or to slip, the force jumps: a new tangent helps more than a shorter step.
    """
    return trial.response.status is not None or trial.residual < residual


def _between(low: tuple[float, float], high: tuple[float, float], first: bool) -> float:
    """Return the next share to try, by regula falsi; away from the brackets, so that both move."""
    if np.isnan(high[1]):
        part = 0.5
    else:
        edge = 0.1 if first else 0.25
        part = min(max(low[1] / (low[1] - high[1]), edge), 1 - edge)
    return low[0] + part * (high[0] - low[0])


def extrapolated(
    rates: tuple[Rate, ...],  # the last increments, newest first; as many as the polynomial's order
    change: float,  # of the load factor
) -> Floats:
    """Return the change (size,) of the unknowns by the polynomial through the last converged states.

    Examples
    --------
    >>> rates = Rate(0.1, np.array([2.0])), Rate(0.1, np.array([1.0]))
    >>> extrapolated(rates, change=0.1).round(12).tolist()
    [0.3]
    """
    # Newton's divided differences: rates are the first ones.
    differences = [rate.step for rate in rates]
    widths = [rate.increment for rate in rates]
    guess = change * differences[0]
    factor = change
    for order in range(1, len(rates)):
        spans = [sum(widths[i : i + order + 1]) for i in range(len(rates) - order)]
        differences = [
            (newer - older) / span
            for newer, older, span in zip(differences[:-1], differences[1:], spans, strict=True)
        ]
        factor *= change + sum(widths[:order])
        guess += factor * differences[0]
    return guess


# Springs that hold all unknowns of a model near a state: as viscous forces do, or around a first guess


@dataclass(frozen=True, eq=False)
class Hold:
    """A spring on every unknown."""

    stiffness: Floats  # (size,), force over displacement
    free: Floats | float = 0.0  # (size,), change within the increment at which the springs carry nothing

    def added(self, response: Response, change: Floats | float) -> Response:
        """Return the response of a model and of its springs, after a change (size,) within the increment.

        Examples
        --------
        >>> springs = Hold(np.array([2.0, 2.0]), free=np.array([0.0, 0.5]))
        >>> springs.added(Response(np.zeros(2), mean_force=1.0), np.array([0.5, 0.5])).force.tolist()
        [1.0, 0.0]
        """
        if response.stiffness is not None:
            add_diagonal(response.tangent, self.stiffness)
        return replace(response, force=response.force + self.stiffness * (change - self.free))


def typical_stiffness(model: Model, fixed: Ints) -> Floats:
    """Return the stiffness (size,) of a typical unknown at rest; the prescribed unknowns (k,) have none."""
    rest = model.respond(model.begin(model.start(), 1.0, 1.0), stiffness=True)
    unit = np.median(np.abs(rest.tangent.diagonal()) / model.scale**2) * model.scale**2
    unit[fixed] = 0.0
    return unit


def add_diagonal(matrix: Any, diagonal: Floats) -> None:
    """Add a diagonal (size,) to a BSR or CSR matrix whose pattern has it, in place.

    Examples
    --------
    >>> from scipy.sparse import csr_matrix
    >>> matrix = csr_matrix([[1.0, 2.0], [2.0, 1.0]])
    >>> add_diagonal(matrix, np.array([3.0, 4.0]))
    >>> matrix.diagonal().tolist()
    [4.0, 5.0]
    """
    block = matrix.blocksize[0] if matrix.format == "bsr" else 1
    row = np.repeat(np.arange(len(matrix.indptr) - 1), np.diff(matrix.indptr))
    own = np.flatnonzero(row == matrix.indices)
    i = np.arange(block)
    matrix.data.reshape(-1, block, block)[own[:, None], i, i] += diagonal.reshape(-1, block)[row[own]]
