"""Datasets as netCDF 4, with provenance; errors name the file and the remedy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import netCDF4
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.files.interruption import uninterrupted
from knitstudy.files.provenance import provenance
from knitstudy.files.replacing import replacing

if TYPE_CHECKING:
    from knitstudy.study.scene import Scene


def write_dataset(
    dataset: xr.Dataset, path: Path | str, scene: Scene | None = None, digest: str | None = None
) -> None:
    """Write a dataset as netCDF 4 with provenance attributes.

    Parameters
    ----------
    dataset
        Data in SI units, each variable with an attribute ``units``.
    path
        Where to; the file appears whole or not at all.
    scene
        When given, its name and hash are recorded.
    digest
        Of all that the result depends on: with the same one it is used again.

    Raises
    ------
    DataFileError
        When the file cannot be written.
    """
    named = {} if scene is None else {"scene": scene.name}
    known = {} if digest is None else {"digest": digest}
    dataset = dataset.assign_attrs(provenance() | named | known)
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
            raise DataFileError(
                f"{path}: cannot be written: {error}; make room on the disk, or name another folder"
            ) from error


def read_dataset(path: Path | str) -> xr.Dataset:
    """Read a netCDF file into memory and close it.

    Parameters
    ----------
    path
        File written by `write_dataset`.

    Raises
    ------
    DataFileError
        When the file is missing, truncated or no netCDF.
    """
    path = Path(path)
    remedy = "delete it and make it again, with `make study` or `knitstudy run`"
    if path.is_dir():
        raise DataFileError(f"{path}: is a folder; move it away, or name a file in it")
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file; make it with `make study`")
    try:
        with uninterrupted():
            return xr.load_dataset(path, engine="netcdf4")
    except (OSError, RuntimeError, ValueError, KeyError) as error:
        raise DataFileError(f"{path}: is truncated or is not netCDF ({error}); {remedy}") from error


def recorded_digest(path: Path | str) -> str:
    """Return the digest that a file was written with; nothing where it has none.

    Raises
    ------
    DataFileError
        When the file is truncated or no netCDF.
    """
    try:
        with netCDF4.Dataset(path) as file:
            return str(getattr(file, "digest", ""))
    except OSError as error:
        raise DataFileError(f"{path}: is truncated or is not netCDF ({error})") from error
