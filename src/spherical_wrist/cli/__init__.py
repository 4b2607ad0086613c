"""The command line ``wrist``. It holds no physics and no mathematics, and imports the rest only when it is used."""

import errno
import signal
import sys
import warnings
from typing import Any

from spherical_wrist.cli.signals import raising
from spherical_wrist.cli.streams import complain, discard, prepare
from spherical_wrist.errors import WristError

INVALID, SIGINT_CODE = 2, 130


def main() -> None:
    """Runs ``wrist``. Exit codes: 0 completed, 1 diverged, 2 wrong input, 128 + n stopped by signal n."""
    from typer.exceptions import Abort, TyperException

    prepare()
    interrupted = _note_interruptions()
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            code = _command()
        sys.stdout.flush()
    except WristError as error:
        code = _refused(str(error))
    except TyperException as error:
        # typer's own words for a wrong option, in our one line
        text = error.format_message() if hasattr(error, "format_message") else str(error)
        code = _refused(f"{text.strip()} (see wrist --help)")
    except (Abort, KeyboardInterrupt):
        code = SIGINT_CODE
    except BrokenPipeError:  # whoever reads it has seen enough
        discard()
        code = 0
    except OSError as error:
        discard()
        code = _refused(_explained(error))
    except MemoryError as error:
        code = _refused(f"not enough memory ({error}): give a shorter duration, or keep less with --record-every")
    except Exception:
        if not interrupted:
            raise
        code = SIGINT_CODE  # that of a module which was just being imported
    sys.exit(code if isinstance(code, int) else 0)


def _note_interruptions() -> list[int]:
    """Notes Ctrl-C in the list that it returns: some modules make another error of it while they are imported."""
    received: list[int] = []

    def interrupt(number: int) -> None:
        received.append(number)
        raise KeyboardInterrupt

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, raising(interrupt))
    return received


def _command() -> Any:
    from spherical_wrist.cli import (  # noqa: F401 their commands join those of app
        campaign_commands,
        guide_commands,
        inspect_commands,
        render_commands,
        replay_commands,
        report_commands,
        study_commands,
        tuning_commands,
        view_commands,
    )
    from spherical_wrist.cli.app import app

    return app(standalone_mode=False)


def _explained(error: OSError) -> str:
    """An error of the system that nobody else has put into words."""
    if error.filename:
        return f"{error.filename!r}: {error.strerror}"
    if error.errno == errno.ENOENT:  # what asking for it says
        return "the working directory was deleted: change to one that exists"
    return f"the output cannot be written: {error.strerror or error}"


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    """What a library warns of, in one line without the place in its code."""
    complain(str(message), "warning")


def _refused(text: str) -> int:
    complain(text)
    return INVALID
