"""The standard streams of the command, made fit for what it prints, whatever they are connected to."""

import os
import sys
from contextlib import suppress


def prepare() -> None:
    """Lets the streams take everything: closed ones nothing at all, others a ``?`` for a letter that they do not have.

    A closed stream's number goes to the null device. Otherwise the next file that is opened would get it, and with it
    whatever a library prints.
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
    """One line on the error stream, if there is anybody to read it."""
    with suppress(OSError, ValueError):
        print(f"wrist: {kind}: {' '.join(text.split())}", file=sys.stderr, flush=True)


def discard() -> None:
    """Lets what is still to be printed go nowhere: at its end Python would try again to print it, and complain."""
    with suppress(OSError, ValueError):
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, sys.stdout.fileno())
        os.close(sink)


def speaks_unicode() -> bool:
    """Whether every letter can be printed."""
    return (sys.stdout.encoding or "").lower().replace("-", "") in ("utf8", "utf16", "utf32")
