"""How a sweep shows where it is."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console

from spherical_wrist.campaign.sweep import Listener

LINE_EVERY = 10.0
"""Seconds between lines of progress where there is no terminal for a bar."""


def warn(text: str) -> None:
    """Prints a line about something that does not stop the sweep."""
    print(f"wrist: warning: {text}", file=sys.stderr)


@contextmanager
def listening(quiet: bool) -> Iterator[Listener]:
    """A bar on a terminal, lines now and then elsewhere, nothing but warnings where it is to be quiet."""
    if quiet:
        yield Listener(warn=warn)
    elif not sys.stderr.isatty():
        yield Listener(_lines(), warn)
    else:
        with _bar() as progress:
            yield Listener(progress, warn)


def _lines() -> Callable[[int, int], None]:
    began = last = time.monotonic()
    already: int | None = None

    def progress(done: int, size: int) -> None:
        nonlocal last, already
        already = done if already is None else already
        now = time.monotonic()
        if now - last >= LINE_EVERY and done > already:
            last = now
            rate = (done - already) / (now - began)
            left = (size - done) / rate
            print(f"{done:,} of {size:,} episodes, {rate:.3g} a second, {left:.0f} s left", file=sys.stderr, flush=True)

    return progress


@contextmanager
def _bar() -> Iterator[Callable[[int, int], None]]:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("episodes"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task, began = bar.add_task("", total=None, rate=""), time.monotonic()
        already: list[int] = []

        def progress(done: int, size: int) -> None:
            if not already:
                already.append(done)
            elapsed = time.monotonic() - began
            rate = f"{(done - already[0]) / elapsed:.3g}/s" if elapsed > 1.0 else ""
            bar.update(task, completed=done, total=size, rate=rate)

        yield progress
