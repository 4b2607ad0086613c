"""Consistency of a recording: its stored metrics against those of its series."""

from math import isclose
from pathlib import Path
from typing import NamedTuple

import numpy as np

from spherical_wrist.errors import RecordingError
from spherical_wrist.kinematics import rotated
from spherical_wrist.measure.metrics import METRICS, Metrics
from spherical_wrist.recording.runs import load_recording
from spherical_wrist.simulation.metric_accumulator import compute_metrics
from spherical_wrist.simulation.run import Run
from spherical_wrist.simulation.verdict import Verdict, verdict

TOLERANCE = 1e-9
"""Relative difference allowed to stored metrics, of recordings whose sums were taken in another order."""

ROUNDING = 1e-12
"""Difference of positions [m] that is allowed to rounding."""


class Inspection(NamedTuple):
    """A recording with its metrics stored and recomputed.

    Attributes:
        run: the recorded run.
        recomputed: metrics of the recorded series. Of a thinned recording they are estimates.
        mismatches: names of the metrics whose stored value contradicts the series.
    """

    run: Run
    recomputed: Metrics
    mismatches: tuple[str, ...]

    @property
    def verdict(self) -> Verdict:
        """Verdict on the run; figures that an older version did not store are those of the series."""
        metrics = {**self.recomputed.available, **self.run.metrics.available}
        return verdict(self.run.outcome, metrics, self.run.measurement, self.run.warnings)

    @property
    def agrees(self) -> bool:
        """True if every metric of the series is stored, with the value that the series has."""
        stored, again = self.run.metrics.available, self.recomputed.available
        return stored.keys() == again.keys() and all(_equal(value, again[name]) for name, value in stored.items())

    def check(self) -> None:
        """Refuse a recording that contradicts itself.

        Raises:
            RecordingError: stored and recomputed metrics differ, and the message names them; or the tool tips are not
                those of the attitudes.
        """
        if self.mismatches:
            stored, again = self.run.metrics, self.recomputed
            pairs = (f"{name} stored {stored[name]}, recomputed {again[name]}" for name in self.mismatches)
            raise RecordingError(f"the stored metrics are not those of the recorded series: {'; '.join(pairs)}")
        if not _tips_agree(self.run):
            raise RecordingError("the recorded tool tips are not those of the recorded attitudes")


def inspect(path: Path | str) -> Inspection:
    """Read a recording and recompute its metrics from its series.

    Of a complete recording, every metric that is stored must agree. Of a thinned one, no stored extreme may be
    exceeded. A metric that the recording predates is not stored, and recomputed only.

    Raises:
        RecordingError: the file is missing, truncated, damaged, or not a recording of this package.
    """
    run = load_recording(path)
    again = compute_metrics(run, run.measurement)
    if run.every == 1:
        wrong = [name for name, value in run.metrics.available.items() if not _equal(value, again[name])]
    else:
        wrong = [
            name
            for name, value in run.metrics.available.items()
            if METRICS[name].extreme and not _at_most(again[name], value, METRICS[name].unbounded)
        ]
    return Inspection(run, again, tuple(wrong))


def _tips_agree(run: Run) -> bool:
    """True if the tips are as far apart as the attitudes say, from which the metrics are computed."""
    lever = np.array(run.measurement.lever)
    apart = rotated(run.attitude, lever) - rotated(run.desired_attitude, lever)
    expected, recorded = (np.linalg.norm(vectors, axis=1) for vectors in (apart, run.tip - run.desired_tip))
    return np.allclose(recorded, expected, rtol=TOLERANCE, atol=ROUNDING, equal_nan=True)


def _equal(a: float | None, b: float | None) -> bool:
    return a is b if a is None or b is None else isclose(a, b, rel_tol=TOLERANCE, abs_tol=1e-300)


def _at_most(again: float | None, stored: float | None, unbounded: bool) -> bool:
    if again is None:
        return True
    return unbounded if stored is None else again <= stored * (1.0 + TOLERANCE)
