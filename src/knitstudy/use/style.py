"""One visual language for all figures: sizes, type, a colour for every yarn and every model, and how files are written.

The colours can be told apart with any colour vision; models differ in marker and dash as well.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, TypeAlias

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from numpy.typing import NDArray

from knitstudy.datasets import code_version
from knitstudy.errors import ConfigurationError
from knitstudy.files import replacing

# It tells at length how it cuts fonts for PDF.
logging.getLogger("fontTools").setLevel(logging.WARNING)

INCH = 25.4  # millimetres
# Units of axes over those of data: 1, metre and pascal
PERCENT, MILLIMETRE, MICROMETRE, MEGAPASCAL = 100.0, 1e3, 1e6, 1e-6

Source: TypeAlias = xr.Dataset | Mapping[str, xr.Dataset] | pd.DataFrame
"""An argument of a figure: a result, several by the names of their scenes, or a table of reference."""

Style = dict[str, Any]
"""Keywords of matplotlib for the looks of lines, marks and letters."""

SINGLE, DOUBLE = 84.0, 174.0  # widths of a figure of one and of two columns [mm]
RESOLUTION = "KNITSTUDY_DPI"  # environment variable: points an inch; with fewer, solids are drawn faster
DPI, COARSEST, FINEST = 300, 50, 1200

# Vermilion, green and blue stand for the red, green and blue of Fig. 1 (Okabe and Ito 2008).
YARNS = ("#D55E00", "#009E73", "#0072B2", "#E69F00")

INK, FAINT, PAPER = "#1A1A1A", "#8C8C8C", "#FFFFFF"
ACCENT = "#8E1B5A"  # joints and contact points in pictures of solids

# All settings: a file `matplotlibrc` of the working folder has others, such as a program that sets texts.
RC = {
    name: value
    for name, value in matplotlib.rc_params_from_file(Path(__file__).with_name("figures.mplstyle")).items()
    if name.partition(".")[0] not in ("backend", "interactive", "toolbar", "webagg", "tk", "date")
}

styled = matplotlib.rc_context(RC)  # a decorator: draw in this style whatever the caller's settings are


def resolution() -> int:
    """Return the points an inch of figures.

    Raises ConfigurationError when the environment variable KNITSTUDY_DPI is no whole number, too small or too large.
    """
    text = os.environ.get(RESOLUTION, str(DPI))
    if not text.isascii() or not text.isdigit() or not COARSEST <= int(text) <= FINEST:
        raise ConfigurationError(
            f"{RESOLUTION} is {text!r}: allowed are whole numbers from {COARSEST} to {FINEST} (points an inch)"
        )
    return int(text)


@dataclass(frozen=True)
class Look:
    """How a model or an interaction is called and drawn in every figure."""

    label: str
    colour: str
    dash: str
    marker: str

    @property
    def line(self) -> Style:
        """Keywords of a matplotlib line."""
        return {"color": self.colour, "linestyle": self.dash, "marker": self.marker}


class Page(Figure):
    """A figure that notebooks show by itself."""

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        with matplotlib.rc_context(RC):
            self.savefig(picture, format="png")
        return picture.getvalue()


def figure(width: float, height: float, **options: Any) -> Figure:
    """Return an empty figure of a size in mm; no global state of pyplot is involved."""
    return Page(figsize=(width / INCH, height / INCH), **options)


def pixels(drawing: Figure) -> NDArray[np.uint8]:
    """Return a figure as an array (height, width, 4), RGBA, at its own resolution."""
    canvas: Any = FigureCanvasAgg(drawing)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())


def place(drawing: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Return new axes; `left` and `width` are shares of the figure's width, `bottom` and `height` are in mm."""
    whole = INCH * drawing.get_figheight()
    return drawing.add_axes((left, bottom / whole, width, height / whole))


def height(axes: Axes) -> float:
    """Return the height of axes [mm]."""
    drawing = axes.get_figure(root=True)
    assert drawing is not None
    return float(INCH * drawing.get_figheight() * axes.get_position().height)


def shared_legend(drawing: Figure, **look: Any) -> Legend:
    """Draw one legend of all labels in a figure, each once, at the lower edge unless a place is given."""
    pairs = [zip(*axes.get_legend_handles_labels(), strict=True) for axes in drawing.axes]
    unique = {label: handle for pair in pairs for handle, label in pair}
    return drawing.legend(unique.values(), unique.keys(), **{"loc": "lower center"} | look)


def panel_letter(axes: Axes, letter: str, title: str = "") -> None:
    """Put the letter of a panel, and its title, above its upper left corner."""
    axes.set_title(f"({letter})  {title}".rstrip(), loc="left", fontsize=8.5, pad=4)


def tint(colour: str, share: float = 0.45) -> tuple[float, float, float]:
    """Return a colour mixed with white; `share` is the share of the colour."""
    red, green, blue = to_rgb(colour)
    return share * red + 1 - share, share * green + 1 - share, share * blue + 1 - share


def save(figure: Figure, paths: Iterable[Path | str], sources: Mapping[str, Source], title: str) -> None:
    """Write a figure as .png (of `resolution`) or .pdf, with scene and digest of each of the sources that it shows.

    Raises ConfigurationError when a suffix is not known, or KNITSTUDY_DPI is no resolution, and DataFileError when a
    folder cannot be made.
    """
    origin = describe(sources)
    software = f"knitstudy {code_version()}"
    metadata = {
        ".png": {"Title": title, "Source": origin, "Software": software},
        # Without a date the same data give the same file.
        ".pdf": {"Title": title, "Subject": origin, "Creator": software, "CreationDate": None},
    }
    with matplotlib.rc_context(RC):
        for path in map(Path, paths):
            if path.suffix not in metadata:
                raise ConfigurationError(f"{path}: figures are written as {' and '.join(metadata)}")
            with replacing(path) as temporary:
                figure.savefig(temporary, dpi=resolution(), metadata=metadata[path.suffix])


def describe(sources: Mapping[str, Source]) -> str:
    """Return the stages, scenes and digests of datasets in one line, and the runs behind committed tables."""
    parts = []
    for stage, source in sources.items():
        if isinstance(source, pd.DataFrame):
            runs = sorted(set(source["run"])) if "run" in source else []
            parts.append(f"{stage} [{', '.join(f'run {run}' for run in runs) or 'unknown'}]")
            continue
        for dataset in [source] if isinstance(source, xr.Dataset) else source.values():
            scene, digest = (dataset.attrs.get(name, "unknown") for name in ("scene", "digest"))
            parts.append(f"{stage} of {scene} [{digest}]")
    return "; ".join(parts) or "drawn without data"
