"""What the benchmarks of the book share: rows of the table, the bar, and a picture.

A benchmark is a file with `main(meshes, picture)`. It solves its problem on all `meshes`, the finest last, draws into
the file that `picture` names (None: no file), and returns its rows of the table, a `pandas.DataFrame`.
"""

import time
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from knitstudy.mechanics.beams.beam import BeamSection

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "resources" / "benchmarks.csv"
PICTURES = ROOT / "docs" / "notes"
COLUMNS = ["benchmark", "quantity", "parameter", "known", "here", "error", "uncertainty", "seconds"]


def slender(radius, bending=1.0, poisson_ratio=0.3, soft=1.0):
    """Return the section of a solid rod by its bending stiffness; `soft` divides its bending and twist alone."""
    modulus = 4 * bending / (np.pi * radius**4)
    section = BeamSection.circular(2 * radius, modulus, poisson_ratio)
    return BeamSection(section.EA, section.kGA, section.EI / soft, section.GJ / soft, section.slenderness)


class Page:
    """Rows of one benchmark, each from a bracket of meshes, and its picture."""

    def __init__(self, benchmark, picture):
        self.benchmark, self.picture = benchmark, picture
        self.rows, self.begun = [], time.process_time()
        self.figure, self.axes = plt.subplots(figsize=(4.5, 3.2), layout="constrained")
        self.axes.set_title(benchmark, fontsize=10)

    def compare(self, quantity, parameter, known, bracket, bar):
        """Add a row: the finest of a bracket of results against the known value, within a bar or no bar (None).

        The uncertainty is the last step of the bracket over the known value, nan of one mesh alone.
        """
        here, step = bracket[-1], bracket[-1] - bracket[-2] if len(bracket) > 1 else np.nan
        now = time.process_time()
        values = known, here, here / known - 1, abs(step / known), now - self.begun
        self.rows.append(dict(zip(COLUMNS, (self.benchmark, quantity, parameter, *values), strict=True)))
        self.begun = now
        print(f"{self.benchmark}, {quantity}, {parameter}: {here:.5g}, known {known:.5g} ({values[2]:+.2%})")
        assert bar is None or abs(values[2]) <= bar, (
            f"{quantity}: {here:.6g} is not within {bar:.1%} of {known:.6g}"
        )

    def finish(self, x, y, legend=True):
        """Return the rows; write the picture if it is asked for."""
        self.axes.set_xlabel(x)
        self.axes.set_ylabel(y)
        if legend:
            self.axes.legend(fontsize=8)
        if self.picture:
            self.figure.savefig(PICTURES / f"knots_{self.picture}.webp", dpi=90, pil_kwargs={"quality": 70})
        plt.close(self.figure)
        return pd.DataFrame(self.rows, columns=COLUMNS)
