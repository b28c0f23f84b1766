"""The yarns of a cell of an endless fabric, divided into beams."""

from __future__ import annotations

from dataclasses import dataclass
from math import lcm

import numpy as np

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.loading.history import Stations
from knitstudy.knit.models.beam import CellOfBeams
from knitstudy.knit.scene.sections import INLAY
from knitstudy.knit.scene.stitches import size_of_repeat
from knitstudy.knit.yarns.network import RING
from knitstudy.mechanics.cells.tiling import Tiling
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.rotation import turns

FEWEST = 8  # beams of a yarn in one repeat


@dataclass(frozen=True, eq=False)
class Rows:
    """The yarns of one period, divided into beams."""

    stations: Stations  # the n nodes of the period
    period: Floats  # (Y,) lengths of the yarns [m]
    vectors: Floats  # (2, 3), from the period to the next ones, as drawn [m]
    curvature: Floats  # (n, 3) mean curvature vectors of the beams as drawn [1/m]
    polygon: float  # by how much straight beams in bent yarns are too stiff

    @property
    def image(self) -> Ints:
        """How many periods (N, 2) away from its owner a node is."""
        image = np.zeros((len(self.owner), 2), dtype=int)
        image[len(self.stations.yarn) :, 0] = 1
        return image

    @property
    def owner(self) -> Ints:
        """The node (N,) that every one is or is an image of: last come images of the first node of every yarn."""
        yarn = self.stations.yarn
        return np.append(np.arange(len(yarn)), np.searchsorted(yarn, np.unique(yarn)))

    @property
    def ends(self) -> Ints:
        """Nodes (n, 2) at the ends of the beams."""
        yarn = self.stations.yarn
        n = len(yarn)
        follower = np.arange(1, n + 1)
        follower[np.flatnonzero(np.diff(yarn, append=-1))] = n + np.arange(len(self.period))
        return np.column_stack([np.arange(n), follower])

    @property
    def nodes(self) -> Floats:
        """All nodes (N, 3) [m]."""
        return self.stations.position[self.owner] + self.image @ self.vectors

    def tiled(self, tiling: Tiling) -> Rows:
        """Return the rows of several cells side by side as the rows of one larger cell."""
        stations = self.stations
        courses = tiling.counts[0]
        yarn = stations.yarn[tiling.place]
        return Rows(
            stations=Stations(
                yarn=yarn + len(self.period) * tiling.cell[:, 1],
                arc_length=stations.arc_length[tiling.place] + tiling.cell[:, 0] * self.period[yarn],
                position=tiling.positions(stations.position, self.vectors),
            ),
            period=np.tile(courses * self.period, tiling.counts[1]),
            vectors=tiling.counts[:, None] * self.vectors,
            curvature=self.curvature[tiling.place],
            polygon=self.polygon,
        )


def divided(fabric: Fabric, size: float, repeats: Ints) -> Rows:
    """Return the rows of one repeat of an endless fabric in beams that are `size` long, nearly [m].

    The fabric has so many `repeats` (2,) along courses and wales.
    """
    lines = fabric.centrelines[: (len(fabric.centrelines) - 1) // repeats[1]]
    period = np.array([line.length for line in lines]) / repeats[0]
    count = np.maximum(np.rint(period / size), FEWEST).astype(int)
    yarn = np.repeat(np.arange(len(lines)), count)
    first = np.cumsum(count) - count
    s = np.concatenate([np.arange(n) * length / n for n, length in zip(count, period, strict=True)])
    step = (period / count)[yarn]
    position = np.concatenate([line.position(s[yarn == k]) for k, line in enumerate(lines)])
    tangent = np.concatenate([line.tangent(s[yarn == k]) for k, line in enumerate(lines)])
    follower = np.arange(1, len(s) + 1)
    follower[first + count - 1] = first
    turn = turns(tangent, tangent[follower])
    return Rows(
        stations=Stations(yarn, s, position),
        period=period,
        vectors=fabric.periods / repeats[:, None],
        curvature=turn / step[:, None],
        polygon=RING * float(step @ (turn**2).sum(axis=1) / step.sum()),
    )


def repeats_of(scene: CellOfBeams) -> Ints:
    """Return how many repeats of its stitches, and of its yarns, a cell has along courses and wales (2,)."""
    loops, rows = size_of_repeat(scene.pattern.stitches)
    if len(scene.yarns) > 1:
        turns_of_yarns = len(scene.yarn_b.rows) - scene.yarn_b.rows.count(INLAY)
        rows = lcm(rows, turns_of_yarns)
    return np.maximum([scene.pattern.loops // loops, scene.pattern.rows // rows], 1)


def cell_rows(scene: CellOfBeams, fabric: Fabric) -> Rows:
    """Return the rows of the whole cell of a scene; all its repeats are divided in the same way."""
    repeats = repeats_of(scene)
    one = divided(fabric, scene.mesh.beam_size * scene.yarn.radius, repeats)
    return one.tiled(Tiling.of(one.stations.yarn, repeats))
