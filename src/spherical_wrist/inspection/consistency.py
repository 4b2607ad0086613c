"""What is in a recording, and whether its stored metrics are those of its series."""

from dataclasses import asdict
from math import isclose
from pathlib import Path
from typing import NamedTuple

from spherical_wrist.errors import RecordingError
from spherical_wrist.experiment.recordings import load_recording
from spherical_wrist.experiment.run import Run
from spherical_wrist.metrics import Metrics, measure

TOLERANCE = 1e-9
"""Relative difference allowed to the order in which sums were taken."""

EXTREMES = ("max_error_rad", "max_tip_error_mm", "peak_torque_Nm", "max_tilt_rad", "peak_current_A")
"""Metrics that a thinned series can only underestimate."""


class Inspection(NamedTuple):
    """A recording and its metrics twice.

    Attributes:
        run: what was recorded.
        recomputed: metrics of the recorded series. Of a thinned recording they are estimates.
        mismatches: metrics whose stored value its series contradict.
    """

    run: Run
    recomputed: Metrics
    mismatches: tuple[str, ...]

    def check(self) -> None:
        """Raises where the recording contradicts itself.

        Raises:
            RecordingError: stored and recomputed metrics differ; the message names them.
        """
        if self.mismatches:
            stored, recomputed = asdict(self.run.metrics), asdict(self.recomputed)
            pairs = (f"{name} stored {stored[name]}, recomputed {recomputed[name]}" for name in self.mismatches)
            raise RecordingError(f"the stored metrics are not those of the recorded series: {'; '.join(pairs)}")


def inspect(path: Path | str) -> Inspection:
    """Reads a recording and recomputes its metrics from its series.

    Of a complete recording, every metric must agree. Of a thinned one, no largest value may exceed the stored one.

    Raises:
        RecordingError: the file is missing, truncated, damaged, or not a recording of this package.
    """
    run = load_recording(path)
    recomputed = measure(run, run.measurement)
    stored, again = asdict(run.metrics), asdict(recomputed)
    if run.every == 1:
        wrong = [name for name in stored if not _equal(stored[name], again[name])]
    else:
        wrong = [name for name in EXTREMES if not _at_most(again[name], stored[name])]
    return Inspection(run, recomputed, tuple(wrong))


def _equal(a: float | None, b: float | None) -> bool:
    return a is b if a is None or b is None else isclose(a, b, rel_tol=TOLERANCE, abs_tol=1e-300)


def _at_most(a: float | None, b: float | None) -> bool:
    return a is None or (b is not None and a <= b * (1.0 + TOLERANCE))
