"""Exceptions, whose messages name the given value, the valid ones and a remedy.

Every error that the package raises on purpose is a :class:`WristError` with a message of one line. A run that diverges
is not an error but an outcome.
"""

from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches


class WristError(Exception):
    """Base of every error that the package raises on purpose."""


class ParameterError(WristError):
    """Invalid parameter, name or experiment."""


class ModelError(WristError):
    """MJCF file that is not a wrist."""


class LawError(WristError):
    """Control law that cannot be loaded or compiled, or does not return a torque."""


class RecordingError(WristError):
    """Recording that cannot be written or read."""


class ViewerError(WristError):
    """Viewer that cannot be opened or reached, or does not show a recording."""


class Interruption(BaseException):
    """Base of interruptions from outside, such as a signal: no handler of errors catches them."""


def as_exception(error: BaseException) -> Exception:
    """Return an error raised by a user's code as an ``Exception``, since it may be any, such as SystemExit.

    Raises:
        BaseException: the same again, where it came from outside.
    """
    if isinstance(error, Exception):
        return error
    if isinstance(error, KeyboardInterrupt | Interruption):
        raise error
    return WristError(f"a Python file raised {type(error).__name__}: {one_line(error)}")


class UnknownNameError(ParameterError):
    """Name that is not among the valid ones.

    Args:
        kind: kind of thing that is named, such as ``"law"``.
        given: name as it was given.
        valid: valid names.
        advice: text appended to the message.
        most: largest number of valid names that are listed; None for all.
    """

    def __init__(
        self, kind: str, given: object, valid: Iterable[str], advice: str = "", *, most: int | None = None
    ) -> None:
        names = sorted(valid)
        near = get_close_matches(str(given), names, n=1, cutoff=0.5)
        guess = f"; did you mean {near[0]!r}?" if near else ""
        shown = ", ".join(names) if most is None or len(names) <= most else listed(names, most)
        super().__init__(f"unknown {kind} {str(given)!r}{guess} (valid: {shown}){advice}")


MOST_BITS = 1024
"""Largest integers that are read from a file or a command line; no floating-point number is larger."""


def refuse_huge_integers(value: object, name: str = "") -> None:
    """Refuse integers that no number of an experiment can be, and that Python does not even print.

    Args:
        value: plain data.
        name: dotted name of the value.

    Raises:
        ParameterError: there is one; the message has its name.
    """
    if isinstance(value, int) and value.bit_length() > MOST_BITS:
        raise ParameterError(f"{name}: an integer of {value.bit_length()} bits is too large")
    inner = value.items() if isinstance(value, Mapping) else enumerate(value) if isinstance(value, list | tuple) else ()
    for key, each in inner:
        refuse_huge_integers(each, f"{name}.{key}".lstrip("."))


def one_line(error: object, limit: int = 300) -> str:
    """Return the text of an error, or of anything, in one line of at most ``limit`` characters."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= limit else text[: limit - 1] + "…"


def listed(names: Sequence[str], most: int = 6) -> str:
    """Return names as in a sentence, "a, b and c"; of a long list only the first ones and the number of the others."""
    kept = list(names) if len(names) <= most else [*names[: most - 1], f"{len(names) - most + 1} more"]
    return kept[0] if len(kept) == 1 else f"{', '.join(kept[:-1])} and {kept[-1]}"
