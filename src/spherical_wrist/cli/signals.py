"""Handling of Ctrl-C and SIGTERM: a command ends after it has saved its results."""

import _thread
import signal
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

DEAF = {"__del__", "_raw_object_cache_notify"}
"""Functions from which no exception propagates: Python prints it and continues. LLVM calls the second one while it
compiles, which takes seconds the first time."""

AGAIN = 0.02
"""Time [s] after which a signal that arrives there is sent again."""

WATCHED = (signal.SIGINT, signal.SIGTERM)


class Stopped(BaseException):  # no Exception, so that no handler of errors catches it
    """Signal that stops a command.

    Attributes:
        number: number of the signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def raising(act: Callable[[int], None]) -> Callable[[int, FrameType | None], Any]:
    """Create a signal handler that acts where an exception propagates; elsewhere it sends the signal again later."""

    def handle(number: int, frame: FrameType | None) -> None:
        if _deaf(frame):
            # threading's own locks may be held by the interrupted code
            _thread.start_new_thread(_send_again, (number,))
        else:
            act(number)

    return handle


def _deaf(frame: FrameType | None) -> bool:
    while frame is not None:
        code = frame.f_code
        if code.co_name in DEAF or code.co_filename == weakref.__file__:
            return True
        frame = frame.f_back
    return False


def _send_again(number: int) -> None:
    time.sleep(AGAIN)
    signal.pthread_kill(threading.main_thread().ident or 0, number)


@contextmanager
def noted() -> Iterator[list[int]]:
    """Record the first signal in the list that is yielded; the next one acts as usual."""
    received: list[int] = []
    with _once(received.append):
        yield received


@contextmanager
def stopping() -> Iterator[None]:
    """Raise :class:`Stopped` at the first signal; the next one acts as usual."""

    def stop(number: int) -> None:
        raise Stopped(number)

    with _once(stop):
        yield


@contextmanager
def _once(act: Callable[[int], None]) -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in WATCHED}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def once(number: int) -> None:
        restore()
        act(number)

    for number in WATCHED:
        signal.signal(number, raising(once))
    try:
        yield
    finally:
        restore()
