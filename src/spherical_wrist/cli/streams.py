"""Standard streams of the command, prepared for its output whatever they are connected to."""

import os
import sys
from contextlib import suppress

from spherical_wrist.cli.verbosity import is_quiet
from spherical_wrist.plain_text import visible


def prepare() -> None:
    """Connect closed streams to the null device, and let others print ``?`` for letters that they do not have.

    The number of a closed stream would otherwise go to the next file that is opened, and with it everything that a
    library prints.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))
        elif name == "stdout" and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


def complain(text: str, kind: str = "error") -> None:
    """Print one line on the error stream, if anybody reads it."""
    with suppress(OSError, ValueError):
        print(visible(f"wrist: {kind}: {' '.join(text.split())}"), file=sys.stderr)
    flush_errors()


def warned(text: str) -> None:
    """Print a warning in one line on the error stream, with ``--quiet`` too."""
    complain(text, "warning")


def say(text: object) -> None:
    """Print a line for people on the standard output; nothing with ``--quiet``."""
    if not is_quiet():
        print(visible(str(text)), flush=True)


def flush_errors() -> None:
    """Flush the error stream, and drop text that cannot be written, for which Python would end with exit code 120."""
    try:
        sys.stderr.flush()
    except (OSError, ValueError):
        discard("stderr")


def discard(name: str = "stdout") -> None:
    """Send the buffered text of a stream to the null device, since Python would try to write it again at its end."""
    with suppress(OSError, ValueError):
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, getattr(sys, name).fileno())
        os.close(sink)


def speaks_unicode() -> bool:
    """Return True if every letter can be printed."""
    return (sys.stdout.encoding or "").lower().replace("-", "") in ("utf8", "utf16", "utf32")
