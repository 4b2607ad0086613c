"""Metrics of a run accumulated from pieces of its log, or computed from its series."""

from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.dynamics import MOTION
from spherical_wrist.loop.compiler import compiled_accumulate
from spherical_wrist.loop.engine import Engine
from spherical_wrist.loop.loop import LOG
from spherical_wrist.measure.logged import Logged
from spherical_wrist.measure.metrics import Metrics, MetricSettings, no_totals
from spherical_wrist.measure.series import Series

PIECE = 8192
"""Rows of a series that are turned into a log at a time, which bounds the memory."""


class MetricAccumulator:
    """Accumulates the metrics of a run from consecutive pieces of its log.

    Args:
        settings: of the run.
        engine: whose ``accumulate`` is used.

    Attributes:
        settings: METRIC_SETTINGS (1,).
        totals: the totals so far, TOTALS (1,).
    """

    def __init__(self, settings: MetricSettings, engine: Engine) -> None:
        self._settings, self._engine = settings, engine
        self.settings, self.totals = settings.packed(), no_totals()

    def add(self, logged: Logged) -> None:
        """Add the next piece."""
        engine = self._engine
        engine.accumulate(
            engine.record(self.settings),
            engine.record(self.totals),
            logged.time,
            engine.records(logged.desired),
            engine.records(logged.log),
            logged.currents,
        )

    def result(self) -> Metrics:
        """Return the metrics so far."""
        return Metrics.computed(self.totals[0], self._settings)


def compute_metrics(series: Series, settings: MetricSettings) -> Metrics:
    """Compute the metrics of a whole series, by the arithmetic of the loop."""
    packed, totals = settings.packed(), no_totals()
    for first in range(0, len(series), PIECE):
        piece = series.rows(slice(first, first + PIECE))
        desired, log = records_of(piece)
        currents = piece.channels.get("current", np.empty((len(piece), 0)))
        compiled_accumulate()(packed[0], totals[0], piece.time, desired, log, np.ascontiguousarray(currents))
    return Metrics.computed(totals[0], settings)


def records_of(series: Series) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Return the records MOTION and LOG of which a series holds the columns; zero where it has none."""
    desired, log = np.zeros(len(series), MOTION), np.zeros(len(series), LOG)
    desired["attitude"], desired["rate"] = series.desired_attitude, series.desired_rate
    columns = {**series.channels, "commanded_torque": series.command}
    for name in LOG.names or ():
        if name in columns:
            log[name] = columns[name]
    return desired, log
