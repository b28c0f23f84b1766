"""Reads what a figure or table is made from, and makes pictures as small as a screen needs."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image, UnidentifiedImageError

from knitstudy.errors import DataFileError
from knitstudy.files import read_result, read_table, replacing
from knitstudy.study.documents import read_yaml

# ---- Reads what a figure or a table is made from


READERS = {".nc": read_result, ".csv": read_table, ".yaml": read_yaml}


def read_sources(files: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Return what files hold, by name; several files of one name by the names of their scenes.

    Parameters
    ----------
    files : iterable of (str, path) or (str, sequence of paths)

    Raises
    ------
    DataFileError, ConfigurationError
        When a file is missing or cannot be read.
    """
    return {name: _read(found) for name, found in files}


def _read(found: Any) -> Any:
    if isinstance(found, str | Path):
        return READERS[Path(found).suffix](Path(found))
    datasets = [_read(path) for path in found]
    return {dataset.attrs["scene"]: dataset for dataset in datasets}


# ---- Pictures as a page holds them: as many points as a screen shows


WIDTH = 1500
"""Points in a row: the widest picture of the page on a screen of nearly two points a pixel. The file keeps them all."""

FORMAT, QUALITY = "WEBP", 85  # webP, and that of it in which lines and letters stay sharp


@dataclass(frozen=True)
class ScreenPicture:
    """A picture as a data URI, with the size [points] of its file and what the file says of itself."""

    uri: str
    width: int
    height: int
    said: dict[str, str]


def for_screen(path: Path) -> ScreenPicture:
    """Return a picture as a screen shows it.

    Raises
    ------
    DataFileError
        When it cannot be read.
    """
    shown, width, height, said = _shown(path)
    stored = BytesIO()
    shown.save(stored, FORMAT, quality=QUALITY)
    return ScreenPicture(
        f"data:image/webp;base64,{b64encode(stored.getvalue()).decode()}", width, height, said
    )


def save_for_screen(path: Path, target: Path) -> None:
    """Write a picture as a screen shows it.

    Raises
    ------
    DataFileError
        When it cannot be read, or its folder cannot be made.
    """
    shown, *_ = _shown(path)
    with replacing(target) as temporary:
        shown.save(temporary, FORMAT, quality=QUALITY)


def _shown(path: Path) -> tuple[Image.Image, int, int, dict[str, str]]:
    try:
        with Image.open(path) as image:
            width, height, said = *image.size, dict(image.info)
            shown = image.convert("RGB")
    except (OSError, UnidentifiedImageError) as error:
        raise DataFileError(f"{path}: is no picture ({error}); make it again with `make study`") from error
    shown.thumbnail((WIDTH, height), Image.Resampling.LANCZOS)
    return shown, width, height, said
