"""Writes figures as PNG and PDF, whole or not at all, with their origin inside the file."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from pathlib import Path

import matplotlib
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.errors import ConfigurationError
from knitstudy.figures.picture import is_fallback
from knitstudy.figures.style import RC, resolution
from knitstudy.files import code_version, replacing

# It tells at length how it cuts fonts for PDF.
logging.getLogger("fontTools").setLevel(logging.WARNING)

FALLBACK_RENDERER = "matplotlib instead of VTK"
"""Entry ``Renderer`` in the PNG of a three-dimensional figure that was drawn without VTK."""

Source = xr.Dataset | Mapping[str, xr.Dataset] | pd.DataFrame
"""What a figure calls by one name: a result, several by the names of their scenes, or a table of reference."""


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
    if is_fallback(figure):
        metadata[".png"]["Renderer"] = FALLBACK_RENDERER
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
