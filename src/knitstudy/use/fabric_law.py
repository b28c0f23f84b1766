"""The laws of a fabric as a membrane, fitted to states of its cell, and strips of the fabric with such a law.

States are stretches and the forces per width with them.

**Exponentials.** Residuals are differences of forces per width over the force that a path reaches: tensions over its
largest tension where that is more than its shear, shear over its largest shear force where that is more. So a soft path
counts as a stiff one, and shear, which is softer than tension by physics, has a scale of its own. The other kind of
force is over the largest one of all paths: the tension that a law has in a shear whose edges are free would otherwise
outweigh, over the few N/m of the shear, all tension. Weights of the law (`use.membrane_law`) are not
negative and forces linear in them: of a dictionary of quadratic and exponential terms, non-negative least squares
(Lawson and Hanson 1974, chapter 23) find the nearest convex law and choose its terms; terms that are not needed for the
wanted error go, one by one. Intervals follow from linear least squares with Student's t for the terms that stay, as if
residuals were independent noise. Residuals are in fact deviations of the law's form, so `error` is the better measure.

**Linear.** The law S = A E of decks is the nearest one by the energy of its residual (`fit_linear`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
import xarray as xr
from scipy.linalg import eigh
from scipy.optimize import nnls, root
from scipy.stats import t as student

from knitstudy.datasets import STRAINS
from knitstudy.errors import ConvergenceError, DataFileError
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import Chosen
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.use.membrane_law import (
    ExponentialLaw,
    MembraneLaw,
    MembraneModel,
    forces_per_width,
    green,
    rectangle,
)

LEVEL = 0.95  # of the intervals
ERROR = 0.01  # of the residuals (root mean square) that a law of exponentials may have
SPARE = 1.1  # of the least error, where that is larger
PATIENCE, HEADWAY = 6, 0.98  # terms that have to lower the error by that factor together
# Slopes times the largest strains: directions in the plane of both tensions, in steps up to shear; 0 is quadratic
ANGLES = np.radians(np.arange(0, 360, 7.5))
SHEARS = np.radians(np.arange(0, 91, 15))
SIZES = (0.0, 0.5, 1.0, 2.0, 3.0, 4.5, 6.0, 8.0, 12.0)  # steeper curves are a corner
MIRROR = np.array([1.0, 1.0, -1.0])
AXES = ("11", "22", "12")
ENTRIES = np.tril_indices(3)  # of a form
NOTHING = 1e-4  # strains below it count as none
SHEARED, ALIGNED = 0.3, 0.02  # shares of shear in a state: of one that is sheared; of none
LEAST = 4  # states that a law is fitted to
LARGEST_FACTOR = 2.0  # by which a deck may miss the force of a path where it holds
SECANTS = (1.0, 0.75, 0.5, 0.25)  # shares of the largest strains at which a secant is tried
LEAST_EIGENVALUE = 1e-4  # of a deck's law, over the largest: single precision (6e-8) keeps three digits


@dataclass(frozen=True, eq=False)
class States(Chosen):
    """Stretches e = U - 1 (n, 3), shear doubled, and forces per width (n, 3) [N/m] of a fabric; paths (n,) by name."""

    stretch: np.ndarray
    force: np.ndarray
    path: np.ndarray

    @classmethod
    def of(cls, histories: dict[str, xr.Dataset]) -> States:
        """Return the states of cells (histories with `cell_strain` and `force_per_width`), on the way to full load."""
        parts: list[States] = []
        for name, history in histories.items():
            if "cell_strain" not in history or "pressure" in history:
                raise DataFileError(f"{name}: is not a history of a cell without plates, which a law needs")
            stretch = history["cell_strain"].to_numpy()
            stretch = stretch[: np.argmax(np.linalg.norm(stretch, axis=1)) + 1]  # without unloading
            force = history["force_per_width"].to_numpy()[: len(stretch)]
            if not np.any(force):
                raise DataFileError(f"{name}: has no forces; leave it out, or strain the cell more")
            parts.append(cls(stretch, force, np.full(len(stretch), name, dtype=object)))
        every = parts[0].joined(*parts[1:])
        chosen = np.isfinite(every.force).all(axis=1) & (np.abs(every.stretch).max(axis=1) > 0)
        if chosen.sum() < LEAST:
            raise DataFileError(f"{chosen.sum()} states of cells are too few for a law: {LEAST} are needed")
        states = every[chosen]
        known = {
            "is strained": np.abs(states.stretch).max(axis=0) >= NOTHING,
            "has a force": states.part_way(1.0).driven.any(axis=0),
        }
        for verb, is_known in known.items():
            if missing := [name for name, known_one in zip(STRAINS, is_known, strict=True) if not known_one]:
                what = f"no state {verb} in {', '.join(missing)}: the law would not know the stiffness"
                raise DataFileError(f"{what}; add a cell whose load.deformation is {' or '.join(missing)}")
        return states

    @property
    def mirrored(self) -> bool:
        """Whether tension brings no shear: states with nearly no other strain have no shear force, nor shear."""
        shear = [np.abs(part[:, 2]) / np.linalg.norm(part, axis=1) for part in (self.stretch, self.force)]
        tension = shear[0] < SHEARED
        return bool(np.all(shear[0][tension] < ALIGNED) and np.all(shear[1][tension] < ALIGNED))

    @property
    def largest(self) -> np.ndarray:
        """Largest extension (3,) in course and wale under tension along it, and largest shear of either sign."""
        pulled = self.force[:, :2] > NOTHING * np.linalg.norm(self.force, axis=1)[:, None]
        extension = self.stretch[:, :2].max(axis=0, initial=0.0, where=pulled)
        return np.append(extension, np.abs(self.stretch[:, 2]).max())

    @property
    def scale(self) -> np.ndarray:
        """Forces (n, 3) that residuals are over [N/m]: tension or shear of the path, the larger one; else of all."""
        size = np.stack([np.linalg.norm(self.force[:, :2], axis=1), np.abs(self.force[:, 2])], axis=1)
        reached = np.empty_like(size)
        for name in dict.fromkeys(self.path):
            reached[self.path == name] = size[self.path == name].max(axis=0)
        larger = reached == reached.max(axis=1, keepdims=True)
        return np.where(larger, reached, size.max(axis=0))[:, [0, 0, 1]]

    def symmetric(self) -> States:
        """Return states whose shear is none where there is no shear force.

        A rib leans to one side on the way, as a column buckles: its cell shears by itself, which no law that is alike
        for shear of either sign can have.
        """
        stretch = self.stretch.copy()
        stretch[~self.driven[:, 2], 2] = 0.0
        return States(stretch, self.force, self.path)

    def part_way(self, share: float) -> States:
        """Return one state of every path, in their order: that whose strain is nearest to a share of the largest."""
        size = np.linalg.norm(self.stretch, axis=1)
        chosen = []
        for name in dict.fromkeys(self.path):
            places = np.flatnonzero(self.path == name)
            chosen.append(places[np.abs(size[places] - share * size[places].max()).argmin()])
        return self[np.array(chosen)]

    @property
    def driven(self) -> np.ndarray:
        """Whether a component (n, 3) carries a force; others are free."""
        return np.abs(self.force) > NOTHING * np.linalg.norm(self.force, axis=1)[:, None]


@dataclass(frozen=True, eq=False)
class LawFit:
    """A law and how well it is known."""

    law: ExponentialLaw
    names: tuple[str, ...]  # of its coefficients
    value: np.ndarray  # (p,)
    half: np.ndarray  # (p,) of the intervals: value - half to value + half
    residual: np.ndarray  # (n, 3) of the states, over their scale
    states: States

    @property
    def error(self) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(np.mean(np.sum(self.residual**2, axis=1))))

    @property
    def errors(self) -> dict[str, tuple[float, float]]:
        """Root mean square and largest residual of every path."""
        size = np.linalg.norm(self.residual, axis=1)
        parts = {name: size[self.states.path == name] for name in dict.fromkeys(self.states.path)}
        return {name: (float(np.sqrt(np.mean(part**2))), float(part.max())) for name, part in parts.items()}


def _few_terms(columns: Floats, goal: Floats, error: float) -> tuple[Ints, Floats]:
    """Return the columns (k,) of all (n, terms) that an error of the goal (n,) needs, and their weights (k,)."""
    norm = np.linalg.norm(columns, axis=0)

    def solve(chosen: Ints) -> tuple[Floats, float]:
        weight, left = nnls(columns[:, chosen] / norm[chosen], goal)
        return weight / norm[chosen], left * np.sqrt(3 / len(goal))

    # Lawson and Hanson's method, which ends where the error is small enough or falls no more
    chosen = np.empty(0, dtype=int)
    left = goal
    errors = [np.inf] * PATIENCE
    while errors[-1] > error and not errors[-1] > errors[-PATIENCE] * HEADWAY:
        chosen = np.unique(np.append(chosen, np.argmax(left @ columns / norm)))
        weight, misfit = solve(chosen)
        chosen, left = chosen[weight > 0], goal - columns[:, chosen] @ weight
        errors.append(misfit)
    allowed = max(error, SPARE * errors[-1])
    while len(chosen) > 1:
        fewer = [np.delete(chosen, place) for place in range(len(chosen))]
        solved = [solve(terms) for terms in fewer]
        best = int(np.argmin([misfit for _, misfit in solved]))
        if solved[best][1] > allowed:
            break
        chosen = fewer[best][solved[best][0] > 0]
    return chosen, solve(chosen)[0]


def fit_exponentials(
    states: States, mirrored: bool = True, error: float = ERROR, sizes: Sequence[float] = SIZES
) -> LawFit:
    """Return the law of few exponentials with that error, or with nearly the least that there is.

    Of a `mirrored` law shear of either sign is the same (an orthotropic fabric). With `sizes` of (0,) the dictionary
    has quadratic terms alone.
    """
    strain, derivative = green(states.stretch)
    slope, size = _dictionary(mirrored, sizes)
    slope = slope / _reach(strain)
    pair = (slope, slope * MIRROR) if mirrored else (slope,)
    forces = np.zeros((len(strain), len(AXES), len(slope)))
    for mode in pair:
        along = strain @ mode.T
        factor = np.where(size > 0, np.expm1(along), along) / len(pair)
        forces += np.einsum("nk,ki,nij->njk", factor, mode, derivative, optimize=True)
    columns = (forces / states.scale[..., None]).reshape(-1, len(slope))
    goal = (states.force / states.scale).ravel()
    chosen, weight = _few_terms(columns, goal, error)
    flat = size[chosen] == 0
    curved = size[chosen] > 0
    slope = slope[chosen]
    both = [modes[chosen] for modes in pair]
    dyads = sum(np.einsum("ki,kj->kij", modes, modes) for modes in both) / len(pair)  # of a term's form
    law = ExponentialLaw(
        np.einsum("k,kij->ij", weight * flat, dyads),
        np.tile(weight[curved], len(pair)) / len(pair),
        np.concatenate([modes[curved] for modes in both]),
    )
    used = columns[:, chosen]
    residual = used @ weight - goal
    freedom = max(len(goal) - len(chosen), 1)
    root = np.linalg.pinv(used).T * np.linalg.norm(residual) / np.sqrt(freedom)  # of the covariance
    level = student.ppf(0.5 + LEVEL / 2, freedom)
    forms = np.moveaxis(dyads, 0, -1)[ENTRIES] * flat  # (6, k)
    parts = root @ forms.T, root[:, curved]
    half = level * np.concatenate([np.linalg.norm(part, axis=0) for part in parts])
    names = [f"A_{AXES[j]}_{AXES[i]} [N/m]" for i, j in zip(*ENTRIES, strict=True)]
    names += [f"w ({' '.join(f'{a:.3g}' for a in mode)}) [N/m]" for mode in slope[curved]]
    value = np.concatenate([law.form[ENTRIES], weight[curved]])
    return LawFit(law, tuple(names), value, half, residual.reshape(-1, 3), states)


def _reach(strain: np.ndarray) -> np.ndarray:
    """Return the largest strains (3,); for components that are nearly zero, the largest of the others."""
    reach = np.abs(strain).max(axis=0)
    return np.where(reach > 1e-3 * reach.max(), reach, reach.max())


def _dictionary(mirrored: bool, sizes: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return slopes (k, 3) in units of the largest strains, and their sizes (k,): of quadratic terms 0."""
    shears = SHEARS if mirrored else np.concatenate([SHEARS, -SHEARS[1:]])
    size, angle, shear = (axis.ravel() for axis in np.meshgrid(sizes, ANGLES, shears, indexing="ij"))
    plane = np.stack([np.cos(angle) * np.cos(shear), np.sin(angle) * np.cos(shear), np.sin(shear)], axis=-1)
    return np.where(size > 0, size, 1.0)[:, None] * plane, size


def fit_linear(states: States, mirrored: bool = True) -> np.ndarray:
    """Return A (3, 3) [N/m] of the law S = A E that is nearest to states by the energy of the residual.

    The error in the constitutive relation (Ladeveze and Leguillon 1983) of stresses S and strains E is

        sum (S - A E) . A^-1 (S - A E) = tr(A P) + tr(A^-1 Q) - 2 sum S . E,   P = sum E E^T,   Q = sum S S^T

    It is convex in A, and least where A P A = Q: at the geometric mean of P^-1 and Q (Bhatia 2007, Positive definite
    matrices, section 4.1), which is positive definite. The law of least squares of S - A E is not: a fabric that
    stiffens has strains across that no linear law has, and the nearest law has no stiffness in one direction.
    Of a `mirrored` law, shear is fitted apart from both tensions, so that neither changes the other.

    Raises
    ------
    DataFileError
        If the strains of all states are proportional to each other: the law needs states of several load paths.
    """
    strain, derivative = green(states.stretch)
    stress = np.linalg.solve(np.swapaxes(derivative, 1, 2), states.force[..., None])[..., 0]
    strains, stresses = (part.T @ part for part in (strain, stress))
    if mirrored:
        apart = np.outer(MIRROR, MIRROR) > 0
        strains, stresses = strains * apart, stresses * apart
    if np.linalg.eigvalsh(strains)[0] <= np.finfo(float).eps * np.trace(strains):
        raise DataFileError("all states are strained in one ratio; add a cell on another path")
    # Q v = lambda P^-1 v, v . P^-1 v = 1
    square, modes = eigh(stresses, np.linalg.inv(strains))
    dual = np.linalg.solve(strains, modes)
    form: np.ndarray = (dual * np.sqrt(np.maximum(square, 0.0))) @ dual.T
    return form


def forces_on_paths(law: MembraneLaw, states: States) -> np.ndarray:
    """Return the forces per width (n, 3) [N/m] of a law at the strains that drive states, where others are free.

    They are nan where the law finds no equilibrium.
    """
    pairs = zip(states.stretch, states.driven, strict=True)
    return forces_per_width(law, np.array([_relaxed(law, stretch, driven) for stretch, driven in pairs]))


def _relaxed(law: MembraneLaw, stretch: Floats, driven: np.ndarray) -> Floats:
    """Return the stretch (3,) with the driven components kept and no force along the other components, or nan."""
    relaxed = stretch.copy()
    free = np.logical_not(driven)

    def forces(tried: Floats) -> Floats:
        relaxed[free] = tried
        found: Floats = forces_per_width(law, relaxed)[free]
        return found

    if free.any():
        found = root(forces, stretch[free], tol=1e-12)
        largest = np.abs(forces_per_width(law, relaxed)).max()
        relaxed[free] = found.x if np.abs(forces(found.x)).max() <= NOTHING * largest else np.nan
    return relaxed


@dataclass(frozen=True, eq=False)
class LinearFit:
    """A linear law for decks, and the states at which it holds."""

    form: np.ndarray  # (3, 3) [N/m]
    holds: States  # one state of every path
    secant: bool  # fitted to these alone, not to all states
    forces: np.ndarray  # (n, 3) at these, free where the cell is [N/m]

    @property
    def factor(self) -> float:
        """Largest ratio of forces of law and cell along the driven strains; inf without an equilibrium."""
        along = np.where(self.holds.driven, self.holds.stretch, 0.0)
        deck, cell = ((forces * along).sum(axis=1) for forces in (self.forces, self.holds.force))
        if not np.all(deck > 0):  # nan, where the law finds no equilibrium, is not either
            return np.inf
        return float(np.maximum(deck / cell, cell / deck).max())

    @property
    def eigenvalues(self) -> float:
        """The least eigenvalue over the largest."""
        least, _, largest = np.linalg.eigvalsh(self.form)
        return float(least / largest)

    @property
    def refused(self) -> str:
        """Why this law is none for a deck, or nothing."""
        if self.eigenvalues < LEAST_EIGENVALUE:
            least = (
                f"its least eigenvalue is {self.eigenvalues:.2g} of the largest, below {LEAST_EIGENVALUE:g}"
            )
            what = f"singular: {least}"
        elif self.factor > LARGEST_FACTOR:
            what = f"off the forces of the cell by a factor of {self.factor:.3g}, above {LARGEST_FACTOR:g}"
        else:
            return ""
        share = f"secants at {' to '.join(f'{100 * share:g}' for share in SECANTS[::3])} % of the largest strains too"
        return f"the linear law is {what}, and {share}; strain the cells less, or leave out a path that you do not need"


def fit_deck(states: States, mirrored: bool = True) -> LinearFit:
    """Return the linear law of all states or, where that is refused, the first secant that is not; else the last."""
    for share, secant in ((1.0, False), *((share, True) for share in SECANTS)):
        holds = states.part_way(share)
        form = fit_linear(holds if secant else states, mirrored)
        law = ExponentialLaw(form, np.empty(0), np.empty((0, 3)))
        fit = LinearFit(form, holds, secant, forces_on_paths(law, holds))
        if not fit.refused:
            break
    return fit


def membrane(histories: dict[str, xr.Dataset], error: float = ERROR) -> xr.Dataset:
    """Return the laws of a fabric from the histories of its cells: of exponentials, and a linear one for decks.

    `law_of` makes the first one again. Coefficients have intervals. The forces of both laws are beside those of the
    cells: of the first one at the ends of all paths, of the linear one where it holds. Attributes are errors of the
    first law and, of the linear one, whether it is a secant, its least eigenvalue over the largest, the largest factor
    by which it misses a path, and why decks have none (or nothing).
    """
    states = States.of(histories)
    if mirrored := states.mirrored:
        states = states.symmetric()
    fit = fit_exponentials(states, mirrored, error)
    deck = fit_deck(states, mirrored)
    ends = states.part_way(1.0)
    paths = fit.errors
    plane = ("axis", "of_axis")
    unit = {"units": "N/m"}
    one = {"units": "1"}
    interval = unit | {"long_name": "half width of the 95 % interval"}
    state = ("path", "axis")
    return xr.Dataset(
        {
            "form": (plane, fit.law.form, unit),
            "weight": ("term", fit.law.weight, unit),
            "slope": (("term", "axis"), fit.law.slope, one),
            "value": ("coefficient", fit.value, unit),
            "half_interval": ("coefficient", fit.half, interval),
            "path_error": (("path", "of_path"), np.array(list(paths.values())), one),
            "largest_strain": ("axis", states.largest, one),
            "end_strain": (state, np.where(ends.driven, ends.stretch, np.nan), one),
            "end_force": (state, ends.force, unit),
            "law_force": (state, forces_on_paths(fit.law, ends), unit),
            "linear_form": (plane, deck.form, unit),
            "deck_strain": (state, np.where(deck.holds.driven, deck.holds.stretch, np.nan), one),
            "deck_cell_force": (state, deck.holds.force, unit),
            "deck_force": (state, deck.forces, unit),
        },
        {
            "coefficient": list(fit.names),
            "path": list(paths),
            "of_path": ["root mean square", "largest"],
            "axis": list(STRAINS),
        },
    ).assign_attrs(
        error=fit.error,
        states=len(states.path),
        secant=int(deck.secant),
        eigenvalues=deck.eigenvalues,
        factor=deck.factor,
        refused=deck.refused,
    )


def forces_beside(fitted: xr.Dataset, law: str) -> list[tuple[str, str, float, float, float]]:
    """Return path, direction, strain, and forces per width of a law ("law", "deck") and of the cell [N/m].

    There is a row for every driven strain: at the ends of the paths for the law of exponentials, where it holds for
    that of decks.
    """
    cell = {"law": ("end_strain", "end_force"), "deck": ("deck_strain", "deck_cell_force")}[law]
    strain, force = (fitted[name].to_numpy() for name in cell)
    fitted_force = fitted[f"{law}_force"].to_numpy()
    paths = fitted["path"].to_numpy()
    return [
        (str(paths[i]), STRAINS[j], float(strain[i, j]), float(fitted_force[i, j]), float(force[i, j]))
        for i, j in zip(*np.nonzero(np.isfinite(strain)), strict=True)
    ]


def law_of(fitted: xr.Dataset) -> ExponentialLaw:
    """Return the law of exponentials of a dataset that `membrane` made."""
    return ExponentialLaw(*(fitted[name].to_numpy() for name in ("form", "weight", "slope")))


# Strips of fabric between clamps, and the same fabric free across.
#
# Clamps hold both components of all nodes along their edges; one of them is driven. A membrane carries compression
# across, where a fabric wrinkles: the least principal force of the strip says how much, and of a strip under tension it
# is small.

ELEMENTS = 16  # in either direction: twice as many change forces by 3e-4 (docs/notes/membrane.md)
INCREMENT = 0.02  # largest increment of strain, of 5 increments at least
NEVER = 10**9  # iterations: viscous flows find nothing in a membrane that halved increments do not


def stretch_strip(
    law: MembraneLaw,
    length: float,
    width: float,
    strain: float,
    axis: int = 0,
    clamped: bool = True,
    elements: int = ELEMENTS,
    largest_force: float = np.inf,
) -> xr.Dataset:
    """Return forces and widths of a strip of a length and width [m] that is pulled to a strain.

    It is pulled in course (`axis` 0) or wale direction (1). Strains are displacements over the length between the
    clamps, forces per width refer to the undeformed edge. Without clamps the strip is free across, as an endless fabric
    is: one element, whose ends stay straight. The pull stops at the largest force per width [N/m]. Raises
    ConvergenceError if Newton's method finds no equilibrium; its `history` is the strip so far.
    """
    if not clamped:
        elements = 1
    sides = (length, width)
    nodes, quads, number = rectangle(sides, (elements, elements), degree=2 if clamped else 1)
    nodes = nodes if axis == 0 else nodes[:, ::-1]
    model = MembraneModel(nodes, quads, law)
    along, across = (2 * number + component for component in (axis, 1 - axis))
    ends = [along[0], along[-1], *((across[0], across[-1]) if clamped else (across[0, :1],))]
    fixed = np.concatenate(ends)
    value = np.where(np.isin(fixed, along[-1]), strain * length, 0.0)
    settings = Settings(increments=max(5, ceil(abs(strain) / INCREMENT)), vain=NEVER)
    middle = across[number.shape[0] // 2]
    rows: list[tuple[float, ...]] = []

    def strip() -> xr.Dataset:
        curves = zip(VARIABLES.items(), np.transpose(rows), strict=True)
        sizes = {"length": length, "width": width, "axis": axis, "clamped": int(clamped)}
        parts = {name: ("increment", curve, about) for (name, about), curve in curves}
        return xr.Dataset(parts, attrs=sizes).set_coords("strain")

    try:
        for increment in trace(model, PrescribedDisplacement(fixed, value), settings, LU()):
            moved = increment.state.ravel()
            inner = model.principal_forces(increment.state)
            force = increment.response.force[along[-1]].sum() / width
            waist = 1 + (moved[middle[-1]] - moved[middle[0]]) / width
            rows.append((increment.load * strain, force, waist, inner[..., 0].min(), inner[..., 1].max()))
            if force >= largest_force:
                break
    except ConvergenceError as error:
        what = f"a strip of {length:.4g} x {width:.4g} m finds no equilibrium at a strain of {strain:g}"
        refused = ConvergenceError(f"{what}: {error}")
        refused.history = strip()
        raise refused from error
    return strip()


VARIABLES = {
    "strain": {"units": "1", "long_name": "displacement of the clamps over the length"},
    "force_per_width": {"units": "N/m", "long_name": "force over undeformed width"},
    "waist": {"units": "1", "long_name": "width half way between the clamps over width at rest"},
    "least_force": {"units": "N/m", "long_name": "least principal force per deformed width"},
    "largest_force": {"units": "N/m", "long_name": "largest principal force per deformed width"},
}


WRINKLES = 0.05  # compression over the largest tension from which a strip is said to wrinkle


def strain_at(strip: xr.Dataset, force: np.ndarray) -> np.ndarray:
    """Return the strains at forces per width (k,) [N/m] of a strip, nan beyond its last.

    Examples
    --------
    >>> strip = xr.Dataset({"force_per_width": [0.0, 10.0], "strain": [0.0, 0.2]})
    >>> strain_at(strip, np.array([5.0, 20.0])).tolist()
    [0.1, nan]
    """
    return np.interp(force, strip["force_per_width"], strip["strain"], right=np.nan)
