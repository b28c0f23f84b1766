"""What solid yarns are at many sections, all sampled at the same points: sums along the yarn first, then across."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.polynomial_yarn import disc
from knitstudy.mechanics.polynomial_yarn.space import Space


class Sampling:
    """A linear map from nodes (N, ...) to the points (S q, ...) of sections, as a product: ``sampling @ nodes``.

    As one sparse matrix it would have (d + 1) n_p entries a point.

    Parameters
    ----------
    space : Space
    yarn : ndarray of int, shape (S,)
        Of every section.
    s : ndarray, shape (S,)
        Its arc length [m].
    points : ndarray, shape (q, 2)
        In a section, over the radius.
    """

    def __init__(self, space: Space, yarn: np.ndarray, s: np.ndarray, points: np.ndarray) -> None:
        degree = max(each.degree for each in space.yarns)
        self._across = disc.values(degree, points)
        functions = disc.size(degree)
        rows, columns, values = [], [], []
        for number, own in enumerate(space.yarns):
            here = np.flatnonzero(yarn == number)
            first, along = own.spline.basis(s[here])
            spline = first[:, None] + np.arange(along.shape[2])
            count = disc.size(own.degrees)[spline]
            k = np.arange(functions)
            there = k < count[..., None]
            rows.append(np.broadcast_to((here[:, None, None] * functions + k), there.shape)[there])
            columns.append((space.first_node[number] + own.first_node[spline][..., None] + k)[there])
            values.append(np.broadcast_to(along[0][..., None], there.shape)[there])
        rows, columns, values = (np.concatenate(parts) for parts in (rows, columns, values))
        self._along = sp.csr_matrix((values, (rows, columns)), shape=(len(s) * functions, space.size))
        self.shape = (len(s) * len(points), space.size)

    def __matmul__(self, nodes: np.ndarray) -> np.ndarray:
        """Return the values (S q, ...) of nodes (N, ...)."""
        functions = self._across.shape[1]
        sums = (self._along @ nodes.reshape(len(nodes), -1)).reshape(-1, functions, nodes[0].size)
        return (self._across @ sums).reshape(-1, *nodes.shape[1:])
