"""Amount of output of the command: only warnings, errors and ``--json``, the usual, or every stage of the work."""

import sys
from enum import IntEnum
from typing import Annotated, Any

from typer import Option

from spherical_wrist.errors import ParameterError


class Verbosity(IntEnum):
    """Amount of output."""

    QUIET = 0
    NORMAL = 1
    VERBOSE = 2


Quiet = Annotated[bool, Option("--quiet", "-q", help="print only warnings, errors, and --json")]
Verbose = Annotated[bool, Option("--verbose", "-v", help="print every stage, and how long it takes")]

_level = Verbosity.NORMAL


def begin() -> None:
    """Start with the usual output: several commands may run in one process."""
    global _level  # noqa: PLW0603
    _level = Verbosity.NORMAL


def set_verbosity(*, quiet: bool, verbose: bool) -> None:
    """Take the options of the command, or those before its name.

    Raises:
        ParameterError: both are given.
    """
    global _level  # noqa: PLW0603
    if (quiet or _level == Verbosity.QUIET) and (verbose or _level == Verbosity.VERBOSE):
        raise ParameterError("--quiet and --verbose: give one of them")
    _level = Verbosity.QUIET if quiet else Verbosity.VERBOSE if verbose else _level


def is_quiet() -> bool:
    """Return True if only warnings, errors and JSON are printed."""
    return _level == Verbosity.QUIET


def is_verbose() -> bool:
    """Return True if every stage is printed."""
    return _level == Verbosity.VERBOSE


class StageLog:
    """Output of :mod:`spherical_wrist.stages` on the error stream, while a command runs.

    ``-v`` prints all of it; otherwise a terminal gets the notices of what takes seconds.
    """

    def __enter__(self) -> None:
        """Begin, as far as the verbosity asks for it."""
        self._handler: Any = None
        if _level == Verbosity.VERBOSE or (_level == Verbosity.NORMAL and sys.stderr.isatty()):
            import logging

            from spherical_wrist.stages import LOGGER

            self._handler, self._logger = logging.StreamHandler(sys.stderr), LOGGER
            self._before = LOGGER.level, LOGGER.propagate
            self._handler.setFormatter(logging.Formatter("wrist: %(message)s"))
            LOGGER.addHandler(self._handler)
            LOGGER.setLevel(logging.DEBUG if _level == Verbosity.VERBOSE else logging.INFO)
            LOGGER.propagate = False

    def __exit__(self, *_: object) -> None:
        """Leave the logger as it was."""
        if self._handler is not None:
            self._logger.removeHandler(self._handler)
            self._logger.setLevel(self._before[0])
            self._logger.propagate = self._before[1]
