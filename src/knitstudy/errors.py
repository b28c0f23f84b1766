"""Named errors: one message that says what is wrong, where, and what is allowed or to be done."""

from typing import Any


class KnitstudyError(Exception):
    """Base of every error that a user can cause or mend.

    Commands print its message alone, without a traceback, and end with status 1.
    """


def said_by(error: BaseException, *known: type[BaseException]) -> str:
    """Return in one line what an error says, after its kind unless that is one of those of this study or known."""
    kind = "" if isinstance(error, (KnitstudyError, *known)) else f"{type(error).__name__}: "
    return " ".join(f"{kind}{error}".split())


class ConfigurationError(KnitstudyError):
    """A key or a value of a scene, a table or a command that is not allowed."""


class GeometryError(KnitstudyError):
    """Centrelines that cannot be found, or that no yarn of this radius can follow."""


class MeshError(KnitstudyError):
    """A mesh with folded elements, or yarns that overlap."""


class ConvergenceError(KnitstudyError):
    """An iteration that did not reach its tolerance, or a state that a gate refuses.

    Attributes
    ----------
    history : xarray.Dataset or None
        The history up to the last sound increment of a load path, with where and why it ended as attribute
        ``incomplete``.
    """

    history: Any = None


class EndedEarly(ConvergenceError):
    """A load path that ended before full load, and whose history up to there is in a file that the message names."""


class CoarseIncrement(ConvergenceError):
    """An increment that is balanced but too large, for what is summed or for contact; a smaller one may do.

    Attributes
    ----------
    error, unit : float, str
        How deep yarns penetrate each other unseen ("m"), or what it has added to what sums of energy are off by ("J").
    bearable : bool
        Whether the sums are still good enough, if a smaller one adds as much.
    """

    def __init__(self, message: str, error: float, unit: str = "m", bearable: bool = False) -> None:
        super().__init__(message)
        self.error, self.unit, self.bearable = error, unit, bearable


class DataFileError(KnitstudyError):
    """A file that is missing, truncated, or not what its reader expects."""
