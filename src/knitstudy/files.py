"""Files that are written whole or not at all; texts in any usual encoding."""

from __future__ import annotations

import errno
import glob
import hashlib
import os
import shutil
import stat
import time
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from knitstudy.errors import DataFileError, UnwritableError, message_of

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of disks that are full, beyond a quota or a limit, or broken."""

FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS)
"""Errors of folders of others, and of those that can only be read."""

ROOM = "make room on the disk and type the same command again; what was there before is as it was"

ABANDONED = 3600.0
"""Seconds without a change after which a temporary file counts as that of a killed process: nobody writes so long."""

LATER = 10 * 365 * 86400.0
"""Seconds by which a file is newer than all others: no clock is fast by ten years."""


def safe_name(text: str) -> str:
    """Return a text from data as a part of a file's name: no folders, no marks that a system refuses, not too long.

    A text that is changed gets a digest at its end, so that other texts have other names.

    Examples
    --------
    >>> safe_name("cotton"), safe_name("50/50 wool")
    ('cotton', '50-50 wool-03dd09')
    """
    marked = "".join("-" if mark in '<>:"/\\|?*' or not mark.isprintable() else mark for mark in text)
    plain = marked.strip(" .-")[:60]
    if plain and plain == text:
        return plain
    return f"{plain or 'unnamed'}-{hashlib.sha256(text.encode()).hexdigest()[:6]}"


@contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Write a file whole or not at all: yield a temporary name, with the same suffix, that takes its place on success.

    On an exception the temporary file is deleted, and the file stays as it was. Temporary names are random: processes
    that write one file at the same time never meet, and the last one to end stays.
    Raises DataFileError when the folder cannot be made, the disk cannot be written, or the block wrote no file.
    """
    path = Path(path)
    temporary = _temporary(path)
    with naming_remedy(path):
        try:
            _make_folder(path.parent)
            yield temporary
            if not temporary.exists():
                raise DataFileError(f"{path}: nothing was written")
            _flush_to_disk(temporary)
            _delete_abandoned(path, temporary.stat().st_mtime)
            os.replace(temporary, path)
            _flush_to_disk(path.parent)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def replacing_together(folder: Path | str, stale: Iterable[str] = ()) -> Iterator[Path]:
    """Write the files of one answer together or not at all: yield a folder whose files move into `folder` on success.

    Files of the names `stale`, relative to the folder, that the block did not write are of an earlier answer: they are
    deleted. All other files of the folder stay. On an exception nothing in the folder has changed.
    Raises DataFileError when the folder cannot be made or the disk cannot be written.
    """
    folder = Path(folder)
    with naming_remedy(folder):
        _make_folder(folder)
        temporary = _temporary(folder / "files")
        try:
            temporary.mkdir()
            yield temporary
            _delete_abandoned(folder / "files", temporary.stat().st_mtime)
            written = {file.relative_to(temporary) for file in temporary.rglob("*") if file.is_file()}
            for inside in {name.parent for name in written}:
                _make_folder(folder / inside)
            for name in sorted(written):
                os.replace(temporary / name, folder / name)
            for name in set(map(Path, stale)) - written:
                (folder / name).unlink(missing_ok=True)
            _flush_to_disk(folder)
        except UnwritableError as error:  # of a file in the temporary folder, which is gone then
            raise UnwritableError(str(error).replace(str(temporary), str(folder))) from error
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


@contextmanager
def naming_remedy(path: Path | str, elsewhere: str = "name another folder, as with -o") -> Iterator[None]:
    """Raise an OSError of the block that a user can mend as an UnwritableError that names path and remedy.

    `elsewhere` is the remedy where this user may not write.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in FULL + FORBIDDEN:
            raise
        remedy = ROOM if error.errno in FULL else elsewhere
        raise UnwritableError(f"{path}: cannot be written ({error.strerror}): {remedy}") from error


def require_writable(path: Path) -> None:
    """Raise the DataFileError of `replacing` before anything is computed for a file that cannot be written."""
    with suppress(InterruptedError), replacing(path) as temporary:
        temporary.touch()
        raise InterruptedError


def open_regular(path: Path) -> TextIO:
    """Open a text file to read and write whose name is fixed, such as a lock or a log; it is made if there is none.

    A link is not followed, and a pipe is not waited for: somebody else's folder may hold either.
    Raises DataFileError where the path is not a regular file.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK
    try:
        descriptor = os.open(path, flags, 0o666)
    except OSError as error:
        if error.errno not in (errno.ELOOP, errno.EISDIR, errno.ENXIO):
            raise
        raise DataFileError(f"{path}: is not a regular file, and is not written to; delete it") from error
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise DataFileError(f"{path}: is not a regular file, and is not written to; delete it")
    return os.fdopen(descriptor, "r+", encoding="utf-8", errors="replace")


def lay_link_to_later(path: Path) -> None:
    """Lay a link to a folder that is newer than any file, also of a clock that is fast; the link itself is of today.

    As an input it makes Snakemake make a result again. Snakemake compares the target's time with those of results when
    it plans, and the time of the link with that of the new result. The target is no file, since Snakemake would take
    the same content as no change. Raises DataFileError where the link cannot be laid, or something else has its name.
    """
    target = path.with_name(f"{path.name}.d")
    now = time.time()
    with naming_remedy(path, "take a folder of your own"):
        _make_folder(target)
        with suppress(PermissionError):  # somebody else's, whose time is right
            os.utime(target, (now + LATER, now + LATER), follow_symlinks=False)
        with suppress(FileExistsError):
            path.symlink_to(target.name)
    if not (path.is_symlink() and path.exists() and path.stat().st_mtime > now):
        raise DataFileError(f"{path}: is not a link to {target.name} of a later time; delete both")


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise DataFileError(f"{folder}: the folder cannot be made: {error}") from error


def _temporary(path: Path) -> Path:
    """Return a name that nobody else takes, beside a path and with its suffix."""
    return path.with_name(f".{path.stem}.{uuid.uuid4().hex[:12]}.partial{path.suffix}")


def _delete_abandoned(path: Path, now: float) -> None:
    """Delete what killed processes have left of a path; `now` is by the clock of the file system [s]."""
    for left in path.parent.glob(f".{glob.escape(path.stem)}.*.partial{path.suffix}"):
        with suppress(OSError):  # another process may delete it as well
            if now - left.lstat().st_mtime < ABANDONED:
                continue
            if left.is_dir() and not left.is_symlink():
                shutil.rmtree(left, ignore_errors=True)
            else:
                left.unlink()


def _flush_to_disk(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


# Texts

# By the bytes that a file begins with; else UTF-8, and what western programs wrote before it
MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}


def read_text(path: Path) -> str:
    """Return the text of a file from another program, in any usual encoding; DataFileError where it cannot be read."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise DataFileError(f"{path}: cannot be read ({message_of(error, OSError)})") from error
    encoding = next((name for mark, name in MARKS.items() if raw.startswith(mark)), None)
    for name in (encoding,) if encoding else ("utf-8", "cp1252", "latin-1"):
        try:
            return raw.decode(name)
        except UnicodeError:
            continue
    raise DataFileError(f"{path}: is not a text file")


def write_text(text: str, path: Path | str) -> None:
    """Write a text whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
