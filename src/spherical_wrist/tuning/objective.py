"""Objective of tuning: mean error and mean chattering over a family."""

from collections.abc import Mapping, Sequence
from math import pi
from types import MappingProxyType
from typing import Any, NamedTuple

from spherical_wrist.comparison.ranking import SMALLEST, geometric_mean
from spherical_wrist.errors import ParameterError
from spherical_wrist.loop.outcome import Status
from spherical_wrist.measure.warnings import CHECKS
from spherical_wrist.simulation.rollouts import RolloutResult

WORST = (pi, 1e6)
"""Error [rad] and chattering [N·m/s] of a case that was not completed: no attitude error is larger."""


class Figures(NamedTuple):
    """Result of one case.

    Attributes:
        outcome: completed, diverged, failed (the law raised) or missed (the tip error exceeds the bound).
        rms_error_rad: RMS attitude error; None where the case was not completed, like the others.
        max_tip_error_mm: largest tip error.
        chattering_Nm_per_s: chattering.
        doubts: metrics that make the figures doubtful, by name; see :mod:`spherical_wrist.measure.warnings`.
    """

    outcome: str
    rms_error_rad: float | None = None
    max_tip_error_mm: float | None = None
    chattering_Nm_per_s: float | None = None
    doubts: Mapping[str, float | None] = MappingProxyType({})

    @classmethod
    def of(cls, run: RolloutResult, case: str, bound: float | None = None) -> "Figures":
        """The figures of a run.

        Args:
            run: the run.
            case: name of the case, for the message.
            bound: largest tip error [mm] that is accepted; None for any.

        Raises:
            ParameterError: it completed, but has too few samples for them.
        """
        if run.outcome.status is not Status.COMPLETED:
            return cls(str(run.outcome.status))
        metrics = run.metrics
        if metrics.rms_error_rad is None or metrics.chattering_Nm_per_s is None:
            raise ParameterError(f"case {case!r} has nothing to measure: let its duration reach into the steady window")
        if bound is not None and metrics.max_tip_error_mm is not None and metrics.max_tip_error_mm > bound:
            return cls("missed")
        doubts = {check.metric: metrics[check.metric] for check in CHECKS.values() if check.found(metrics)}
        return cls("completed", metrics.rms_error_rad, metrics.max_tip_error_mm, metrics.chattering_Nm_per_s, doubts)


class Score(NamedTuple):
    """Result of gains on a family.

    Attributes:
        cases: figures by the name of the case; empty where the law refused the gains.
        refused: why it did; empty where it did not.
    """

    cases: Mapping[str, Figures]
    refused: str = ""

    @property
    def failed(self) -> int:
        """Cases that were not completed; gains are feasible where it is 0. Refused gains count as one."""
        return sum(each.rms_error_rad is None for each in self.cases.values()) + bool(self.refused)

    @property
    def error(self) -> float:
        """Geometric mean of the RMS attitude errors [rad]; ``WORST`` where a case was not completed."""
        return self._mean([each.rms_error_rad for each in self.cases.values()], WORST[0])

    @property
    def chattering(self) -> float:
        """Geometric mean of the chattering [N·m/s]; ``WORST`` where a case was not completed."""
        return self._mean([each.chattering_Nm_per_s for each in self.cases.values()], WORST[1])

    @property
    def tip_error(self) -> float | None:
        """The largest tip error of all cases [mm]; None where a case was not completed."""
        errors = [each.max_tip_error_mm for each in self.cases.values() if each.max_tip_error_mm is not None]
        return None if self.failed else max(errors)

    def _mean(self, values: Sequence[float | None], worst: float) -> float:
        known = [max(value, SMALLEST) for value in values if value is not None]
        mean = geometric_mean(known)
        return worst if self.failed or mean is None else mean

    def to_plain(self) -> dict[str, Any]:
        """The score as plain data, from which :meth:`from_plain` makes it again, bit for bit."""
        return {
            "cases": {name: [*each[:-1], dict(each.doubts)] for name, each in self.cases.items()},
            "refused": self.refused,
        }

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> "Score":
        """See :meth:`to_plain`."""
        return cls({name: Figures(*values) for name, values in plain["cases"].items()}, plain["refused"])
