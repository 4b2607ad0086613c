"""What can go wrong, as exceptions a person can act on.

Every error that the package raises on purpose is a :class:`WristError`: one line that says what was given, what is
valid and what to do. A run that diverges is not an error but an outcome.
"""

from collections.abc import Iterable
from difflib import get_close_matches


class WristError(Exception):
    """Base of every error that the package raises on purpose."""


class ParameterError(WristError):
    """A parameter, a name or a whole experiment is not valid."""


class ModelError(WristError):
    """An MJCF file cannot serve as a wrist."""


class LawError(WristError):
    """A control law cannot be loaded, cannot be compiled, or does not return a torque."""


class RecordingError(WristError):
    """A recording cannot be written or read."""


class ViewerError(WristError):
    """A viewer cannot be opened, reached, or does not show a recording."""


class UnknownNameError(ParameterError):
    """A name that is not among the valid ones.

    Args:
        kind: what the name stands for, such as ``"law"``.
        given: the name as it was given.
        valid: the names that would have been valid.
        advice: what to do, appended to the message.
    """

    def __init__(self, kind: str, given: object, valid: Iterable[str], advice: str = "") -> None:
        names = sorted(valid)
        near = get_close_matches(str(given), names, n=1, cutoff=0.5)
        guess = f"; did you mean {near[0]!r}?" if near else ""
        super().__init__(f"unknown {kind} {str(given)!r}{guess} (valid: {', '.join(names)}){advice}")


def one_line(error: object, limit: int = 300) -> str:
    """The text of an error, or of anything, in one line of at most ``limit`` characters, for use in a message."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= limit else text[: limit - 1] + "…"
