"""Log of the stages of a run and their durations, as ``wrist -v`` prints it.

Messages go to Python's logger ``spherical_wrist``: notices of what takes seconds at level INFO, everything else at
level DEBUG.
"""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

LOGGER = logging.getLogger("spherical_wrist")
LONG = 0.5
"""Duration from which a stage within one of many runs is logged [s]."""
_among_many: ContextVar[bool] = ContextVar("among_many", default=False)


def notice(text: str) -> None:
    """Log the beginning of something that takes seconds."""
    LOGGER.info(text)


def detail(text: str) -> None:
    """Log a finished step; not within one of many runs."""
    if not _among_many.get():
        LOGGER.debug(text)


@contextmanager
def stage(text: str) -> Iterator[None]:
    """Log a text with the duration of the block, once it has ended without an error.

    Within one of many runs, short stages are left out.
    """
    if not LOGGER.isEnabledFor(logging.DEBUG):
        yield
        return
    began = time.perf_counter()
    yield
    duration = time.perf_counter() - began
    if duration >= LONG or not _among_many.get():
        LOGGER.debug("%s: %.3g s", text, duration)


@contextmanager
def one_of_many(text: str = "") -> Iterator[None]:
    """Log a run of many in one line with its duration; without a text, in none."""
    began, token = time.perf_counter(), _among_many.set(True)
    try:
        yield
    finally:
        _among_many.reset(token)
    if text:
        detail(f"{text}: {time.perf_counter() - began:.3g} s")
