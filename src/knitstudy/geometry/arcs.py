"""Sinker arcs and head arcs: where a knit is gripped in wale tension."""

import numpy as np

from knitstudy.geometry.crossing import ZONES

LEFT_LOWER, RIGHT_LOWER, LEFT_UPPER, RIGHT_UPPER = range(ZONES)


def sinker_arcs(knit):
    """Arc lengths between which a yarn runs along the bottom of its loops: (n + 1, 2), m.

    From the last crossing of a loop with the row below to the first one of the next loop; at the yarn's ends, in the
    middles of sinkers, half of it. The bottom yarn, which crosses none below, has its arcs where the others have
    theirs: all yarns have one shape.

    Parameters
    ----------
    knit : Knit
    """
    first, last = (_along(knit, 1, zones) for zones in ((LEFT_LOWER, LEFT_UPPER), (RIGHT_LOWER, RIGHT_UPPER)))
    length = knit.centrelines[0].length
    return np.column_stack([np.append(0.0, last[:, 1]), np.append(first[:, 0], length)])


def head_arcs(knit):
    """Arc lengths between which a yarn runs along the top of its loops, from its left to its right crossing: (n, 2), m.

    Parameters
    ----------
    knit : Knit
    """
    left, right = (_along(knit, 0, zones) for zones in ((LEFT_LOWER, LEFT_UPPER), (RIGHT_LOWER, RIGHT_UPPER)))
    return np.column_stack([left[:, 1], right[:, 0]])


def gripped_arcs(specimen, direction):
    """Arcs (a, 2) [m] along which yarns are gripped, by yarn: in wale tension of a knit the first and the last one.

    In course tension a knit is gripped at the ends of its yarns, a pair is in ways of its own: there are none.

    Parameters
    ----------
    specimen : Knit or YarnPair
    direction : str or None
        Of the load; a pair has none.
    """
    if direction != "wale":
        return {}
    return {0: sinker_arcs(specimen), specimen.rows: head_arcs(specimen)}


def grip_ends(knit, direction):
    """Arc lengths (k,) [m] by yarn, ascending, at which a grip of `gripped_arcs` begins or ends inside it."""
    length = knit.centrelines[0].length
    arcs = {yarn: each.ravel() for yarn, each in gripped_arcs(knit, direction).items()}
    return {yarn: np.sort(each[(each > 0) & (each < length)]) for yarn, each in arcs.items()}


def inside(arc_length, arcs):
    """Whether arc lengths (k,) lie in arcs (a, 2), ends included: bool (k,).

    A joint at the end of an arc lies in it, whatever rounding says.
    """
    rounding = 1e-9 * arcs.max()
    at = np.asarray(arc_length)[:, None]
    return np.any((at >= arcs[:, 0] - rounding) & (at <= arcs[:, 1] + rounding), axis=1)


def _along(knit, side, zones):
    """Arc lengths (n, 2), ascending, of two crossings of every loop of a yarn; side 1: with the row below."""
    crossings = knit.crossings
    here = (crossings.row == 0) & np.isin(crossings.zone, zones)
    return np.sort(crossings.arc_length[here, side].reshape(knit.loops, 2), axis=1)
