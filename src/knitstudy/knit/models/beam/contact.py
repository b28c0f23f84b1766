"""Contact of yarns that are beams, as a scene describes it: points of contact, law, ties, and the limits of the law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from knitstudy.errors import MeshError
from knitstudy.knit.geometry.crossings import Crossings
from knitstudy.knit.loading.gates import least_stiffness, require_verified_law
from knitstudy.knit.models.beam import Beams, CellOfBeams
from knitstudy.knit.scene.sections import BeamYarn
from knitstudy.mechanics.beams.beam import BeamState
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.laws import LAWS, Mixed, Power, Repulsion
from knitstudy.mechanics.beams.line_contact import ROUGH, SPACINGS, LineContact
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.increment import Increment

# Largest displacement that one correction may make, in finite knits against neighbours, over the diameter
STRIDE = 0.1

# Points of contact are no farther apart, over the radius. Contact is soft below an approach that is as much as the
# square of that: a hundredth of the radius of solid yarns, a twentieth of soft ones, which overlap ten times as far.
# Yarns without friction that slide over points 0.1, 0.14, 0.25 and 0.6 R apart feel up to 0.6, 1.3, 5 and 15 % of the
# force between them along the way (1e-4 to 1e-2 E R^2; tests/verification/test_sliding_yarns.py). `FEW` a station are
# enough where they are nearly as fine.
FINE, FINE_IN_LAYERS, FEW, NEARLY = 0.1, 0.23, 4, 1.5

MOST_SHAPED = 5.0  # factor of surfaces that conform beyond which bounds of `laws` count


def points_per_station(length: float, fine: float) -> int:
    """Return how many points of contact the longest stations [m] need, `fine` [m] apart.

    Examples
    --------
    >>> points_per_station(0.25, 0.1), points_per_station(0.56, 0.1), points_per_station(2.5, 0.1)
    (3, 4, 25)
    """
    count = int(np.ceil(length / fine - 0.01).clip(1))
    return min(count, FEW) if length <= FEW * NEARLY * fine else count


@dataclass(frozen=True)
class YarnContact:
    """Contact of the yarns of a scene as beams."""

    yarns: tuple[BeamYarn, ...]  # the thickest one first
    laws: tuple[Power, ...]  # of crossings of each with itself
    friction: float  # inf: no slip
    yarn_of: Callable[[Ints], Ints] | None = None  # which of several yarns rows (k,) are of

    @property
    def yarn(self) -> BeamYarn:
        """The first yarn."""
        return self.yarns[0]

    @property
    def law(self) -> Power:
        """The law of the first yarn."""
        return self.laws[0]

    def along(
        self,
        yarn: Ints,  # (n,), of the stations; stations of a yarn follow each other
        arc_length: Floats,  # (n,) [m]
        period: Floats | None = None,  # (Y,), lengths of yarns that repeat themselves [m]
        tied: Crossings | None = None,
        reach: float = 0.0,  # of a tie along the yarn [m]
    ) -> tuple[LineContact, ContactPoints]:
        """Return the contact of yarns with stations, and its points."""
        diameter = self.yarn.diameter
        fine = (FINE if self.law.patch.spreads else FINE_IN_LAYERS) * min(yarn.radius for yarn in self.yarns)
        widest = ContactPoints.of(yarn, arc_length, 1, period).weight.max()
        points = ContactPoints.of(yarn, arc_length, points_per_station(float(widest), fine), period)
        spacing = float(points.weight.max())
        onset = SPACINGS**2 * spacing**2 / (8 * diameter)  # contact of 2 sqrt(2 D e) over `SPACINGS` of them
        repulsion = Repulsion(self.law, diameter, onset)
        if self.yarn_of is not None:
            diameters = [yarn.diameter for yarn in self.yarns]
            repulsion = Mixed.of_yarns(self.laws, diameters, onset, self.yarn_of(points.yarn))
        return LineContact(
            points.yarn,
            points.arc_length,
            points.weight,
            repulsion,
            self.friction,
            period=period,
            joined=None if tied is None else joined(points, tied, reach),
        ), points

    @property
    def pressed(self) -> float:
        """Share of normal forces in the bending of yarns by forces on their surface; see `eased_by_pressure`.

        Friction at Coulomb's limit, in all directions alike, has the part mu^2 / (2 + mu^2) of the squares of forces
        normal to and across the yarn. It moves the surface by c - nu R^2 where normal forces move it by c. Yarns that
        stick pull in all directions, as ties do: they have the shear of the energy.
        """
        if not self.law.patch.spreads:
            return 0.0
        nu = self.yarn.poisson_ratio
        square = min(self.friction, ROUGH) ** 2
        return max(0.0, 1 - square / (2 + square) * 12 * (1 + nu) / (7 + 8 * nu))  # nu R^2 over c

    def attributes(self, onset: float) -> dict[str, float]:
        """Return the attributes of a history for contact that begins softly up to an approach [m]."""
        coefficient, exponent = self.law.coefficient, self.law.exponent
        known = {"contact_coefficient": coefficient, "contact_exponent": exponent, "contact_onset": onset}
        return known | {"friction": self.friction}


def contact_of(scene: Beams | CellOfBeams) -> YarnContact:
    """Return the contact of the yarns of a scene: by ``yarn.pressing`` where it is set, else by ``beam.section``.

    Raises MeshError if a penalty is softer than the yarns.
    """
    beam = scene.beam
    yarn_of = None
    yarns = tuple[BeamYarn, ...]((scene.yarn,))
    if isinstance(scene, CellOfBeams) and len(scene.yarns) > 1:
        yarns, yarn_of = scene.yarns, scene.yarn_of

    def law_of(yarn: BeamYarn) -> Power:
        exponent = yarn.pressing_exponent
        if yarn.pressing is None:
            return LAWS.find(beam.section).of(yarn, beam)
        return Power(yarn.pressing / yarn.diameter**exponent, exponent)

    laws = tuple(law_of(yarn) for yarn in yarns)
    if laws[0].penalty:
        stiffness = laws[0].coefficient / (scene.yarn.youngs_modulus * scene.yarn.radius**0.5)
        if stiffness < least_stiffness(scene.yarn.poisson_ratio, patch=1.5):
            of = f"where yarn.poisson_ratio is {scene.yarn.poisson_ratio:g}"
            raise MeshError(
                f"beam.section is {beam.section}: {of}, contact would be softer than yarns; use hertz"
            )
    return YarnContact(yarns, laws, scene.friction, yarn_of)


def joined(points: ContactPoints, tied: Crossings, reach: float) -> Ints:
    """Return the number (p,) of the tied crossing within reach [m] along the yarn of a point, or -1.

    A disc of radius a carries overlaps of up to a^2 / R, as Hertz's patch of that size does: straight yarns that
    do have points nearer than the diameter up to 2 a from the crossing.
    """
    nearest, far = nearest_crossing(points.yarn, points.arc_length, tied)
    return np.where(far < reach, nearest, -1)


def nearest_crossing(yarn: Ints, arc_length: Floats, crossings: Crossings) -> tuple[Ints, Floats]:
    """Return the crossing (n,) that is nearest along its yarn to places (n,), -1 without one; and how far it is [m]."""
    apart = 4 * arc_length.max()
    at, order = np.unique((apart * crossings.yarn + crossings.arc_length).ravel(), return_index=True)
    at = np.concatenate([[-np.inf], at, [np.inf]])
    place = apart * yarn + arc_length
    after = np.searchsorted(at, place)
    nearest = np.where(at[after] - place < place - at[after - 1], after, after - 1)
    return np.concatenate([[-1], order // 2, [-1]])[nearest], np.abs(at[nearest] - place)


def require_verified_contact(
    limit: float,  # share of the internal energy, `gates.point`
    increment: Increment,
    contact: LineContact,
    points: BeamState,
    vectors: Floats,  # (2, 3), of the lattice [m]
    internal: float,  # energy of the yarns [J]
) -> None:
    """Refuse a state beyond the verified law of contact; raises as `require_verified_law`."""
    pairs = contact.pairs(points.position, vectors)
    _, geometry = contact.pair_geometry(pairs, points.position, vectors)
    energy = contact.energy(pairs, points.position, vectors)[1].value
    factor = contact.energy_factors(pairs, geometry)[2].value
    depth = 2 * (1 - pairs.distance / contact.repulsion.between(pairs).diameter)
    shape = np.stack([each.value for each in geometry[:3]], axis=1)

    def where(k: int) -> str:
        one, other = contact.yarn[pairs.both[k]]
        s, t = contact.arc_length[pairs.both[k]]
        return f"yarns {one} and {other} at arc lengths {s:.4g} and {t:.4g} m"

    require_verified_law(increment, limit, energy, internal, depth, shape, factor, MOST_SHAPED, where)
