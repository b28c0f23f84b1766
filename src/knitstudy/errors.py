"""Named errors with one message: the error, its place, and the allowed values or the remedy."""

from typing import Any


class KnitstudyError(Exception):
    """Base of every error that a user can cause or mend.

    Commands print its message alone, without a traceback, and end with status 1.
    """


def message_of(error: BaseException, *known: type[BaseException]) -> str:
    """Return the message of an error in one line, after its kind unless the kind is of this study or well known."""
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
    """An increment that is balanced but too large for sums over the path or for contact; a smaller one may suffice.

    Attributes
    ----------
    error, unit : float, str
        Depth of penetration that contact did not see ("m"), error that the increment adds to sums of energy ("J"), or
        depth by which yarns overlap ("radii").
    bearable : bool
        Whether the sums are still good enough, if a smaller one adds as much.
    """

    def __init__(self, message: str, error: float, unit: str = "m", bearable: bool = False) -> None:
        super().__init__(message)
        self.error, self.unit, self.bearable = error, unit, bearable


class MissingPackageError(KnitstudyError, ImportError):
    """A package of an extra of knitstudy that is not installed; the message has the command that installs it."""


class HeldOpenError(KnitstudyError):
    """A file that another program holds open for writing."""


class DataFileError(KnitstudyError):
    """A file that is missing, truncated, or of another kind than its reader expects."""


class UnwritableError(DataFileError):
    """A file that cannot be written: the disk is full, or the folder is somebody else's."""


def printable_lines(text: str) -> str:
    """Return a text of several lines, each of which is `printable`: all that comes from outside is printed so."""
    return "\n".join(map(printable, text.split("\n")))


def printable(text: str) -> str:
    """Return a text with its control characters, such as escape sequences of a terminal, written out."""
    return "".join(character if character.isprintable() else ascii(character)[1:-1] for character in text)
