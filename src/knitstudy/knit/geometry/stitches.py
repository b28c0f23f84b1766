"""Stitches: rows of letters, the paths of yarns that they describe, and which rows are the same knit.

A repeat is written as rows of letters, the bottom row first: ["KP"] is a 1 x 1 rib, ["K", "P"] a garter. A knit stitch
(K) is drawn through the loop below it from the back to the front, a purl stitch (P) from the front to the back: a purl
stitch is a knit stitch seen from behind, z -> -z. Side 1 stands for K, -1 for P.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.knit.scene.stitches import is_plain, wrong_stitches
from knitstudy.mechanics.core.arrays import Floats, Ints

KNIT, PURL = "K", "P"
PLAIN = (KNIT,)


def sides(stitches: Sequence[str]) -> Ints:
    """Return 1 for every knit and -1 for every purl stitch: (r, k). Raises GeometryError for other letters.

    Examples
    --------
    >>> sides(("KP", "PK")).tolist()
    [[1, -1], [-1, 1]]
    """
    wrong = wrong_stitches(tuple(stitches))
    if not is_plain(stitches):
        wrong = wrong or "loops of K and P alone are alike"
    if wrong:
        raise GeometryError(f"pattern.stitches is {list(stitches)}: {wrong}")
    return np.array([[1 if letter == KNIT else -1 for letter in letters] for letters in stitches])


def standard(stitches: Sequence[str]) -> tuple[tuple[str, ...], int, int, int]:
    """Return the repeat that stands for all that are the same knit, and where the stitches are found in it.

    It is the smallest rectangle that repeats itself, begun and seen from where knit stitches come first. Stitch (i, j)
    is its stitch (i + up, j + along), of the same side where `front` is 1 and seen from behind where it is -1. The
    results are the rows of letters of the rectangle, up, along and front.

    Examples
    --------
    >>> standard(("PP",))[0]  # seen from behind, all purl is plain knit
    ('K',)
    """
    side = sides(stitches)
    rows, columns = (
        next(n for n in range(1, size + 1) if size % n == 0 and (np.roll(side, n, axis) == side).all())
        for axis, size in enumerate(side.shape)
    )
    side = side[:rows, :columns]
    images = []
    for front, up, along in product((1, -1), range(rows), range(columns)):
        image = np.where(front * np.roll(side, (up, along), (0, 1)) > 0, KNIT, PURL)
        images.append((tuple(map("".join, image)), up, along, front))
    return min(images, key=lambda image: image[0])


def drawn_from_plain(plain: Floats, wale: float, course: float, stitches: Sequence[str]) -> Floats:
    """Return the control points (r k P, 3) of stitches from the points of a plain loop (P, 3), row after row.

    The lower half of a loop lies on the side of its own stitch, the upper half on that of the stitch above, which
    holds its head. Where the two differ the leg crosses the plane, and a sinker does between stitches of a row that do.
    """
    own = sides(stitches)
    above = np.roll(own, -1, axis=0)
    before = np.roll(own, 1, axis=1)
    count = len(plain)
    quarter = count // 4
    k = np.arange(count)
    upper = (k > quarter) & (k < count - quarter)
    side = np.where(upper, above[..., None], own[..., None]).astype(float)  # (r, k, P)
    side[..., 0] = 0.5 * (before + own)
    side[..., [quarter, count - quarter]] = 0.5 * (own + above)[..., None]
    row, column, _ = np.indices(side.shape)
    moved = np.stack([column * wale, row * course, np.zeros(side.shape)], axis=-1)
    return (plain * np.stack([np.ones_like(side)] * 2 + [side], axis=-1) + moved).reshape(-1, 3)


def images_of_standard(points: Floats, wale: float, course: float, stitches: Sequence[str]) -> Floats:
    """Return the control points (r k P, 3) of stitches from the points of the repeat that stands for them."""
    first, up, along, front = standard(stitches)
    shape = (len(first), len(first[0]))
    of_loops = points.reshape(*shape, -1, 3)
    row, column = np.indices((len(stitches), len(stitches[0])))
    i, j = (row + up) % shape[0], (column + along) % shape[1]
    moved = np.stack([(column - j) * wale, (row - i) * course, np.zeros(row.shape)], axis=-1)
    return (of_loops[i, j] * [1, 1, front] + moved[:, :, None]).reshape(-1, 3)
