"""Gates: conditions that a converged increment must satisfy to count.

Every message names the increment, the fault and its size, and the key that raises its limit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from knitstudy.errors import CoarseIncrement, ConvergenceError, MeshError
from knitstudy.knit.loading.history import FORMS, Motion, Recorder
from knitstudy.knit.scene.scene import Scene
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.model import Response

USUAL_HOURGLASS = 0.005  # hourglass stiffness over shear stiffness as in C3D8R

# Load factor before which hourglass and viscous forces may prevail: a hundredth of the energy of full load
FIRST = 0.1

ROUNDING = 1e-9  # of load factors; of energies, over the largest: 1e5 terms of a sum leave 1e-11 at most

# Energy over E d^3 up to which yarns of diameter d count as unloaded: a cell at 0.1 % stores 100,000 times as much
UNLOADED = 1e-12

# Shares of the allowed gap that one increment may add: of its own work, and of all work while little is done
OWN_SHARE, EARLY_SHARE = 0.5, 0.2

# Fewest elements across a yarn by specimen: a knit bends, a pair that is pressed together is only indented
ELEMENTS_ACROSS: Mapping[str, float] = {"knit": 3.0, "pair": 7.0}


def require_sound(
    scene: Scene,
    loaded: Callable[[Response], bool] | None,  # of solids: whether forces are more than rounding
    increment: Increment,
    recorder: Recorder,  # with the increment as its last one
    # energy of the yarns in a response [J]: of cells that begin at rest, with what they store there
    internal: Callable[[Response], float] = lambda response: response.energy["internal"],
) -> None:
    """Refuse an increment that has converged to something else than the scene asks for.

    Until solids are loaded only the ledger and the work of viscous flows are judged.
    Raises ConvergenceError as the functions below.
    """
    if loaded is not None and increment.load >= FIRST:
        resists = loaded(increment.response)
        if increment.response.energy.get("hourglass") and (resists or stores_work(recorder)):
            require_small_hourglass(scene, increment)
        if resists:
            require_small_viscosity(scene, increment, recorder.columns["reaction"][-1])
    require_hard_contact(scene, increment, recorder)
    if increment.damped and increment.load >= FIRST:
        require_share(
            scene,
            "flow",
            increment.damped,
            internal(increment.response),
            f"increment {increment.index}: viscous flows, which continued where Newton's method made no progress, have "
            "dissipated {} the internal energy",
            "Use more solver.increments",
        )
    unloaded = UNLOADED * scene.yarn.youngs_modulus * scene.yarn.diameter**3
    require_closed_ledger(recorder, increment.index, scene.gates.ledger, unloaded)


def require_share(scene: Scene, key: str, part: float, whole: float, message: str, remedy: str) -> None:
    """Refuse a part that is a larger share of a whole than a gate allows; the message has a place for the share."""
    allowed = getattr(scene.gates, key)
    if part > allowed * whole:
        raise ConvergenceError(
            f"{message.format(times(part, whole))}; gates.{key} allows {allowed:.1%}. {remedy}; gates.{key} raises the "
            "limit"
        )


def stores_work(recorder: Recorder) -> bool:
    """Return whether the forms of energy of the last increment are the external work, within half of it.

    However small the forces are, they are not rounding then.
    """
    work, *others = recorder.columns["energy"][-1]
    return 0.5 * work < sum(others) < 2 * work


def require_hard_contact(scene: Scene, increment: Increment, recorder: Recorder) -> None:
    """Refuse a state in which penetration and elastic slip take up the motion that yarns are to resist.

    With prescribed displacements the energy E falls as a compliance c is added, and its slope at c is the energy P
    stored in it, over c. As E is convex in c, all of c takes P / E from the force at least, and at most twice as much
    where c is below that of the yarns (`require_stiff_contact`). Ends of the path's legs count, as contact begins
    softly, and the work of the leg, as friction resists each.
    Raises ConvergenceError if the share exceeds ``gates.penalty``.
    """
    stored, columns = increment.response.energy.get("numerical", 0.0), recorder.columns
    corners = np.array([0.0, *recorder.motion.corners])
    leg = int(np.argmin(np.abs(corners - increment.load)))
    if not stored or not leg or abs(corners[leg] - increment.load) > ROUNDING:
        return
    start = corners[leg - 1]
    first = int(np.argmin(np.abs(np.array(columns["load"]) - start)))
    energy = np.array(columns["energy"])
    before = energy[first, FORMS.index("penalty")] if leg > 1 else 0.0
    work = float(np.abs(np.diff(energy[first:, 0])).sum())
    keys = (
        "beam.stiffness" if scene.fidelity == "beam" else "contact.normal_stiffness and tangential_stiffness"
    )
    require_share(
        scene,
        "penalty",
        stored - before,
        work,
        f"increment {increment.index}: penetration and elastic slip of contact have taken {{}} the work, and at least "
        "as much of the force",
        f"Use a larger {keys}",
    )


def require_fine_beams(scene: Scene, stiffer: float) -> None:
    """Refuse beams that are too long for the bends of the yarns: MeshError beyond the share ``gates.polygon``.

    `stiffer` is by how much they are estimated to be too stiff.
    """
    allowed = scene.value("gates.polygon")
    if allowed is not None and stiffer > allowed:
        size = scene.mesh.beam_size
        fits = size * (allowed / stiffer) ** 0.5
        raise MeshError(
            f"mesh.beam_size is {size:g} yarn radii: straight beams in bent yarns are {stiffer:.1%} too stiff; "
            f"gates.polygon allows {allowed:.1%}: use {fits:.2g} or less; gates.polygon raises the limit"
        )


def require_stiff_contact(scene: Scene, key: str, patch: float) -> None:
    """Refuse a penalty that is softer than the yarns: MeshError that names the least value of its key.

    Two half spaces give way along a round patch of radius a by (2 - nu) / (4 G a) (Mindlin 1949), a penalty k E / h by
    h / (k E pi a^2), and k E sqrt(R) delta^1.5 of beams, of which delta = a^2 / R, by 1 / (1.5 k E a): `patch` is
    pi a / h or 1.5.
    """
    poisson = scene.yarn.poisson_ratio
    least = 2 / ((2 - poisson) * (1 + poisson) * patch)
    if (value := scene.value(key)) is not None and value < least:
        raise MeshError(
            f"{key} is {value:g}: contact would be softer than yarns are there; use {least:.2g} or more"
        )


def require_seen_contact(scene: Scene, size: float) -> None:
    """Refuse points of contact between which yarns penetrate each other unseen.

    On facets of a size [m] the yarns meet over the middle of one; the next point lies d to either side of it, where the
    gap of crossed cylinders is d^2 / R wider. Raises MeshError if this exceeds ``contact.penetration``.
    """
    points, allowed = scene.contact.points, scene.contact.penetration * size
    off = np.abs(np.polynomial.legendre.leggauss(points)[0]).min() * size / 2
    if (unseen := off**2 / scene.yarn.radius) > allowed:
        raise MeshError(
            f"contact.points is {points}: yarns penetrate each other by {unseen / size:.2%} of a facet before a point "
            f"touches, and contact.penetration allows {allowed / size:.2%}: use an odd number, which has a point there"
        )


# Share of a wave of pressure as long as a cell that Gauss points may miss; 1 to 4 a side miss all, 24, 2.2 and 0.1 %
MISSED = 0.05


def require_integrated_contact(scene: Scene) -> None:
    """Refuse points of contact that are too few for the pressure of solid yarns; MeshError beyond `MISSED`."""
    points = scene.contact.points
    place, weight = np.polynomial.legendre.leggauss(points)
    missed = abs(weight @ np.cos(np.pi * place)) / 2
    if missed > MISSED:
        raise MeshError(
            f"contact.points is {points}: forces of contact would change by some per cent with where its cells lie "
            f"({missed:.0%} of a wave of pressure are missed); use 3 or more"
        )


def loosened(scene: Scene) -> str:
    """Return in words the gates that a scene opens wider than they are by default, "" if there are none.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> loosened(load_scene("yarns-tie-course").vary({"gates.ledger": 0.2}))
    'gates.ledger 0.2 instead of 0.05'
    """
    limits = []
    for name, field in type(scene.gates).model_fields.items():
        value, usual = getattr(scene.gates, name), field.default
        if name == "elements_across":  # the fewest
            usual = fewest_across(scene)
            value, wider = value or usual, (value or usual) < usual
        else:
            wider = value > usual
        if wider:
            limits.append(f"gates.{name} {value:g} instead of {usual:g}")
    return ", ".join(limits)


def require_small_hourglass(scene: Scene, increment: Increment) -> None:
    """Refuse a state in which hourglass modes carry load: they are resisted by a coefficient, not by the material.

    Their energy is proportional to the coefficient and vanishes with it, however far the modes have moved. Below the
    usual coefficient the energy is therefore taken at the usual one.
    Raises ConvergenceError if their share of the internal energy exceeds ``gates.hourglass``.
    """
    energy, coefficient = increment.response.energy, scene.solver.hourglass
    at = f", taken at the usual {USUAL_HOURGLASS}," if coefficient < USUAL_HOURGLASS else ""
    usual = "" if coefficient == USUAL_HOURGLASS else f"solver.hourglass {USUAL_HOURGLASS}, "
    require_share(
        scene,
        "hourglass",
        energy["hourglass"] * max(1.0, USUAL_HOURGLASS / coefficient),
        energy["internal"],
        f"increment {increment.index}: hourglass energy{at} is {{}} the internal energy with "
        f"solver.hourglass = {coefficient:g}",
        f"Use {usual}a smaller mesh.size, or mesh.element 'quadratic'",
    )


def require_small_viscosity(scene: Scene, increment: Increment, reaction: np.ndarray) -> None:
    """Refuse a state in which viscous forces carry load: those of stabilisation, or the drag of yarns that are loose.

    Raises ConvergenceError if their dissipation exceeds the share ``gates.stabilisation`` of the internal
    energy, or the sum of their magnitudes the share ``gates.viscous_force`` of the reaction (3,) of the driven side.
    """
    energy, pull = increment.response.energy, float(np.linalg.norm(reaction))
    what, remedy = "the drag on yarns that nothing but contact holds", "Tie or grip these yarns"
    if viscosity := scene.value("solver.stabilisation"):
        what = f"the viscous force of solver.stabilisation = {viscosity:g}"
        remedy = "Use a smaller solver.stabilisation, or none"
    shares = {
        "stabilisation": (
            # without flows, which have a gate of their own
            energy.get("stabilisation", 0.0) - increment.damped,
            energy["internal"],
            "has dissipated {} the internal energy",
        ),
        "viscous_force": (increment.response.viscous_force, pull, f"is {{}} the reaction, {pull:.3g} N"),
    }
    for key, (part, whole, values) in shares.items():
        require_share(scene, key, part, whole, f"increment {increment.index}: {what} {values}", remedy)


def require_closed_ledger(
    recorder: Recorder,  # with the increment as its last one
    index: int,  # of the increment
    limit: float,  # largest gap over the work, `gates.ledger`
    unloaded: float = 0.0,  # energy up to which yarns count as unloaded [J]: the ledger of rounding is open
) -> None:
    """Refuse an increment after which the ledger of energies is open: external work = the sum of all other forms.

    A gap is work that the computation has made or lost: a rule that is too coarse for how the force changes within an
    increment, or forces that no form accounts for. The addition of an increment is held against half of its own work,
    so that none uses up the allowance of others. Where hardly any work is done yet, and for the whole gap, the work
    counts that will have been done at full load (`expected_work`).

    Raises CoarseIncrement if this increment adds too much; ConvergenceError if the gap is too large though none did:
    the work that was expected has not been done.
    """
    energy = np.array(recorder.columns["energy"][-2:])
    if len(energy) < 2:
        return  # at rest no work is done
    missing, work = 2 * energy[:, 0] - energy.sum(axis=1), expected_work(recorder)
    gap, allowed = abs(missing[1]), max(limit * work, unloaded)
    added, done = abs(missing[1] - missing[0]), abs(energy[1, 0] - energy[0, 0])
    remedy = (
        "Sums over increments are too coarse for how the force changes: use more solver.increments, then a smaller "
        "solver.stabilisation; gates.ledger raises the limit"
    )
    ledger = f"increment {index}: the ledger of energies"
    if added > max(limit * max(OWN_SHARE * done, EARLY_SHARE * work), unloaded):
        raise CoarseIncrement(
            f"{ledger} opens further by {added:.3g} J, {times(added, done)} the work that is done in it; gates.ledger "
            f"allows {limit:.1%}, and one increment half of that. {remedy}",
            added,
            "J",
            bearable=gap <= allowed,
        )
    if gap > allowed:
        raise ConvergenceError(
            f"{ledger} is open by {gap:.3g} J, {times(gap, work)} the external work; gates.ledger allows {limit:.1%}. "
            f"{remedy}"
        )


def require_lasting_friction(recorder: Recorder, index: int) -> None:
    """Refuse an accepted increment, the last one of a recorder, in which friction gives dissipated energy back.

    Raises ConvergenceError if the energy of friction falls by more than `ROUNDING` of the largest energy so far.
    """
    energy = np.array(recorder.columns["energy"])
    fall = -float(np.diff(energy[-2:, FORMS.index("friction")]).sum())
    if fall > ROUNDING * (largest := np.abs(energy).max()):
        raise ConvergenceError(
            f"increment {index}: the energy of friction falls by {fall:.3g} J, {times(fall, largest)} the largest "
            "energy so far, but what friction has dissipated cannot come back: forces at contacts are wrong. Use more "
            "solver.increments, or another model (fidelity)"
        )


def require_apart(scene: Scene, recorder: Recorder, index: int) -> None:
    """Refuse an accepted increment, the last one of a recorder, in which yarns pass through each other.

    Raises ConvergenceError if two places of yarn overlap by more than ``gates.overlap`` radii.
    """
    allowed = scene.value("gates.overlap")
    if allowed is not None and (overlap := recorder.columns["largest_overlap"][-1]) > allowed:
        raise ConvergenceError(
            f"increment {index}: yarns pass {overlap:.2f} radii through each other; gates.overlap allows {allowed:g}. "
            "Use a smaller load, or an interaction and a model in which they touch; gates.overlap raises the limit"
        )


def expected_work(recorder: Recorder) -> float:
    """Return the largest external work so far, and the work that the force will do on the rest of the path [J].

    The force is taken to go on growing as in the last increment, and not to fall.
    """
    columns, motion = recorder.columns, recorder.motion
    done = max(abs(energy[0]) for energy in columns["energy"])
    left = _path_length(motion, columns["load"][-1], 1.0)
    if len(columns["load"]) < 2 or left == 0.0:
        return done
    force, before = (float(np.linalg.norm(columns["reaction"][i])) for i in (-1, -2))
    moved = _path_length(motion, columns["load"][-2], columns["load"][-1])
    slope = max(force - before, 0.0) / moved if moved > 0 else 0.0
    return done + left * (force + 0.5 * slope * left)


def _path_length(motion: Motion, start: float, end: float) -> float:
    """Return the length of the driven side's path between two load factors [m]."""
    loads = [start, *(corner for corner in motion.corners if start < corner < end), end]
    places = np.array([motion.at(load) for load in loads])
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


# Limits up to which the law of contact of beams is verified (tests/verification/test_line_contact.py):
# curvatures towards each other over 1/R, the sine of the angle, and the spread f^2 delta / R, where f is the factor of
# both on the force: the area of the patch over that of a section. The factor is bounded as well.
BENT, SINE, SPREAD = 0.45, 0.25, 0.3


def require_verified_law(
    scene: Scene,
    increment: Increment,
    stored: np.ndarray,  # (k,) energies of contact [J]
    internal: float,  # energy of the yarns [J]
    depth: np.ndarray,  # (k,) overlap over R
    shape: np.ndarray,  # (k, 3) curvatures towards each other over 1/R, and the cosine of the angle
    factor: np.ndarray,  # (k,) by which they multiply the force
    most: float,  # largest factor
    where: Callable[[int], str],  # says which pair of yarns one is
) -> None:
    """Refuse a state in which contact stores much where its law is not verified.

    As with a penalty, the force of the yarns is wrong by about the share of such energy, times the error of the law.
    Raises ConvergenceError if it exceeds the share ``gates.point`` of the internal energy.
    """
    sine = np.sqrt(np.maximum(1 - shape[:, 2] ** 2, 0.0))
    known = (shape[:, :2].max(axis=1) <= BENT) & (sine >= SINE) & (factor <= most)
    known &= factor**2 * depth <= SPREAD
    beyond = np.where(known, 0.0, stored)
    if increment.load < FIRST or not beyond.any():
        return
    k = int(np.argmax(beyond))
    require_share(
        scene,
        "point",
        beyond.sum(),
        internal,
        f"increment {increment.index}: contact beyond the verified range of its law (docs/reference/gates.md) stores "
        f"{{}} the internal energy, most between {where(k)}, at {np.degrees(np.arcsin(sine[k])):.0f} degrees and "
        f"{depth[k]:.2f} radii deep",
        "Use a smaller load.strain, or solid yarns",
    )


def fewest_across(scene: Scene) -> float:
    """Return how many hexahedra a yarn needs across by default.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> fewest_across(load_scene("dns-tie-course"))
    3.0
    """
    return max(ELEMENTS_ACROSS["knit"], ELEMENTS_ACROSS.get(scene.specimen, 0.0) / scene.mesh.refinement)


def require_elements_across(scene: Scene) -> None:
    """Refuse hexahedra that are too large for the yarn.

    The limit is ``gates.elements_across``, by default that of the specimen; a pair needs fewer elements of
    ``mesh.size`` where ``mesh.refinement`` makes them smaller at the crossing.
    Raises MeshError if there are fewer across the yarn.
    """
    fewest, across = scene.gates.elements_across or fewest_across(scene), 2 / scene.mesh.size
    if across < fewest * (1 - ROUNDING):
        raise MeshError(
            f"mesh.size is {scene.mesh.size:g} yarn radii, {across:.3g} elements across a yarn; gates.elements_across "
            f"asks for {fewest:g}: use {np.floor(2000 / fewest) / 1000:g} or less, or ask for fewer"
        )


def times(part: float, whole: float) -> str:
    """Return "12.3% of", or "1.2e+04 times" where it is many times as much.

    Examples
    --------
    >>> times(0.02, 1.0), times(30.0, 1.0)
    ('2.0% of', '30 times')
    """
    if part < 10 * whole:
        return f"{part / whole:.1%} of"
    return f"{part / whole:.2g} times" if whole > 0 else "more than"
