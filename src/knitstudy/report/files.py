"""Results that a figure or table is made from, and pictures as small as a screen needs."""

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

READERS = {".nc": read_result, ".csv": read_table, ".yaml": read_yaml}
WIDTH = 1500  # points of the widest picture of the page on a screen of nearly two points a pixel
FORMAT = {"format": "WEBP", "quality": 85}  # lines and letters stay sharp


def read_sources(files: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Return the contents of files by argument; several files of one argument by the names of their scenes.

    Parameters
    ----------
    files : iterable of (str, path) or (str, sequence of paths)

    Raises
    ------
    DataFileError, ConfigurationError
        When a file is missing or cannot be read.
    """

    def read(found: Any) -> Any:
        if isinstance(found, str | Path):
            return READERS[Path(found).suffix](Path(found))
        return {dataset.attrs["scene"]: dataset for dataset in map(read, found)}

    return {name: read(found) for name, found in files}


@dataclass(frozen=True)
class ScreenPicture:
    """A picture as a data URI, with the size [points] and the metadata of its file."""

    uri: str
    width: int
    height: int
    said: dict[str, str]


def for_screen(path: Path) -> ScreenPicture:
    """Return a picture as a screen shows it; DataFileError when it cannot be read."""
    shown, width, height, said = _shown(path)
    stored = BytesIO()
    shown.save(stored, **FORMAT)
    uri = f"data:image/webp;base64,{b64encode(stored.getvalue()).decode()}"
    return ScreenPicture(uri, width, height, said)


def save_for_screen(path: Path, target: Path) -> None:
    """Write a picture as a screen shows it; DataFileError when it cannot be read, or its folder cannot be made."""
    shown, *_ = _shown(path)
    with replacing(target) as temporary:
        shown.save(temporary, **FORMAT)


def _shown(path: Path) -> tuple[Image.Image, int, int, dict[str, str]]:
    try:
        with Image.open(path) as image:
            width, height, said = *image.size, dict(image.info)
            shown = image.convert("RGB")
    except (OSError, UnidentifiedImageError) as error:
        raise DataFileError(f"{path}: is no picture ({error}); make it again with `make study`") from error
    shown.thumbnail((WIDTH, height), Image.Resampling.LANCZOS)
    return shown, width, height, said
