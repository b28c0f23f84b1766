"""Results as files: tables, and datasets with the versions that made them and a checksum."""

from __future__ import annotations

import fcntl
import hashlib
import os
import subprocess
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import knitstudy
from knitstudy.errors import DataFileError, HeldOpenError, UnwritableError, message_of
from knitstudy.files import replacing, write_text
from knitstudy.interruption import uninterrupted

if TYPE_CHECKING:  # where they are needed, functions import them: the command starts in half the time
    import pandas as pd
    import xarray as xr

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
    built = Path(__file__).with_name("COMMIT")
    checkout = Path(__file__).resolve().parents[2]
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


TEXTS = ("behaviour", "code", "commit", "digest")
"""Columns of tables that are read as texts: a hash may have digits alone."""


# Checksums: one of the bytes of every result, read before anything else of it is

REMEDY = "delete it and make it again, with `make study` or `knitstudy run`"

MARK = b"\nchecksum of knitstudy: "
"""Bytes between the content of a netCDF file and its checksum, which stands behind the end that HDF5 knows."""

LENGTH = 16  # characters of a checksum


def seal(path: Path | str, digest: str) -> None:
    """Keep the checksum of a result that is no netCDF file, and its digest, in a hidden file beside it."""
    write_text(f"{file_digest(Path(path))} {digest}", _seal_of(path))


def _seal_of(path: Path | str) -> Path:
    return Path(path).with_name(f".{Path(path).name}.sum")


def _sealed(path: Path) -> tuple[str, str]:
    """Return the checksum and the digest in the seal of a file, empty texts where it has none."""
    seal = _seal_of(path)
    text = seal.read_text(encoding="utf-8", errors="replace") if seal.is_file() else ""
    checksum, _, digest = text.partition(" ")
    return checksum, digest


def file_digest(path: Path, size: int | None = None) -> str:
    """Return a digest of the content of a file, or of its first bytes."""
    digest = hashlib.sha256()
    left = path.stat().st_size if size is None else size
    with path.open("rb") as file:
        while left > 0 and (part := file.read(min(left, 1 << 20))):
            digest.update(part)
            left -= len(part)
    return digest.hexdigest()[:LENGTH]


def require_unchanged(path: Path) -> None:
    """Refuse a result that was changed after it was written.

    That is a netCDF file with no checksum or another one, and a file of another kind beside a seal with another one.
    It is asked first of all: a library that reads a damaged file may end the process. Raises DataFileError, and
    HeldOpenError while another program writes to a netCDF file.
    """
    try:
        recorded, actual = _checksums(path)
    except OSError as error:
        reason = error.strerror or error
        raise DataFileError(f"{path}: cannot be read ({reason})") from error
    if recorded != actual:
        raise DataFileError(f"{path}: was changed after it was written; {REMEDY}")


def _checksums(path: Path) -> tuple[str, str]:
    """Return the checksum that a result has with it, and that of its bytes; the latter twice where none is needed."""
    if path.suffix != ".nc":
        actual = file_digest(path)
        return _sealed(path)[0] or actual, actual
    _require_not_held(path)
    size = path.stat().st_size - len(MARK) - LENGTH
    with path.open("rb") as file:
        file.seek(max(size, 0))
        mark = file.read(len(MARK))
        recorded = file.read().decode("ascii", errors="replace")
    if mark != MARK:
        why = "it was cut, changed or opened for writing, or is not a file of this version of knitstudy"
        raise DataFileError(f"{path}: does not end with a checksum: {why}; {REMEDY}")
    return recorded, file_digest(path, size)


def recorded_digest(path: Path | str, attribute: str = "digest") -> str:
    """Return the digest of a result of any kind, or another text of a netCDF file, whose content is unchanged.

    The text is empty where the result has none or is marked incomplete: it counts as missing.
    Raises the errors of `require_unchanged`, and DataFileError where the file is missing or no netCDF.
    """
    path = Path(path)
    if not path.is_file():  # a library would wait for the writer of a pipe
        raise DataFileError(f"{path}: there is no such file")
    require_unchanged(path)
    if path.suffix != ".nc":
        return _sealed(path)[1]
    import netCDF4

    _prepare_locking(path.parent)
    with _naming(path), netCDF4.Dataset(path) as file:
        return "" if hasattr(file, "incomplete") else str(getattr(file, attribute, ""))


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Name the file in whatever a library raises that reads it."""
    try:
        yield
    except Exception as error:
        reason = message_of(error, OSError, RuntimeError, ValueError)
        raise DataFileError(f"{path}: is not netCDF ({reason}); {REMEDY}") from error


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


def read_table(path: Path | str, needs: Iterable[str] = ()) -> pd.DataFrame:
    """Read a CSV table that must have the columns ``needs``.

    Raises DataFileError when the file is missing, is not CSV, or lacks a column, or was changed after it was sealed.
    """
    import pandas as pd

    path = Path(path)
    if path.is_file():
        require_unchanged(path)
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


# Datasets as netCDF 4, with provenance

COORDINATES = {"strain": "increment"}
"""Variables that are coordinates along a dimension, such as the strain of every increment."""

STRAINS = ("course", "wale", "shear")
"""Strains in the plane of a fabric, by which forces per width and stiffnesses of a cell are ordered."""

FINITE = ("load", "strain", "displacement", "force", "reaction", "energy")
"""Variables of a history that hold a number at every increment."""


def write_dataset(
    dataset: xr.Dataset, path: Path | str, scene: str | None = None, digest: str | None = None
) -> None:
    """Write a dataset in SI units as netCDF 4 with provenance, and a checksum behind its end.

    The name of the scene and the digest of all that the result depends on are recorded if they are given.
    Raises DataFileError when the file cannot be written.
    """
    named = {} if scene is None else {"scene": scene}
    known = {} if digest is None else {"digest": digest}
    dataset = dataset.assign_attrs(provenance() | named | known)
    # Compression at its lowest level: fields shrink by a third or more, writing stays as fast.
    encoding = {
        name: {"zlib": True, "complevel": 1, "shuffle": True}
        for name, variable in dataset.variables.items()
        if variable.dtype.kind in "fiu" and variable.size > 1000
    }
    with replacing(path) as temporary:
        _prepare_locking(temporary.parent)
        try:
            with uninterrupted():
                dataset.to_netcdf(temporary, format="NETCDF4", engine="netcdf4", encoding=encoding)
            with temporary.open("ab") as file:
                file.write(MARK + file_digest(temporary).encode())
        except (OSError, RuntimeError) as error:
            remedy = "make room on the disk, or name another folder"
            raise UnwritableError(f"{path}: cannot be written: {error}; {remedy}") from error


def read_dataset(path: Path | str) -> xr.Dataset:
    """Read a netCDF file into memory and close it.

    Raises DataFileError when the file is missing, truncated or no netCDF, was changed after it was written, or is a
    history with values that are no numbers, and HeldOpenError while another program writes to it.
    """
    import xarray as xr

    path = Path(path)
    if path.is_dir():
        raise DataFileError(f"{path}: is a folder; move it away, or name a file in it")
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file; make it with `knitstudy run` or `make study`")
    require_unchanged(path)
    _prepare_locking(path.parent)
    with _naming(path), uninterrupted():
        dataset = xr.load_dataset(path, engine="netcdf4")
    if fault := _no_numbers(dataset):
        raise DataFileError(f"{path}: {fault}; {REMEDY}")
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
    if not _is_history(dataset):
        return ""
    if fault := _no_numbers(dataset):
        return fault
    last = float(dataset["load"][-1])
    return "" if abs(last - dataset.attrs.get("full_load", 1.0)) < 1e-9 else f"ends at {last:.3g} of the load"


def _is_history(dataset: xr.Dataset) -> bool:
    return "load" in dataset and "increment" in dataset["load"].dims


def _no_numbers(dataset: xr.Dataset) -> str:
    """Return which variable of a history holds values that are no numbers; an empty text where none does."""
    for name in FINITE if _is_history(dataset) else ():
        if name in dataset and not np.isfinite(dataset[name]).all():
            return f"{name} holds a value that is not a number"
    return ""


def _prepare_locking(folder: Path) -> None:
    """Have HDF5 lock no files where a folder's file system has no locks, which it would call a refused permission.

    HDF5 asks once, when the first file of a process is opened.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:  # a folder whose files alone may be read
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        pass
    except OSError:
        os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")
    finally:
        os.close(descriptor)


def _require_not_held(path: Path | str) -> None:
    """Raise HeldOpenError where another program writes to a netCDF file, which HDF5 locks meanwhile."""
    with Path(path).open("rb") as file, suppress(OSError):  # a file system without locks
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise HeldOpenError(
                f"{path}: another program, such as a notebook, holds the file open for writing; close it there"
            ) from error
