"""A run of the command from its arguments to its exit code: errors become lines, and signals are heard."""

import errno
import signal
import sys
import warnings
from typing import Any

from spherical_wrist.cli.signals import raising, watched
from spherical_wrist.cli.streams import complain, discard, flush_errors, prepare, warned
from spherical_wrist.cli.verbosity import begin
from spherical_wrist.errors import WristError, one_line

INVALID, SIGINT_CODE = 2, 130
NO_THREAD = "can't start new thread"
"""Text of Python's RuntimeError where the system gives it no more threads."""
NO_ROOM = "Could not allocate memory"
"""Text of MuJoCo's error where it cannot make room for a state."""


def run() -> None:
    """Run the command, and end the process with its exit code."""
    with watched():
        code = _exit_code()
    sys.exit(code)


def _exit_code() -> int:
    """Run the command, print a line for an error, and return the exit code."""
    interrupted = _note_interruptions()
    from typer.exceptions import Abort, TyperException

    prepare()
    begin()
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            code = _command()
        sys.stdout.flush()
    except WristError as error:
        code = _refused(str(error))
    except TyperException as error:
        from spherical_wrist.cli.near_misses import explained

        code = _refused(explained(error))
    except (Abort, KeyboardInterrupt):
        code = SIGINT_CODE
    except BrokenPipeError:  # the reader, such as head, has ended
        discard()
        code = 0
    except OSError as error:
        discard()
        code = _refused(_explained(error))
    except MemoryError as error:
        text = f" ({error})" if str(error) else ""
        code = _refused(f"not enough memory{text}: give a shorter duration, or keep less with --record-every")
    except BaseException as error:
        from spherical_wrist.user_file import user_line

        if place := user_line(error):  # whose code may raise anything, SystemExit too
            code = _refused(f"{place}: {type(error).__name__}: {one_line(error)}")
        elif not isinstance(error, Exception):
            raise
        elif interrupted:
            code = SIGINT_CODE  # raised by a module that was being imported
        elif isinstance(error, ImportError | SystemError) or str(error) in (NO_THREAD, NO_ROOM):
            code = _refused(_unloaded(error))
        else:
            raise
    flush_errors()
    return code if isinstance(code, int) else 0


def _note_interruptions() -> list[int]:
    """Record Ctrl-C in the list that is returned: some modules raise another error for it while they are imported."""
    received: list[int] = []

    def interrupt(number: int) -> None:
        received.append(number)
        raise KeyboardInterrupt

    if signal.getsignal(signal.SIGINT) in (signal.SIG_DFL, signal.default_int_handler):
        signal.signal(signal.SIGINT, raising(interrupt))
    return received


def _command() -> Any:
    from spherical_wrist.cli.app import app
    from spherical_wrist.files import inputs_kept

    with inputs_kept():
        return app(standalone_mode=False, prog_name="wrist")


def _explained(error: OSError) -> str:
    """Return the text of an operating-system error that nothing else has explained."""
    if error.filename:
        return f"{error.filename!r}: {error.strerror}"
    if error.errno == errno.ENOENT:  # raised by asking for the working directory
        return "the working directory was deleted: change to one that exists"
    if error.errno is None:  # raised for a shared library that cannot be loaded
        return _unloaded(error)
    return f"the output cannot be written: {error.strerror or error}"


def _unloaded(error: BaseException) -> str:
    """Return the text of an error of a library, or of Python itself, that lacks memory or a part of it."""
    while error.__cause__ is not None:
        error = error.__cause__
    return f"{one_line(error, 120)} (is memory limited, or the installation damaged?)"


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    """Print the warning of a library in one line, without the place in its code."""
    warned(str(message))


def _refused(text: str) -> int:
    complain(text)
    return INVALID
