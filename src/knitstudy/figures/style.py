"""One visual language for all figures: sizes, type, a colour for every yarn and every model, and how files are written.

The colours can be told apart with any colour vision; models differ in marker and dash as well.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any

import matplotlib
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from knitstudy.errors import ConfigurationError
from knitstudy.files import code_version, replacing
from knitstudy.measures.discretisation import INTERACTIONS as INTERACTION_NAMES
from knitstudy.measures.discretisation import NAMES

# It tells at length how it cuts fonts for PDF.
logging.getLogger("fontTools").setLevel(logging.WARNING)

INCH = 25.4  # millimetres
PERCENT, MICROMETRE, MEGAPASCAL = 100.0, 1e6, 1e-6  # units of axes over those of data: 1, metre and pascal

Source = xr.Dataset | Mapping[str, xr.Dataset] | pd.DataFrame
"""An argument of a figure: a result, several by the names of their scenes, or a table of reference."""

SINGLE, DOUBLE = 84.0, 174.0  # widths of a figure of one and of two columns [mm]
RESOLUTION = "KNITSTUDY_DPI"
"""Environment variable: points an inch of figures. With fewer than the default pictures in space are drawn faster."""

DPI, COARSEST, FINEST = 300, 50, 1200

YARNS = ("#D55E00", "#009E73", "#0072B2", "#E69F00")
"""Vermilion, green and blue stand for the red, green and blue of Fig. 1 (Okabe and Ito 2008)."""

INK, FAINT, PAPER = "#1A1A1A", "#8C8C8C", "#FFFFFF"
ACCENT = "#8E1B5A"  # joints and contact points in pictures of solids

RC = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same letters on every machine
    "mathtext.fontset": "dejavusans",
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "lines.linewidth": 1.4,
    "lines.markersize": 4.0,
    "legend.frameon": False,
    "pdf.fonttype": 42,  # letters stay letters: PDFs can be searched and edited
}


def resolution() -> int:
    """Return the points an inch of figures.

    Raises
    ------
    ConfigurationError
        When the environment variable KNITSTUDY_DPI is no whole number, too small or too large.
    """
    said = os.environ.get(RESOLUTION, str(DPI))
    if not said.isascii() or not said.isdigit() or not COARSEST <= int(said) <= FINEST:
        raise ConfigurationError(
            f"{RESOLUTION} is {said!r}: allowed are whole numbers from {COARSEST} to {FINEST} (points an inch)"
        )
    return int(said)


@dataclass(frozen=True)
class Look:
    """How a model or an interaction is called and drawn in every figure."""

    label: str
    colour: str
    dash: str
    marker: str

    @property
    def line(self) -> dict:
        """Keywords of a matplotlib line."""
        return {"color": self.colour, "linestyle": self.dash, "marker": self.marker}


MODELS = {
    "dns": Look(NAMES["dns"], INK, "-", "o"),
    "rom3d": Look(NAMES["rom3d"], "#7B3294", "--", "s"),
    "rom2d": Look(NAMES["rom2d"], "#D9740B", "-.", "^"),
}

OTHER = Look("", "#5B6470", ":", "x")  # models of other fidelities

INTERACTIONS = {
    "tie": Look(INTERACTION_NAMES["tie"], INK, "-", "o"),
    "rough": Look(INTERACTION_NAMES["rough"], "#0072B2", "--", "s"),
    "isotropic": Look(INTERACTION_NAMES["isotropic"], "#D9740B", "-.", "^"),
}


BEAMS = {
    "tied": Look("", "#B79BC9", ":", "s"),
    "rigid": Look("", "#0072B2", "-", "v"),
    "hertz": Look("", "#56B4E9", "--", "^"),
}
"""Beams in contact by their section, and beams that are tied."""


def figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size in mm; no global state of pyplot is involved."""
    return Figure(figsize=(width / INCH, height / INCH))


def styled(draw: Callable[..., Any]) -> Callable[..., Any]:
    """Make a function draw in this style whatever the caller's settings are."""

    @wraps(draw)
    def inside(*given: Any, **named: Any) -> Any:
        with matplotlib.rc_context(RC):
            return draw(*given, **named)

    return inside


def panel_letter(axes: Axes, letter: str, title: str = "") -> None:
    """Put the letter of a panel, and its title, above its upper left corner."""
    axes.set_title(f"({letter})  {title}".rstrip(), loc="left", fontsize=8.5, pad=4)


def tint(colour: str, share: float = 0.45) -> tuple[float, float, float]:
    """Return a colour mixed with white; `share` is the share of the colour."""
    red, green, blue = to_rgb(colour)
    return tuple(share * part + 1 - share for part in (red, green, blue))


def save(figure: Figure, paths: Iterable[Path | str], sources: Mapping[str, Source], title: str) -> None:
    """Write a figure.

    Parameters
    ----------
    figure : Figure
    paths : iterable of Path or str
        Where to; the suffix chooses the format, ".png" (of `style.resolution`) or ".pdf".
    sources : mapping of str to Source
        What it was drawn from: scene and digest of each are recorded, of a table the code behind it.
    title : str
        Title of the document.

    Raises
    ------
    ConfigurationError
        When a suffix is not known, or KNITSTUDY_DPI is no resolution.
    DataFileError
        When a folder cannot be made.
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
    """Return the stages, scenes and digests of datasets in one line, and the code behind tables of reference."""
    parts = []
    for stage, source in sources.items():
        if isinstance(source, pd.DataFrame):
            code = sorted(set(source["code"].astype(str))) if "code" in source else []
            parts.append(f"{stage} [{', '.join(code) or 'unknown'}]")
            continue
        for each in [source] if isinstance(source, xr.Dataset) else source.values():
            scene, digest = (each.attrs.get(name, "unknown") for name in ("scene", "digest"))
            parts.append(f"{stage} of {scene} [{digest}]")
    return "; ".join(parts) or "drawn without data"
