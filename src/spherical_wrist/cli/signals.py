"""Ctrl-C and SIGTERM, acted upon once: a command ends in its own time, and loses nothing."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

WATCHED = (signal.SIGINT, signal.SIGTERM)


class Stopped(BaseException):  # not to be taken for an error on its way up
    """A signal has come.

    Attributes:
        number: which.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@contextmanager
def noted() -> Iterator[list[int]]:
    """Notes the first signal in the list that it yields; the next one acts as usual."""
    received: list[int] = []
    with _once(received.append):
        yield received


@contextmanager
def stopping() -> Iterator[None]:
    """The first signal raises :class:`Stopped`; the next one acts as usual."""

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

    def handle(number: int, _: Any) -> None:
        restore()
        act(number)

    for number in WATCHED:
        signal.signal(number, handle)
    try:
        yield
    finally:
        restore()
