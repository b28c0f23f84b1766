"""Restart files: the last converged increment and the history up to it, so that a killed run goes on."""

from __future__ import annotations

import zipfile
from dataclasses import fields
from pathlib import Path

import numpy as np

from knitstudy.errors import DataFileError
from knitstudy.fem.increment import Increment, Rate
from knitstudy.fem.model import Response
from knitstudy.history import Recorder
from knitstudy.io import replacing


class Checkpoint:
    """A restart file of one scene.

    Parameters
    ----------
    path : Path
        Where it lies; its folder is made when needed.
    key : str
        Hash of everything that determines the result. A file with another key is refused.
    state_type : type
        Dataclass of arrays that the model's state is.
    """

    def __init__(self, path: Path, key: str, state_type: type) -> None:
        self.path, self.key, self.state_type = Path(path), key, state_type

    def save(self, increment: Increment, recorder: Recorder) -> None:
        """Write the file anew, whole or not at all."""
        state = {f"state.{f.name}": getattr(increment.state, f.name) for f in fields(increment.state)}
        rates = {f"rate.{i}": rate.step for i, rate in enumerate(increment.rates)}
        columns = {f"column.{name}": np.array(values) for name, values in recorder.columns.items()}
        scalars = {
            "key": self.key,
            "index": increment.index,
            "load": increment.load,
            "size": increment.size,
            "rate_sizes": np.array([rate.increment for rate in increment.rates]),
            "force": increment.response.force,
            "mean_force": increment.response.mean_force,
        }
        with replacing(self.path) as temporary, open(temporary, "wb") as file:
            np.savez(file, **scalars, **state, **rates, **columns)

    def load(self, recorder: Recorder) -> Increment | None:
        """Return the increment to go on from and fill the recorder, or None if there is no file.

        Raises
        ------
        DataFileError
            If the file is damaged or belongs to another scene.
        """
        if not self.path.exists():
            return None
        try:
            with np.load(self.path, allow_pickle=False) as archive:
                data = dict(archive)
            return self._restore(data, recorder)
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise DataFileError(
                f"{self.path}: this restart file cannot be used ({error}); delete it to start the scene anew"
            ) from None

    def _restore(self, data: dict[str, np.ndarray], recorder: Recorder) -> Increment:
        if str(data["key"]) != self.key:
            raise ValueError("it belongs to another scene or another version of the input")
        for name, values in data.items():
            if name.startswith("column."):
                recorder.columns[name.removeprefix("column.")] = list(values)
        state = {f.name: data[f"state.{f.name}"] for f in fields(self.state_type)}
        rates = (Rate(float(size), data[f"rate.{i}"]) for i, size in enumerate(data["rate_sizes"]))
        return Increment(
            index=int(data["index"]),
            load=float(data["load"]),
            state=self.state_type(**state),
            response=Response(data["force"], float(data["mean_force"])),
            size=float(data["size"]),
            rates=tuple(rates),
        )

    def remove(self) -> None:
        """Delete the file: the scene has ended."""
        self.path.unlink(missing_ok=True)
