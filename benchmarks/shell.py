"""Rib and stockinette with the yarns of the published simulation, a soft shell over a core; resources/shells.csv.

``python benchmarks/shell.py`` runs cells of beams without friction in some 40 s each. The public configuration of
Singal et al. 2024 (resources/measured) takes another acrylic yarn for every stitch, and an energy per both lengths

    v(r) = k D^2 / (p (p - 1)) (y^(1 - p) - 1 + (1 - p) (1 - y)),   y = (r - d) / D,   D = d' - d,

of the distance r of axes, with the diameters d of the core and d' of the shell. Their sum counts every pair twice, so
that V = 2 v in `mechanics.beams.line_contact`, without a factor by bends or angles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from knitstudy import load_scene, simulate
from knitstudy.errors import ConvergenceError
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.mechanics.beams.laws import LAWS, Law, Patch
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.paper.tables.fabrics import FORCES, Pulled, measured, strip_of
from knitstudy.run.behaviour import ENDLESS_BEAMS
from knitstudy.run.committed_tables import keep_table

KEPT = RESOURCES / "shells.csv"
STIFFNESS, POWER = 0.6e6, 2.4  # k [N/m3], p: of all stitches
OWN = {"stockinette": (1.48e-3, 0.65e-3), "rib": (2.36e-3, 0.82e-3)}  # diameters of shell and core [m]
DRAWN = 0.505e-3  # diameter for which loops are drawn, and beams are 0.45 of its radius over 0.6 long [m]
FULL = 0.02  # y below which the force goes on as a parabola
RUNS = [  # stitch, the stitch whose yarn it has, direction, cells
    ("rib", "rib", "wale", ("free", "held")),
    ("rib", "stockinette", "wale", ("free",)),
    ("stockinette", "stockinette", "wale", ("free",)),
    ("stockinette", "rib", "wale", ("free",)),
    ("stockinette", "rib", "course", ("free",)),
]
JAMMED = {
    "pattern.course_spacing": 2.45e-3,
    "pattern.wale_spacing": 3.0e-3,
}  # of stockinette with the yarn of rib


class Plain(Patch):
    """Contact whose energy depends on the distance of pieces alone."""

    def density(self, k_a: Any, k_b: Any, cos: Any, near: Any) -> tuple[Any, Any]:
        """Return ones."""
        one = 1.0 + 0.0 * k_a
        return one, one


@LAWS.register
@dataclass(frozen=True, eq=False)
class ShellOverCore(Law):
    """The force 2 pi r V of two straight yarns that cross; the core of the yarn is that of `OWN`."""

    name, meaning, label = "shell", "a soft shell over a core", "shell over core"
    look = ("#D55E00", ":", "s")

    shell: float = 0.0
    core: float = 0.0

    @classmethod
    def of(cls, yarn: Any, beam: Any) -> ShellOverCore:
        """Return the law of a scene."""
        core = next(core for shell, core in OWN.values() if np.isclose(shell, yarn.diameter))
        return cls(1.0, 2.0, patch=Plain(), shell=yarn.diameter, core=core)

    def force(self, approach: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the force (k,) [N] at approaches (k,) [m] and its two derivatives; zero where open."""
        soft = self.shell - self.core
        p = POWER
        y = 1 - np.maximum(approach, 0.0) / soft
        at = np.maximum(y, FULL)
        beyond = np.minimum(y - at, 0.0)
        scale = 2 * STIFFNESS * soft**2 / (p * (p - 1))
        second = p * (p - 1) * at ** (-p - 1)
        first = (1 - p) * (at**-p - 1) + second * beyond
        value = at ** (1 - p) - 1 + (1 - p) * (1 - at) + first * beyond - second * beyond**2 / 2
        V = scale * value
        V1 = -scale * first / soft
        V2 = scale * second / soft**2
        r = np.maximum(self.shell - approach, 1e-6)
        parts = r * V, r * V1 - V, r * V2 - 2 * V1
        force, slope, bend = (np.where(approach > 0, 2 * np.pi * part, 0.0) for part in parts)
        return force, slope, bend


def history(stitch: str, yarn: str, deformation: str, others: str) -> Any:
    """Return the history of a cell of a stitch with the yarn of a stitch."""
    diameter = OWN[yarn][0]
    changes = {
        "yarn.diameter": diameter,
        "yarn.pressing": None,
        "beam.section": "shell",
        "yarn.stretching": 500.0,
        "geometry.diameter_share": DRAWN / diameter,
        "mesh.beam_size": 0.45 * DRAWN / 0.6 / diameter,
        "contact.friction": 0.0,
        "load.start": "rest",
        "solver.increments": 100 if deformation != "shear" else 5,
        "gates.overlap": 2.0,
        "gates.point": 1000.0,
        "gates.polygon": 1.0,
    }
    if (stitch, yarn) == ("stockinette", "rib"):
        changes |= JAMMED
    try:
        return simulate(load_scene(f"fabric-acrylic-{stitch}-{deformation}-{others}").vary(changes)).history
    except ConvergenceError as error:
        print(f"{stitch} with the yarn of {yarn}, {deformation}, {others}: {error}")
        return error.history


def rows() -> Iterator[pd.DataFrame]:
    """Yield strains of cells and, where width was held as well, of strips between clamps, beside measured ones."""
    for stitch, yarn, direction, others in RUNS:
        cells = {each: Pulled.of(history(stitch, yarn, direction, each), direction) for each in others}
        known = measured(stitch, yarn="acrylic", direction=direction)
        columns = {
            "stitch": stitch,
            "yarn_of": yarn,
            "direction": direction,
            "force_per_width_N_mm": FORCES,
            "measured": np.interp(FORCES, known["force_per_width_N_mm"], known["strain"], right=np.nan),
            **{each: cell.strain for each, cell in cells.items()},
        }
        table = pd.DataFrame(columns)
        if "held" in cells:
            sheared = history(stitch, yarn, "shear", "free")
            table["strip"] = strip_of(cells, sheared, "acrylic", stitch, direction).strain
        print(table.round(4).to_string(index=False), flush=True)
        yield table


if __name__ == "__main__":
    table = pd.concat(rows(), ignore_index=True).round(4)
    keep_table(table, KEPT, "python benchmarks/shell.py", [ENDLESS_BEAMS])
