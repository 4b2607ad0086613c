"""Handling of Ctrl-C and SIGTERM: a command ends after it has saved its results, or at once where it does not hear.

Python runs a handler between two steps of its main thread. A model that MuJoCo parses, or a law that never ends, keeps
that thread for as long as it likes. So another thread watches: where a signal is not heard soon, it ends the process.
"""

import _thread
import os
import signal
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

from spherical_wrist.errors import Interruption

DEAF = {"__del__", "_raw_object_cache_notify"}
"""Functions from which no exception propagates: Python prints it and continues. LLVM calls the second one while it
compiles, which takes seconds the first time."""

AGAIN = 0.02
"""Time [s] after which a signal that arrives there is sent again."""

PATIENCE = 1.5
"""Time [s] in which a command must hear a signal; then it is ended."""

WATCHED = (signal.SIGINT, signal.SIGTERM)


class Stopped(Interruption):
    """Signal that stops a command.

    Attributes:
        number: number of the signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class Watch:
    """Thread that ends the process where a signal is not heard."""

    def __init__(self) -> None:
        self._read, self._write = os.pipe()
        for end in (self._read, self._write):
            os.set_blocking(end, end == self._read)
        self._before = signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)
        self._heard = threading.Event()
        self.farewell = ""
        threading.Thread(target=self._watch, name="signals", daemon=True).start()

    def _watch(self) -> None:
        while number := os.read(self._read, 1)[0]:
            if number in WATCHED and not self._heard.wait(PATIENCE):
                self._end(number)
            self._heard.clear()
        os.close(self._read)

    def _end(self, number: int) -> None:
        cursor = b"\x1b[?25h" if os.isatty(2) else b""  # which a progress bar has hidden
        text = self.farewell or "wrist: error: stopped at once, since it did not end by itself"
        with suppress(OSError):
            os.write(2, cursor + f"{text}\n".encode(errors="replace"))
        if "multiprocessing" in sys.modules:
            for child in sys.modules["multiprocessing"].active_children():  # workers, which end with it, but later
                child.kill()
        os._exit(128 + number)

    def heard(self) -> None:
        """Let the command take its time from here on: it has heard the signal, and saves its results."""
        os.set_blocking(self._read, False)
        with suppress(BlockingIOError):
            while os.read(self._read, 64):  # the same signal, sent again while it could not be handled
                pass
        os.set_blocking(self._read, True)
        self._heard.set()

    def close(self) -> None:
        """Watch no longer."""
        signal.set_wakeup_fd(self._before, warn_on_full_buffer=False)
        self._heard.set()
        os.write(self._write, bytes(1))
        os.close(self._write)


_watch: Watch | None = None


@contextmanager
def watched() -> Iterator[None]:
    """End the process within two seconds of a signal in this context, unless the command says that it has heard it."""
    global _watch  # noqa: PLW0603
    if threading.current_thread() is not threading.main_thread() or _watch is not None:
        yield
        return
    _watch = Watch()
    try:
        yield
    finally:
        _watch.close()
        _watch = None


def heard() -> None:
    """Say that the command has heard a signal, and saves its results; see :func:`watched`."""
    if _watch is not None:
        _watch.heard()


def farewell(text: str) -> None:
    """Set the line that is printed where the command is ended since it does not end by itself."""
    if _watch is not None:
        _watch.farewell = text


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
