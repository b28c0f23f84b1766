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
from knitstudy.files import read_result, read_table
from knitstudy.knit.scene.documents import read_yaml

READERS = {".nc": read_result, ".csv": read_table, ".yaml": read_yaml}
WIDTH = 1300  # points of the widest picture of the page, which is at most 822 pixels wide on a screen
FORMAT = {"format": "WEBP", "quality": 80}  # lines and letters stay sharp


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

    def read(source: Any) -> Any:
        if isinstance(source, str | Path):
            return READERS[Path(source).suffix](Path(source))
        return {dataset.attrs["scene"]: dataset for dataset in map(read, source)}

    return {name: read(source) for name, source in files}


@dataclass(frozen=True)
class ScreenPicture:
    """A picture as a screen shows it (WebP), with the size [points] and the metadata of its file, and its width."""

    content: bytes
    width: int
    height: int
    metadata: dict[str, str]
    millimetres: float = 0.0

    @classmethod
    def of(cls, path: Path) -> ScreenPicture:
        """Return the picture of a file; DataFileError when it cannot be read."""
        try:
            with Image.open(path) as image:
                shown, texts = image.convert("RGB"), dict(image.info)
        except (OSError, UnidentifiedImageError) as error:
            message = f"{path}: is no picture ({error}); make it again with `make study`"
            raise DataFileError(message) from error
        width, height = shown.size
        millimetres = 25.4 * width / float(texts.get("dpi", (300.0,))[0])
        shown.thumbnail((WIDTH, height), Image.Resampling.LANCZOS)
        stored = BytesIO()
        shown.save(stored, **FORMAT)
        return cls(stored.getvalue(), width, height, texts, millimetres)

    @property
    def uri(self) -> str:
        """The picture as a data URI."""
        return f"data:image/webp;base64,{b64encode(self.content).decode()}"
