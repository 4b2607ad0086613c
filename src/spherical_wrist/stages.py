"""Log of the stages of a run and their durations, as ``wrist -v`` prints it.

Messages go to Python's logger ``spherical_wrist``: notices of what takes seconds at level INFO, everything else at
level DEBUG.
"""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager

LOGGER = logging.getLogger("spherical_wrist")


def notice(text: str) -> None:
    """Log the beginning of something that takes seconds."""
    LOGGER.info(text)


def detail(text: str) -> None:
    """Log a finished step."""
    LOGGER.debug(text)


@contextmanager
def stage(text: str) -> Iterator[None]:
    """Log a text with the duration of the block, once it has ended without an error."""
    if not LOGGER.isEnabledFor(logging.DEBUG):
        yield
        return
    began = time.perf_counter()
    yield
    LOGGER.debug("%s: %.3g s", text, time.perf_counter() - began)
