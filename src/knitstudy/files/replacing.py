"""Files written whole or not at all."""

from __future__ import annotations

import errno
import glob
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from knitstudy.errors import DataFileError

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
"""Disks that take nothing more: full, beyond a quota or a limit, read only, or broken."""


@contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Write a file whole or not at all: yield a temporary name beside it that takes its place on success.

    The temporary name keeps the suffix, since many writers choose their format by it. On an exception the
    temporary file is deleted and what was at ``path`` before stays.

    Raises
    ------
    DataFileError
        When the folder cannot be made, the disk is full or takes nothing more, or the block ended without writing the
        temporary file.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.partial{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataFileError(f"{path}: the folder cannot be made: {error}") from error
    _clear_abandoned(path)
    try:
        yield temporary
        if not temporary.exists():
            raise DataFileError(f"{path}: nothing was written")
        _flush_to_disk(temporary)
        os.replace(temporary, path)
        _flush_to_disk(path.parent)
    except OSError as error:
        if error.errno not in NO_ROOM:
            raise
        raise DataFileError(
            f"{path}: cannot be written ({error.strerror}): make room on the disk and type the same command again; "
            "what was there before is as it was"
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def _clear_abandoned(path: Path) -> None:
    """Delete what processes that were killed while they wrote this file have left beside it."""
    for partial in path.parent.glob(f".{glob.escape(path.stem)}.*.partial{path.suffix}"):
        process = partial.name.removesuffix(f".partial{path.suffix}").rpartition(".")[2]
        try:
            os.kill(int(process), 0)
        except (ValueError, ProcessLookupError):
            partial.unlink(missing_ok=True)
        except PermissionError:
            continue  # alive, and another user's


def _flush_to_disk(path: Path) -> None:
    """Make a rename safe against a crash of the machine: content first, then the folder's entry."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
