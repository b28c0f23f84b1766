"""Pictures of pages that are kept: drawn from the simulations of one study, whichever study was run last."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

from knitstudy.figures.catalogue import FIGURES, draw
from knitstudy.figures.style import save
from knitstudy.report.files import read_sources, save_for_screen
from knitstudy.stages.displays import Displays


def draw_pictures(displays: Displays, names: Iterable[str], results: Path, folder: Path) -> None:
    """Draw figures and write them for the screen.

    Parameters
    ----------
    displays : Displays
        Of figures, whose scenes have results.
    names : iterable of str
        Figures among them.
    results, folder : Path
        What they are drawn from, and where they are written.

    Raises
    ------
    DataFileError
        When a result cannot be read, or the folder cannot be written to.
    """
    files = sources = None
    for name in names:
        if files != (taken := displays.files(name, results)):  # several may be of the same hundreds
            files, sources = taken, read_sources(taken.items())
        drawing = draw(name, **sources, scenes=displays.scenes(name))
        with TemporaryDirectory() as beside:
            picture = Path(beside) / f"{name}.png"
            save(drawing, [picture], sources, FIGURES.find(name).title)
            save_for_screen(picture, folder / f"{name}.webp")
