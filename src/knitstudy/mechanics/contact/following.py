"""Pairs that may touch, from one configuration to the next: searched for as seldom as motion allows.

What is kept here only saves time: no answer depends on what was asked before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from knitstudy.mechanics.contact.friction import OPEN
from knitstudy.mechanics.contact.history import ContactHistory, joined, same_pair, taken
from knitstudy.mechanics.contact.motion import Neighbourhoods
from knitstudy.mechanics.contact.quadrature import CHUNK
from knitstudy.mechanics.contact.search import Candidates, Search


@dataclass(frozen=True, eq=False)
class Followed:
    """Pairs of one search: what was asked about, what is known of them, and until when they are all.

    Attributes
    ----------
    source : ContactHistory
        The history asked about.
    before : ndarray, shape (M, 3)
        Where carriers were then [m].
    history : ContactHistory
        Of all pairs; what was open is filled in when it is asked for.
    angle : ndarray, shape (c,)
        Between their lines then; nan until it is asked for.
    searched : ndarray, shape (M, 3)
        Where carriers were at the search [m].
    least : ndarray, shape (c,)
        What the gaps were at least where carriers were seen last [m].
    seen : ndarray, shape (M, 3)
        Where that was [m].
    neighbourhoods : Neighbourhoods
    box : ndarray of int, shape (c,)
        Which of them pairs lie in.
    """

    source: ContactHistory
    before: np.ndarray
    history: ContactHistory
    angle: np.ndarray
    searched: np.ndarray
    least: np.ndarray
    seen: np.ndarray
    neighbourhoods: Neighbourhoods
    box: np.ndarray


class Following:
    """Follows the pairs that may touch.

    Parameters
    ----------
    search : Search
    margin : float
        Distance up to which pairs are followed [m]; the search is repeated when others could touch.
    angles : bool
        Whether the angles between the lines of both surfaces are asked for.
    """

    def __init__(self, search: Search, margin: float, angles: bool) -> None:
        self._search, self._margin, self._with_angles = search, margin, angles
        self._kept: Followed | None = None

    def may_touch(
        self, carriers: np.ndarray, before: np.ndarray, history: ContactHistory
    ) -> tuple[Followed, np.ndarray, np.ndarray]:
        """Return all pairs that are followed, which (k,) of them can touch, and their least gaps (c,) [m].

        Those cannot whose surfaces have moved too little since their gap was last known to close it. Of the others it
        is known where they were, and at what angles.

        Parameters
        ----------
        carriers, before : ndarray, shape (M, 3)
            Of the surfaces, now and at the last converged increment [m].
        history : ContactHistory
            Of that increment.
        """
        followed = self._kept = self._all(carriers, before, history)
        every = followed.history
        least = followed.neighbourhoods.motion(carriers, followed.seen).least(followed.least, followed.box)
        number = np.flatnonzero(~((least > 0) & (every.pressure <= 0) & (every.multiplier == 0)))
        self._look_back(followed, number)
        return followed, number, least

    def saw(self, carriers: np.ndarray, least: np.ndarray) -> None:
        """Take over what the gaps (c,) of all pairs are at least [m] where carriers (M, 3) are."""
        self._kept = replace(self._kept, least=least, seen=carriers)

    def go_on(
        self, history: ContactHistory, successor: ContactHistory, before: np.ndarray | None = None
    ) -> None:
        """Go on with the pairs of one search under the history that follows.

        Parameters
        ----------
        history, successor : ContactHistory
        before : ndarray, shape (M, 3), optional
            Where carriers were at the increment that this has ended [m]; left out within one.
        """
        if self._kept is None or self._kept.history is not history:
            return
        anew = {} if before is None else {"before": before, "angle": np.full(len(successor.xi), np.nan)}
        self._kept = replace(self._kept, source=successor, history=successor, **anew)

    def _all(self, carriers: np.ndarray, before: np.ndarray, history: ContactHistory) -> Followed:
        """Return the history over all pairs that may touch now."""
        kept = self._kept
        again = kept is not None and kept.source is history and np.array_equal(kept.before, before)
        if again and kept.neighbourhoods.keeps_apart(carriers, kept.searched, self._margin):
            return kept
        # What was found for trial states, however wild, is forgotten.
        found = self._search.find(carriers, self._margin)
        arc = self._search.arc(history.surface, history.xi[:, 0])
        same = same_pair(found.point, found.surface, found.arc, history, arc)
        least = np.full(len(history.point), -np.inf)
        least[same[same >= 0]] = found.least[same >= 0]
        stays = history.pressure > 0
        stays[same[same >= 0]] = True
        stays, new = np.flatnonzero(stays), np.flatnonzero(same < 0)
        every = joined(taken(history, stays), _open(found, new, history.dissipated))
        least = np.append(least[stays], found.least[new])
        # In one order, so that sums are the same whenever was searched, after a restart too.
        order = np.lexsort((every.xi[:, 0], every.surface, every.point))
        every = taken(every, order)
        neighbourhoods = Neighbourhoods(self._search.surfaces, carriers, self._search.reach)
        quadrature = self._search.quadrature
        return Followed(
            source=history,
            before=before,
            history=every,
            angle=np.full(len(order), np.nan),
            searched=carriers,
            least=least[order],
            seen=carriers,
            neighbourhoods=neighbourhoods,
            box=neighbourhoods.of_ring[self._search.ring(every.point // quadrature.per_cell)],
        )

    def _look_back(self, followed: Followed, number: np.ndarray) -> None:
        """Fill in what pairs (k,) that nothing was asked of before remember: where they were, and their angles."""
        history, before = followed.history, followed.before
        new = number[np.isneginf(history.gap[number])]
        position = self._search.positions(history.point[new], before)
        projection, history.gap[new] = self._search.closest(taken(history, new), position, before)
        history.xi[new] = projection.xi
        if self._with_angles:
            new = number[np.isnan(followed.angle[number])]
            followed.angle[new] = self._angles(taken(history, new), before)

    def _angles(self, history: ContactHistory, before: np.ndarray) -> np.ndarray:
        """Return the angles (c,) between the first parameters' lines at pairs."""
        surfaces, quadrature = self._search.surfaces, self._search.quadrature
        cosine = np.empty(len(history.point))
        for low in range(0, len(cosine), CHUNK):
            part = slice(low, low + CHUNK)
            point = history.point[part]
            both = (
                (quadrature.surface[point], quadrature.xi[point]),
                (history.surface[part], history.xi[part]),
            )
            lines = [surfaces.places(*place, before)[1][:, 0] for place in both]
            sizes = np.prod([np.linalg.norm(line, axis=1) for line in lines], axis=0)
            cosine[part] = np.abs(np.einsum("ki,ki->k", *lines)) / sizes
        return np.arccos(np.minimum(cosine, 1.0))


def _open(found: Candidates, number: np.ndarray, dissipated: np.ndarray) -> ContactHistory:
    """Return the history of pairs found (k,) that nothing was known of."""
    none, guess = np.zeros(len(number)), found.guess[number]
    return ContactHistory(
        point=found.point[number],
        surface=found.surface[number],
        xi=guess,
        gap=none - np.inf,
        pressure=none,
        traction=np.zeros((len(number), 3)),
        multiplier=none,
        anchor=guess,
        slip=none,
        status=np.full(len(number), OPEN),
        dissipated=dissipated,
    )
