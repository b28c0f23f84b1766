"""Gates: conditions that a converged increment must satisfy to count.

Every message names the increment, the fault and its size, and the key that raises its limit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from knitstudy.errors import CoarseIncrement, ConvergenceError, MeshError
from knitstudy.knit.loading.history import FORMS, Recorder
from knitstudy.knit.scene.keys import Section
from knitstudy.knit.scene.sections import Yarn
from knitstudy.knit.scene.shared_sections import SolidGates
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.core.energy_balance import Balance, expected_work
from knitstudy.mechanics.core.increment import Increment
from knitstudy.mechanics.core.model import Response

USUAL_HOURGLASS = 0.005  # hourglass stiffness over shear stiffness as in C3D8R

# Load factor before which hourglass and viscous forces may prevail: a hundredth of the energy of full load
FIRST = 0.1

ROUNDING = 1e-9  # of load factors; of energies, over the largest: 1e5 terms of a sum leave 1e-11 at most

# Energy over E d^3 up to which yarns of diameter d count as unloaded: a cell at 0.1 % stores 100,000 times as much
UNLOADED = 1e-12

# Forms of energy in messages
NAMES = {
    "internal": "energy of the yarns",
    "hourglass": "hourglass energy",
    "penalty": "energy of contact",
    "friction": "energy of friction",
    "stabilisation": "energy of drag and viscous forces",
}
STORED = ("internal", "hourglass", "penalty")  # what yarns can give back

# Remedy where yarns overlap
LESS = "Use a smaller load, or an interaction and a model in which they touch"

# Fewest elements across a yarn by specimen: a knit bends, a pair that is pressed together is only indented
ELEMENTS_ACROSS = {"knit": 3.0, "pair": 7.0}


def require_sound(
    increment: Increment,
    recorder: Recorder,  # with the increment as its last one
    gates: Any,
    yarn: Yarn,
    harder: str = "Use beam.section: hertz",  # remedy where penalties of contact are too soft
    hourglass: float = 0.0,  # of solids: coefficients of hourglass stiffness and of viscosity
    stabilisation: float = 0.0,
    loaded: Callable[[Response], bool] | None = None,  # of solids: whether forces are more than rounding
    # energy of the yarns in a response [J]: of cells that begin at rest, with what they store there
    internal: Callable[[Response], float] = lambda response: response.energy["internal"],
) -> None:
    """Refuse a converged increment that exceeds the limits of the scene's gates.

    Until solids are loaded only the energy balance and the work of viscous flows are judged.
    Raises ConvergenceError as the functions below.
    """
    if loaded is not None and increment.load >= FIRST:
        resists = loaded(increment.response)
        if increment.response.energy.get("hourglass") and (resists or stores_work(recorder)):
            require_small_hourglass(increment, gates.hourglass, hourglass)
        if resists:
            require_small_viscosity(increment, gates, stabilisation, recorder.columns["reaction"][-1])
    require_hard_contact(increment, recorder, harder)
    if increment.damped and increment.load >= FIRST:
        shares = increment.damped, internal(increment.response)
        fact = "viscous flows, in place of Newton's method, have dissipated {} the internal energy"
        require_share(increment, "flow", gates.flow, *shares, fact, "Use more solver.increments")
    unloaded = UNLOADED * yarn.youngs_modulus * yarn.diameter**3
    # Drag begins again in every increment, so that its work and its energy differ by as much as they are
    drag = 0.0 if stabilisation else increment.dragged
    negligible = (max(unloaded, drag, each) for each in (increment.unbalanced_so_far, increment.unbalanced))
    require_energy_balance(recorder, increment.index, gates.ledger, *negligible)


def refusal(fact: str, gate: str, limit: str, remedy: str) -> str:
    """Return the message of a gate: the fault and its size, the limit, the remedy, and the key of the limit."""
    return f"{fact}; the limit gates.{gate} is {limit}. {remedy}; gates.{gate} raises the limit"


def require_share(
    increment: Increment, gate: str, limit: float, part: float, whole: float, fact: str, remedy: str
) -> None:
    """Refuse a part that is a larger share of a whole than the limit of a gate; the fact has a place for the share."""
    if part > limit * whole:
        fact = f"increment {increment.index}: {fact.format(times(part, whole))}"
        raise ConvergenceError(refusal(fact, gate, f"{limit:.1%}", remedy))


def stores_work(recorder: Recorder) -> bool:
    """Return whether the forms of energy of the last increment are the external work, within half of it.

    However small the forces are, they are not rounding then.
    """
    work, *others = recorder.columns["energy"][-1]
    return bool(0.5 * work < sum(others) < 2 * work)


MOST_IN_PENALTIES = 0.05  # of the work of a leg of the path, energy of penetration and elastic slip


def require_hard_contact(increment: Increment, recorder: Recorder, remedy: str) -> None:
    """Refuse a state in which penetration and elastic slip take up the motion that yarns are to resist.

    With prescribed displacements the energy E falls as a compliance c is added, and its slope at c is the energy P
    stored in it, over c. As E is convex in c, all of c takes P / E from the force at least, and at most twice as much
    where c is below that of the yarns (`least_stiffness`). Ends of the path's legs count, as contact begins
    softly, and the work of the leg, as friction resists each.
    Raises ConvergenceError beyond the share `MOST_IN_PENALTIES`, and names the remedy.
    """
    stored = increment.response.energy.get("numerical", 0.0)
    columns = recorder.columns
    corners = np.array([0.0, *recorder.motion.corners])
    leg = int(np.argmin(np.abs(corners - increment.load)))
    if not stored or not leg or abs(corners[leg] - increment.load) > ROUNDING:
        return
    start = corners[leg - 1]
    first = int(np.argmin(np.abs(np.array(columns["load"]) - start)))
    energy = np.array(columns["energy"])
    before = energy[first, FORMS.index("penalty")] if leg > 1 else 0.0
    work = float(np.abs(np.diff(energy[first:, 0])).sum())
    taken = stored - before
    if taken > MOST_IN_PENALTIES * work:
        raise ConvergenceError(
            f"increment {increment.index}: penetration and elastic slip of contact have taken {times(taken, work)} "
            f"the work, and at least as much of the force; {MOST_IN_PENALTIES:.0%} is allowed. {remedy}"
        )


def require_fine_beams(limit: float | None, size: float, stiffer: float) -> None:
    """Refuse beams that are too long for the bends of the yarns: MeshError beyond the share ``gates.polygon``.

    Beams of a size [yarn radii] are estimated to be stiffer by a share; networks without the gate have no limit.
    """
    if limit is not None and stiffer > limit:
        fact = (
            f"mesh.beam_size is {size:g} yarn radii: straight beams in bent yarns are {stiffer:.1%} too stiff"
        )
        fits = size * (limit / stiffer) ** 0.5
        raise MeshError(refusal(fact, "polygon", f"{limit:.1%}", f"Use {fits:.2g} or less"))


def least_stiffness(poisson: float, patch: float) -> float:
    """Return the least penalty, over Young's modulus and a size, that is as stiff as the yarns of a Poisson's ratio.

    Two half spaces give way along a round patch of radius a by (2 - nu) / (4 G a) (Mindlin 1949), a penalty k E / h by
    h / (k E pi a^2), and k E sqrt(R) delta^1.5 of beams, of which delta = a^2 / R, by 1 / (1.5 k E a): `patch` is
    pi a / h or 1.5.
    """
    return 2 / ((2 - poisson) * (1 + poisson) * patch)


def relaxed_limits(gates: Section, fewest: float | None = None) -> str:
    """Return the limits that a scene sets wider than their defaults, as text; "" if there are none.

    `fewest` is the default of ``gates.elements_across``.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> relaxed_limits(load_scene("yarns-tie-course").vary({"gates.ledger": 0.2}).gates)
    'gates.ledger 0.2 instead of 0.05'
    """
    limits = {name: (getattr(gates, name), field.default) for name, field in type(gates).model_fields.items()}
    asked, _ = limits.pop("elements_across", (None, None))
    wider = {name: limit for name, limit in limits.items() if limit[0] > limit[1]}
    if asked and fewest and asked < fewest:
        wider["elements_across"] = asked, fewest
    return ", ".join(f"gates.{name} {value:g} instead of {usual:g}" for name, (value, usual) in wider.items())


def require_small_hourglass(increment: Increment, limit: float, coefficient: float) -> None:
    """Refuse a state in which hourglass modes carry load: they are resisted by a coefficient, not by the material.

    Their energy is proportional to the coefficient and vanishes with it, however far the modes have moved. Below the
    usual coefficient the energy is therefore taken at the usual one.
    Raises ConvergenceError if their share of the internal energy exceeds the limit.
    """
    energy = increment.response.energy
    at = f", taken at the usual {USUAL_HOURGLASS}," if coefficient < USUAL_HOURGLASS else ""
    usual = "" if coefficient == USUAL_HOURGLASS else f"solver.hourglass {USUAL_HOURGLASS}, "
    part = energy["hourglass"] * max(1.0, USUAL_HOURGLASS / coefficient)
    fact = f"hourglass energy{at} is {{}} the internal energy with solver.hourglass = {coefficient:g}"
    remedy = f"Use {usual}a smaller mesh.size, or mesh.element 'quadratic'"
    require_share(increment, "hourglass", limit, part, energy["internal"], fact, remedy)


def require_small_viscosity(
    increment: Increment, gates: SolidGates, stabilisation: float, reaction: Floats
) -> None:
    """Refuse a state in which viscous forces carry load: those of stabilisation, or the drag of yarns that are loose.

    Raises ConvergenceError if their dissipation exceeds the share ``gates.stabilisation`` of the internal
    energy, or the sum of their magnitudes the share ``gates.viscous_force`` of the reaction (3,) of the driven side.
    """
    internal = increment.response.energy["internal"]
    pull = float(np.linalg.norm(reaction))
    what = "the drag on yarns that nothing but contact holds"
    remedy = "Tie or grip these yarns"
    if stabilisation:
        what = f"the viscous force of solver.stabilisation = {stabilisation:g}"
        remedy = "Use a smaller solver.stabilisation, or none"
    # without flows, which have a gate of their own
    lost = increment.dragged
    fact = what + " has dissipated {} the internal energy"
    require_share(increment, "stabilisation", gates.stabilisation, lost, internal, fact, remedy)
    force = increment.response.viscous_force
    fact = f"{what} is {{}} the reaction, {pull:.3g} N"
    require_share(increment, "viscous_force", gates.viscous_force, force, pull, fact, remedy)


def require_energy_balance(
    recorder: Recorder,  # with the increment as its last one
    index: int,  # of the increment
    limit: float,  # largest error over the work, `gates.ledger`
    # Up to these gaps do not count, the whole one and that of an increment: of rounding, of drag, and of forces that
    # the tolerance of the residual leaves unbalanced (`Increment.unbalanced`) [J]
    least: float = 0.0,
    least_added: float = 0.0,
) -> None:
    """Refuse an increment after which energies do not balance: external work = the sum of all other forms of energy.

    The error of the balance is work that the computation has made or lost: increments are too coarse for how the force
    changes within them, or no form of energy accounts for some force. What one increment adds to the error is compared
    with half of the work of this increment, so that no increment uses up the allowance of others. Where hardly any work
    is done yet, and for the whole error, the reference is the work expected up to full load (`path_work`).

    Raises CoarseIncrement if this increment adds too much; ConvergenceError if the error is too large although no
    increment added too much: the expected work has not been done.
    """
    energy = np.array(recorder.columns["energy"])
    if len(energy) < 2:
        return  # at rest no work is done
    whole = energy[-1]
    last = energy[-1] - energy[-2]
    balance = Balance(
        limit, path_work(recorder), last[0], unaccounted(whole), unaccounted(last), least, least_added
    )
    share = f"{limit:.1%}"
    if balance.adds_too_much:
        added = abs(balance.added)
        done = abs(balance.done)
        fact = f"increment {index}: its energy balance misses {added:.3g} J, {times(added, done)} its work"
        message = refusal(
            f"{fact}{changes(last)}", "ledger", f"{share}, half of it in one increment", cause(last)
        )
        raise CoarseIncrement(message, added, "J", bearable=not balance.is_exceeded)
    if balance.is_exceeded:
        gap = abs(balance.gap)
        fact = (
            f"increment {index}: the energy balance misses {gap:.3g} J, {times(gap, balance.work)} the external work"
            f"{changes(whole)}"
        )
        raise ConvergenceError(refusal(fact, "ledger", share, cause(whole)))


def unaccounted(energy: Floats) -> float:
    """Return the external work that no other of the `FORMS` of energy (6,) has [J]."""
    return float(2 * energy[0] - energy.sum())


def changes(energy: Floats) -> str:
    """Return as text the work, and the forms of energy that change most, from changes (6,) by `FORMS` [J].

    Examples
    --------
    >>> changes(np.array([2e-9, -3e-8, 0.0, 1e-9, 5e-9, 0.0]))
    ' (work 2e-09 J, energy of the yarns -3e-08 J, energy of friction 5e-09 J)'
    """
    others = {NAMES[form]: value for form, value in zip(FORMS[1:], energy[1:], strict=True) if value}
    most = sorted(others, key=lambda name: -abs(others[name]))[:2]
    parts = [f"work {energy[0]:.3g} J", *(f"{name} {others[name]:.3g} J" for name in most)]
    return f" ({', '.join(parts)})"


def cause(energy: Floats) -> str:
    """Return why energies probably do not balance, and what to do, by the changes (6,) of the `FORMS` of energy [J].

    Yarns that snap give back what they have stored, and neither friction nor drag takes it up.
    """
    stored = sum(energy[FORMS.index(form)] for form in STORED)
    if stored < 0 and -2 * stored >= unaccounted(energy) > 0:
        return (
            "Yarns snap into another place and set energy free, which no smaller increment prevents: use more "
            "contact.friction, start from a shape at rest (load.start), or end load.strain before"
        )
    return (
        "Sums over increments are too coarse for how the force changes: use more solver.increments, then a smaller "
        "solver.stabilisation"
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


def require_apart(overlap: float, index: int, limit: float, remedy: str = LESS) -> None:
    """Refuse an increment after which two places of yarn overlap by more than a limit, both over the radius.

    Raises CoarseIncrement: a shorter increment may keep yarns apart that a long one takes through each other.
    """
    if overlap > limit:
        fact = f"increment {index}: yarns overlap by {overlap:.2f} radii"
        raise CoarseIncrement(refusal(fact, "overlap", f"{limit:g}", remedy), overlap, "radii")


def path_work(recorder: Recorder) -> float:
    """Return the largest external work so far, and the work that the force will do on the rest of the path [J]."""
    columns = recorder.columns
    way = recorder.motion.way
    done = max(abs(energy[0]) for energy in columns["energy"])
    left = way(columns["load"][-1], 1.0)
    if len(columns["load"]) < 2 or left == 0.0:
        return float(done)
    force, before = (float(np.linalg.norm(columns["reaction"][i])) for i in (-1, -2))
    moved = way(columns["load"][-2], columns["load"][-1])
    return float(expected_work(done, before, force, moved, left))


# Limits up to which the law of contact of beams is verified (tests/verification/test_line_contact.py):
# curvatures towards each other over 1/R, the sine of the angle, and the spread f^2 delta / R, where f is the factor of
# both on the force: the area of the patch over that of a section. The factor is bounded as well.
BENT, SINE, SPREAD = 0.45, 0.25, 0.3


def require_verified_law(
    increment: Increment,
    limit: float,
    stored: Floats,  # (k,) energies of contact [J]
    internal: float,  # energy of the yarns [J]
    depth: Floats,  # (k,) overlap over R
    shape: Floats,  # (k, 3) curvatures towards each other over 1/R, and the cosine of the angle
    factor: Floats,  # (k,) by which they multiply the force
    most: float,  # largest factor
    where: Callable[[int], str],  # says which pair of yarns one is
) -> None:
    """Refuse a state in which contact stores much where its law is not verified.

    As with a penalty, the force of the yarns is wrong by about the share of such energy, times the error of the law.
    Raises ConvergenceError if it exceeds the share `limit` of the internal energy.
    """
    sine = np.sqrt(np.maximum(1 - shape[:, 2] ** 2, 0.0))
    known = (shape[:, :2].max(axis=1) <= BENT) & (sine >= SINE) & (factor <= most)
    known &= factor**2 * depth <= SPREAD
    beyond = np.where(known, 0.0, stored)
    if increment.load < FIRST or not beyond.any():
        return
    k = int(np.argmax(beyond))
    fact = (
        "contact beyond the verified range of its law (docs/reference/gates.md) stores {} the internal energy, "
        f"most between {where(k)}, at {np.degrees(np.arcsin(sine[k])):.0f} degrees and {depth[k]:.2f} radii deep"
    )
    remedy = "Use a smaller load.strain, or solid yarns"
    require_share(increment, "point", limit, beyond.sum(), internal, fact, remedy)


def fewest_across(specimen: str, refinement: float) -> float:
    """Return how many hexahedra a yarn of a specimen needs across by default.

    A pair needs fewer elements of ``mesh.size`` where ``mesh.refinement`` makes them smaller at the crossing.

    Examples
    --------
    >>> fewest_across("knit", refinement=1.0), fewest_across("pair", refinement=2.0)
    (3.0, 3.5)
    """
    return max(ELEMENTS_ACROSS["knit"], ELEMENTS_ACROSS.get(specimen, 0.0) / refinement)


def require_elements_across(size: float, fewest: float) -> None:
    """Refuse hexahedra of a size [yarn radii] that are too large for the yarn: MeshError if fewer lie across it."""
    if 2 / size < fewest * (1 - ROUNDING):
        raise MeshError(
            f"mesh.size is {size:g} yarn radii, {2 / size:.3g} elements across a yarn; gates.elements_across "
            f"requires {fewest:g}: use {np.floor(2000 / fewest) / 1000:g} or less, or lower it"
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
