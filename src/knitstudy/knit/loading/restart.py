"""The restart file of a run: the last converged increment and the history up to it, read and written."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from knitstudy.errors import DataFileError
from knitstudy.files import replacing
from knitstudy.knit.loading.history import Recorder
from knitstudy.mechanics.arrays import Floats
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.model import Response

KEPT = ("index", "load", "size", "largest", "damped", "headway", "rates", "updates")
"""Fields of an increment from which a run goes on, besides its state and its forces."""

_LEAVES = (np.ndarray, np.generic, bool, int, float, str)
_SCALARS = (bool, int, float, str)
# Columns that gates and tables judge
_JUDGED = tuple(f"column.{name}" for name in ("load", "strain", "force", "reaction", "energy"))


@dataclass(frozen=True)
class Checkpoint:
    """A restart file of one scene: the last converged increment and the history up to it."""

    path: Path  # its folder is made when needed
    key: str  # hash of everything that determines the result; a file with another key is refused
    # Of the model's state: a dataclass of arrays, numbers, texts, None, tuples of these, and such dataclasses
    state_type: type

    def save(self, increment: Increment, recorder: Recorder) -> None:
        """Write the file anew, whole or not at all.

        Raises TypeError if the state holds something that a restart file cannot keep.
        """
        response = increment.response
        data: dict[str, Any] = {"key": self.key, "force": response.force, "mean_force": response.mean_force}
        for name in ("state", *KEPT):
            data |= _arrays(getattr(increment, name), name)
        data |= {f"column.{name}": np.array(values) for name, values in recorder.columns.items()}
        for name, parts in recorder.flat.items():
            data |= {
                f"flat.{name}": np.concatenate(parts),
                "flat_ends": np.cumsum([len(part) for part in parts]),
            }
        data |= {f"meter.{name}": value for name, value in recorder.meter.read().items()}
        with replacing(self.path) as temporary, open(temporary, "wb") as file:
            np.savez(file, allow_pickle=False, **data)

    def load(self, recorder: Recorder) -> Increment | None:
        """Return the increment to go on from and fill the recorder; None if there is no file.

        Another run of the same scene that has come to its end may delete the file at any moment.
        Raises DataFileError if the file is damaged or belongs to another scene.
        """
        try:
            with np.load(self.path, allow_pickle=False) as archive:
                data = dict(archive)
            return self._restore(data, recorder)
        except FileNotFoundError:
            return None
        except Exception as error:  # readers of damaged archives raise nearly anything
            raise DataFileError(
                f"{self.path}: this restart file cannot be used ({error or type(error).__name__}); delete it to start "
                "the scene anew"
            ) from None

    def _restore(self, data: dict[str, Floats], recorder: Recorder) -> Increment:
        if str(data["key"]) != self.key:
            raise ValueError("it belongs to another scene or another version of the input")
        _require_whole(data)
        for name, values in data.items():
            if name.startswith("column."):
                recorder.columns[name.removeprefix("column.")] = list(values)
            if name.startswith("flat."):
                recorder.flat[name.removeprefix("flat.")] = np.split(values, data["flat_ends"][:-1])
        recorder.meter.go_on(
            {name.removeprefix("meter."): data[name].item() for name in data if name.startswith("meter.")}
        )
        hints = get_type_hints(Increment)
        return Increment(
            state=_value(self.state_type, data, "state"),
            response=Response(data["force"], float(data["mean_force"])),
            **{name: _value(hints[name], data, name) for name in KEPT},
        )


_NUMBERS = ("state.", "rates", "updates", "force", "mean_force", "load", "size", "largest", "damped")


def _require_whole(data: dict[str, Floats]) -> None:
    """Refuse values that are not numbers, and arrays whose lengths do not fit; gaps may be infinite or nan."""
    increments = int(data["index"]) + 1
    for name, values in data.items():
        judged = name.startswith((*_NUMBERS, *_JUDGED)) and not name.endswith("gap")
        if judged and values.dtype.kind == "f" and np.isnan(values).any():
            raise ValueError(f"{name} holds values that are not numbers")
        if name.startswith(("rates", "force")) and values.dtype.kind not in "iuf":
            raise ValueError(f"{name} holds {values.dtype} and must hold numbers")
        if name.startswith("column.") and len(values) != increments:
            raise ValueError(f"{name} has {len(values)} increments and must have {increments}")
        if name.startswith("rates.") and name.endswith(".step") and values.shape != data["force"].shape:
            raise ValueError(f"{name} has the shape {values.shape} and must have {data['force'].shape}")
    if not 0 <= float(data["load"]) <= 1:
        raise ValueError(f"load is {float(data['load'])} and must lie between 0 and 1")


def _arrays(value: Any, name: str) -> dict[str, Floats]:
    """Return all arrays, numbers and texts in a value by dotted names; None is left out."""
    if value is None:
        return {}
    if is_dataclass(value):
        parts = [_arrays(getattr(value, field.name), f"{name}.{field.name}") for field in fields(value)]
    elif isinstance(value, tuple):
        parts = [{f"{name}.length": np.asarray(len(value))}]
        parts += [_arrays(item, f"{name}.{i}") for i, item in enumerate(value)]
    elif isinstance(value, _LEAVES) and np.asarray(value).dtype != object:
        return {name: np.asarray(value)}
    else:
        raise TypeError(f"{name} is a {type(value).__name__}, which a restart file cannot keep")
    return {key: array for part in parts for key, array in part.items()}


def _value(hint: Any, data: dict[str, Floats], name: str) -> Any:
    """Return the value of a type that `_arrays` took apart."""
    if get_origin(hint) in (Union, UnionType):
        if not any(entry == name or entry.startswith(f"{name}.") for entry in data):
            return None
        hint = next(part for part in get_args(hint) if part is not type(None))
    if isinstance(hint, type) and is_dataclass(hint):
        hints = get_type_hints(hint)
        return hint(
            **{field.name: _value(hints[field.name], data, f"{name}.{field.name}") for field in fields(hint)}
        )
    if get_origin(hint) is tuple:
        count, kinds = int(data[f"{name}.length"]), get_args(hint)
        of_items = kinds[:1] * count if kinds[-1] is Ellipsis else kinds[:count]
        return tuple(_value(kind, data, f"{name}.{i}") for i, kind in enumerate(of_items))
    return hint(data[name]) if hint in _SCALARS else data[name]
