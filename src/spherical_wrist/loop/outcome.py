"""Outcome of a run."""

from enum import StrEnum
from typing import NamedTuple


class Status(StrEnum):
    """Status of a run that has ended.

    A run has failed where its law, after some time, raised an exception or wrote a torque that is not finite, or where
    another part of a user's own raised one.
    """

    COMPLETED = "completed"
    DIVERGED = "diverged"
    FAILED = "failed"
    INTERRUPTED = "interrupted"

    @property
    def lost(self) -> bool:
        """True if the run ended early by itself: its figures are not those of the others."""
        return self in (Status.DIVERGED, Status.FAILED)


class Outcome(NamedTuple):
    """Outcome of a run.

    Attributes:
        status: status at the end.
        time: simulated time at the end [s].
        reason: reason for an early end; empty for a completed run.
    """

    status: Status
    time: float
    reason: str = ""

    def __str__(self) -> str:
        """Return status, time and reason as a sentence."""
        return str(self.status) if not self.reason else f"{self.status} at {self.time:.6g} s: {self.reason}"


class StoppedError(Exception):
    """Error raised when work is stopped on request before it has a result."""
