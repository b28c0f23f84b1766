"""Files that are written whole or not at all; tables; datasets with provenance and a checksum."""

from __future__ import annotations

import errno
import fcntl
import glob
import hashlib
import os
import subprocess
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import knitstudy
from knitstudy.errors import DataFileError, HeldOpenError, message_of
from knitstudy.interruption import uninterrupted

if TYPE_CHECKING:  # where they are needed, functions import them: the command starts in half the time
    import pandas as pd
    import xarray as xr

# Files written whole or not at all

REMEDIES = dict.fromkeys(
    (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO),
    "make room on the disk and type the same command again; what was there before is as it was",
) | dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS), "name another folder, as with -o")
"""What helps on errors of disks that are full, beyond a quota or a limit, or broken, and of folders of others."""


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

    On an exception the temporary file is deleted, and the file stays as it was. The temporary file is locked: a run in
    another container or on another computer, whose processes may have the same numbers, does not delete it.
    Raises DataFileError when the folder cannot be made, the disk cannot be written, or the block wrote no file.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{uuid.uuid4().hex[:12]}.partial{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataFileError(f"{path}: the folder cannot be made: {error}") from error
    _clear_abandoned(path)
    try:
        with _locked(temporary):
            yield temporary
            if not temporary.exists():
                raise DataFileError(f"{path}: nothing was written")
            _flush_to_disk(temporary)
            os.replace(temporary, path)
            _flush_to_disk(path.parent)
    except OSError as error:
        if error.errno not in REMEDIES:
            raise
        remedy = REMEDIES[error.errno]
        raise DataFileError(f"{path}: cannot be written ({error.strerror}): {remedy}") from error
    finally:
        temporary.unlink(missing_ok=True)


def require_writable(path: Path) -> None:
    """Raise the DataFileError of `replacing` before anything is computed for a file that cannot be written."""
    with suppress(InterruptedError), replacing(path):
        raise InterruptedError


@contextmanager
def _locked(temporary: Path) -> Iterator[None]:
    """Hold a lock beside a temporary file: HDF5 locks the file itself."""
    beside = Path(f"{temporary}.lock")
    try:
        with beside.open("ab") as lock:
            with suppress(OSError):  # a file system without locks
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # lockf would not hold off other threads
            yield
    finally:
        beside.unlink(missing_ok=True)


def _clear_abandoned(path: Path) -> None:
    """Delete the temporary files that killed processes have left: nobody holds their locks."""
    # A process that is killed between renaming and the end leaves the lock alone.
    for left in path.parent.glob(f".{glob.escape(path.stem)}.*.partial{path.suffix}*"):
        abandoned = left.with_name(left.name.removesuffix(".lock"))
        beside = Path(f"{abandoned}.lock")
        with suppress(OSError), beside.open("ab") as lock:  # OSError: its writer holds the lock
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            abandoned.unlink(missing_ok=True)
            beside.unlink(missing_ok=True)


def _flush_to_disk(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


# Provenance of a result


LIBRARIES = ("numpy", "scipy", "pyamg")
VERSIONS = ("code_version", *LIBRARIES, "blas")
"""Names of what `provenance` returns."""


def provenance() -> dict[str, str]:
    """Return the versions of the code and of the numerical libraries."""
    return {"code_version": code_version(), **{name: version(name) for name in LIBRARIES}, "blas": blas()}


@cache
def blas() -> str:
    """Return the BLAS and the processor that its kernels are for: kernels for other processors round in other ways."""
    from threadpoolctl import threadpool_info

    loaded = (library for library in threadpool_info() if library["user_api"] == "blas")
    named = (f"{library['internal_api']} {library.get('architecture', '')}".strip() for library in loaded)
    return ", ".join(dict.fromkeys(named)) or "unknown"


def code_version() -> str:
    """Return the package's version, with the commit of the code."""
    return "+".join(filter(None, (knitstudy.__version__, commit())))


@cache
def commit() -> str:
    """Return the commit of the checkout, of a wheel that of its checkout, else an empty text."""
    built, checkout = Path(__file__).with_name("COMMIT"), Path(__file__).resolve().parents[2]
    if built.is_file():
        return built.read_text(encoding="utf-8")
    return commit_of(checkout) if (checkout / ".git").exists() else ""


def commit_of(checkout: Path) -> str:
    """Return the commit of a checkout, with ``-dirty`` if code has changed since; an empty text without git.

    Kept tables and pages are no code: all tables that one run of ``make kept`` writes have one commit.
    """
    git = partial(subprocess.run, cwd=checkout, capture_output=True, text=True, timeout=10, check=True)
    code = ("--", ".", ":!resources", ":!docs")
    try:
        name = git(["git", "describe", "--always", "--abbrev=12"]).stdout.strip()
        changed = git(["git", "status", "--porcelain", "--untracked-files=no", *code]).stdout
    except (OSError, subprocess.SubprocessError):
        return ""
    return f"{name}-dirty" if changed else name


STAMP = ("physics", "commit", "made", "command")
"""Columns of tables in ``resources``: digest of the physics, commit of the code, day, and the command that makes it."""

TEXTS = (*STAMP, "digest", "code")
"""Columns of tables that are read as texts: a hash may have digits alone."""


# Tables as CSV


def write_table(table: pd.DataFrame, path: Path | str, decimal: str = ".", digits: int | None = None) -> None:
    """Write a table as CSV without row numbers; column names carry their units, for example ``force [N]``.

    With decimal commas, semicolons stand between fields. Numbers have all their digits, or so many significant ones.
    """
    rounded = None if digits is None else f"%.{digits}g"
    with replacing(path) as temporary:
        table.to_csv(
            temporary,
            index=False,
            decimal=decimal,
            sep=";" if decimal == "," else ",",
            float_format=rounded,
        )


def seal(path: Path | str, digest: str) -> None:
    """Keep the checksum of a result that is no netCDF file, and its digest, in a hidden file beside it.

    `read_table` refuses a sealed table once it is edited or cut.
    """
    write_text(f"{file_digest(Path(path))} {digest}", _seal_of(path))


def _seal_of(path: Path | str) -> Path:
    return Path(path).with_name(f".{Path(path).name}.sum")


def _sealed(path: Path) -> tuple[str, str]:
    """Return the checksum and the digest in the seal of a file, empty texts where it has none."""
    seal = _seal_of(path)
    checksum, _, digest = seal.read_text(encoding="utf-8").partition(" ") if seal.is_file() else ("", "", "")
    return checksum, digest


def file_digest(path: Path) -> str:
    """Return a digest of the content of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


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
    raise DataFileError(f"{path}: is no text")


def write_text(text: str, path: Path | str) -> None:
    """Write a text whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def read_table(path: Path | str, needs: Iterable[str] = ()) -> pd.DataFrame:
    """Read a CSV table that must have the columns ``needs``.

    Raises DataFileError when the file is missing, is not CSV, or lacks a column, or was changed after it was sealed.
    """
    import pandas as pd

    path = Path(path)
    if path.is_file() and _sealed(path)[0] not in ("", file_digest(path)):
        raise DataFileError(f"{path}: was changed after it was written; delete it and run `make study`")
    try:
        table = pd.read_csv(path, dtype=dict.fromkeys(TEXTS, str))
    except FileNotFoundError as error:
        raise DataFileError(f"{path}: there is no such file; make it with `make study`") from error
    except (OSError, ValueError) as error:
        reason = message_of(error, OSError, ValueError)
        raise DataFileError(
            f"{path}: is not a CSV table ({reason}); delete it and run `make study`"
        ) from error
    missing = [name for name in needs if name not in table.columns]
    if missing:
        there = ", ".join(map(repr, table.columns))
        raise DataFileError(f"{path}: has no column {missing[0]!r}, only {there}")
    return table


# Datasets as netCDF 4, with provenance and a checksum

REMEDY = "delete it and make it again, with `make study` or `knitstudy run`"

COORDINATES = {"strain": "increment"}
"""Variables that are coordinates along a dimension, such as the strain of every increment."""

STRAINS = ("course", "wale", "shear")
"""Strains in the plane of a fabric, by which forces per width and stiffnesses of a cell are ordered."""

FINITE = ("load", "strain", "displacement", "force", "reaction", "energy")
"""Variables of a history that hold a number at every increment."""


def write_dataset(
    dataset: xr.Dataset, path: Path | str, scene: str | None = None, digest: str | None = None
) -> None:
    """Write a dataset in SI units as netCDF 4 with provenance and a checksum of its content.

    The name of the scene and the digest of all that the result depends on are recorded if they are given.
    Raises DataFileError when the file cannot be written.
    """
    named = {} if scene is None else {"scene": scene}
    known = {} if digest is None else {"digest": digest}
    dataset = dataset.assign_attrs(provenance() | named | known)
    dataset = dataset.assign_attrs(checksum=checksum(dataset))
    # Compression at its lowest level: fields shrink by a third or more, writing stays as fast.
    encoding = {
        name: {"zlib": True, "complevel": 1, "shuffle": True}
        for name, variable in dataset.variables.items()
        if variable.dtype.kind in "fiu" and variable.size > 1000
    }
    with replacing(path) as temporary:
        try:
            with uninterrupted():
                dataset.to_netcdf(temporary, format="NETCDF4", engine="netcdf4", encoding=encoding)
        except (OSError, RuntimeError) as error:
            remedy = "make room on the disk, or name another folder"
            raise DataFileError(f"{path}: cannot be written: {error}; {remedy}") from error


def checksum(dataset: xr.Dataset) -> str:
    """Return a checksum of names, dimensions, values and global attributes, the same before and after a file."""
    digest = hashlib.sha256()
    for name in sorted(map(str, dataset.variables)):
        values = np.asarray(dataset.variables[name])
        digest.update(f"{name} {dataset.variables[name].dims} {values.shape}".encode())
        if values.dtype.kind not in "fiub":
            digest.update(str(values.tolist()).encode())
        else:
            digest.update(np.ascontiguousarray(values).data if values.size else b"")
    attributes = ((name, np.atleast_1d(value).tolist()) for name, value in dataset.attrs.items())
    digest.update(str(sorted(attribute for attribute in attributes if attribute[0] != "checksum")).encode())
    return digest.hexdigest()[:16]


def read_dataset(path: Path | str) -> xr.Dataset:
    """Read a netCDF file into memory and close it.

    Raises DataFileError when the file is missing, truncated or no netCDF, or was changed after it was written, and
    HeldOpenError while another program writes to it.
    """
    import xarray as xr

    path = Path(path)
    if path.is_dir():
        raise DataFileError(f"{path}: is a folder; move it away, or name a file in it")
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file; make it with `knitstudy run` or `make study`")
    try:
        with uninterrupted():
            dataset = xr.load_dataset(path, engine="netcdf4")
    except (OSError, RuntimeError, ValueError, KeyError) as error:
        _require_not_held(path)
        raise DataFileError(f"{path}: is truncated or is not netCDF ({error}); {REMEDY}") from error
    if dataset.attrs.get("checksum", "") not in ("", checksum(dataset)):
        raise DataFileError(f"{path}: was changed after it was written; {REMEDY}")
    return with_coordinates(dataset)


def with_coordinates(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset whose variables in `COORDINATES` are coordinates, for ``history.force.plot(x="strain")``.

    Strains in the plane have their names, for ``history.force_per_width.sel(plane="course")``.
    """
    named = [name for name, dim in COORDINATES.items() if name in dataset and dataset[name].dims == (dim,)]
    labels = {
        dim: (dim, list(STRAINS), {"long_name": "strains in the plane, and the forces that go with them"})
        for dim in ("plane", "of_plane")
        if dataset.sizes.get(dim) == len(STRAINS)
    }
    return dataset.set_coords(named).assign_coords(labels)


def read_result(path: Path | str) -> xr.Dataset:
    """Read a dataset that something else is made from; see `read_dataset`.

    Raises DataFileError also where it is a history that ends before full load, or holds values that are no numbers.
    """
    dataset = read_dataset(path)
    if fault := fault_of(dataset):
        raise DataFileError(f"{path}: {fault}; {REMEDY}")
    return dataset


def fault_of(dataset: xr.Dataset) -> str:
    """Return why a dataset cannot be used as a result: a history that is not complete; an empty text where it can."""
    if "incomplete" in dataset.attrs:
        return f"is incomplete ({dataset.attrs['incomplete']})"
    if "load" not in dataset or "increment" not in dataset["load"].dims:
        return ""
    for name in FINITE:
        if name in dataset and not np.isfinite(dataset[name]).all():
            return f"{name} holds a value that is no number"
    last = float(dataset["load"][-1])
    return "" if abs(last - dataset.attrs.get("full_load", 1.0)) < 1e-9 else f"ends at {last:.3g} of the load"


def recorded_digest(path: Path | str, attribute: str = "digest") -> str:
    """Return the digest, or another text, of a result; an empty text where it has none or is marked incomplete.

    Raises DataFileError when a dataset is truncated or no netCDF, and HeldOpenError while another program writes to it.
    """
    if Path(path).suffix != ".nc":
        return _sealed(Path(path))[1]
    import netCDF4

    try:
        with netCDF4.Dataset(path) as file:
            return "" if hasattr(file, "incomplete") else str(getattr(file, attribute, ""))
    except OSError as error:
        _require_not_held(path)
        raise DataFileError(f"{path}: is truncated or is not netCDF ({error})") from error


def _require_not_held(path: Path | str) -> None:
    """Raise HeldOpenError where another program writes to a netCDF file, which HDF5 locks meanwhile."""
    with Path(path).open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise HeldOpenError(
                f"{path}: another program, such as a notebook, holds the file open for writing; close it there"
            ) from error
