"""Progress of commands that take long, on the terminal's error stream."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from spherical_wrist.cli.verbosity import is_quiet, is_verbose

LINE_EVERY, OFTEN = 10.0, 1.0
"""Seconds between lines of progress if there is no terminal for a bar, and with ``-v``."""

Counter = Callable[[int, int], None]
"""Function that takes the number of finished items and the total."""


def shows_bars() -> bool:
    """Return True if the error stream is a terminal, and people look at it."""
    return sys.stderr.isatty() and not is_quiet()


@contextmanager
def waiting(text: str) -> Iterator[None]:
    """Show a text while something of unknown length goes on."""
    if not shows_bars():
        yield
        return
    from spherical_wrist.cli.tables import Terminal

    with Terminal(stderr=True).status(text):
        yield


@contextmanager
def counting(text: str) -> Iterator[Counter]:
    """Show a bar of finished items; nothing without a terminal."""
    if not shows_bars():
        yield lambda done, total: None
        return
    from rich.progress import MofNCompleteColumn

    with _bar(text, MofNCompleteColumn()) as update:
        yield lambda done, total: update(completed=done, total=total)


@contextmanager
def simulating(duration: float) -> Iterator[Callable[[float], None]]:
    """Show a bar of the simulated time [s]."""
    from rich.progress import TextColumn

    with _bar("simulating", TextColumn("{task.completed:.0f} of {task.total:.0f} s"), total=duration) as update:
        yield lambda simulated: update(completed=simulated)


@contextmanager
def counting_episodes() -> Iterator[Counter]:
    """Show the episodes that are done and their rate: as a bar, or as a line now and then without a terminal."""
    if not shows_bars():
        yield (lambda done, size: None) if is_quiet() else _lines()
        return
    from rich.progress import MofNCompleteColumn, TextColumn

    with _bar("episodes", MofNCompleteColumn(), TextColumn("{task.fields[rate]}"), rate="") as update:
        began = time.monotonic()
        already: list[int] = []

        def progress(done: int, size: int) -> None:
            if not already:
                already.append(done)
            elapsed = time.monotonic() - began
            rate = f"{(done - already[0]) / elapsed:.3g}/s" if elapsed > 1.0 else ""
            update(completed=done, total=size, rate=rate)

        yield progress


def _lines() -> Counter:
    began = last = time.monotonic()
    already: int | None = None
    every = OFTEN if is_verbose() else LINE_EVERY

    def progress(done: int, size: int) -> None:
        nonlocal last, already
        already = done if already is None else already
        now = time.monotonic()
        if now - last >= every and done > already:
            last = now
            rate = (done - already) / (now - began)
            left = (size - done) / rate
            print(f"{done:,} of {size:,} episodes, {rate:.3g} a second, {left:.0f} s left", file=sys.stderr, flush=True)

    return progress


@contextmanager
def _bar(text: str, *columns: Any, total: float | None = None, **fields: Any) -> Iterator[Callable[..., None]]:
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    from spherical_wrist.cli.tables import Terminal

    shown = (TextColumn(text, markup=False), BarColumn(), *columns, TimeRemainingColumn())
    with Progress(*shown, console=Terminal(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=total, **fields)
        yield lambda **values: bar.update(task, **values)
