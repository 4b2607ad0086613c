"""How a run ended."""

from enum import StrEnum
from typing import NamedTuple


class Status(StrEnum):
    """How a run ended, in one word."""

    COMPLETED = "completed"
    DIVERGED = "diverged"
    INTERRUPTED = "interrupted"


class Outcome(NamedTuple):
    """How a run ended.

    Attributes:
        status: in one word.
        time: simulated time at which it ended [s].
        reason: why it ended before its time; empty for a completed run.
    """

    status: Status
    time: float
    reason: str = ""

    def __str__(self) -> str:
        """The outcome as a sentence."""
        return str(self.status) if not self.reason else f"{self.status} at {self.time:.6g} s: {self.reason}"
