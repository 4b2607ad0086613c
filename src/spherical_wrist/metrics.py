"""How well a run tracked, in figures, gathered chunk by chunk from its full series.

Everything is taken over the steady window t ≥ ``steady_from``, except the reaching time. Root mean square (RMS) and
largest values are of the Euclidean norm of a vector.
"""

from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.kinematics import tilt
from spherical_wrist.simulation.series import Series

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Metrics:
    """Figures of merit of a run; None where the run has no data for one.

    Attributes:
        rms_error_rad: RMS attitude error |e|.
        max_error_rad: largest attitude error |e|.
        rms_tip_error_mm: RMS distance between actual and desired tool tip.
        max_tip_error_mm: largest such distance.
        chattering_Nm_per_s: total variation of the commanded torque per second, mean over the axes.
        peak_torque_Nm: largest torque |τ|.
        rms_torque_Nm: RMS torque |τ|.
        saturated_fraction: fraction of control instants at which a motor limit cut the torque.
        reaching_time_s: first time at which |S| is within the boundary layer on every axis, from the start of the run;
            None for laws without a sliding surface, or where it is never reached.
        max_tilt_rad: largest angle between the tool and its direction at the identity.
        copper_loss_W: mean power lost in the coils of a spherical motor; None for other motors, like what follows.
        peak_current_A: largest current of a coil.
        max_condition_number: largest condition number of the torque map that currents were found with.
    """

    rms_error_rad: float | None
    max_error_rad: float | None
    rms_tip_error_mm: float | None
    max_tip_error_mm: float | None
    chattering_Nm_per_s: float | None
    peak_torque_Nm: float | None
    rms_torque_Nm: float | None
    saturated_fraction: float | None
    reaching_time_s: float | None
    max_tilt_rad: float | None
    copper_loss_W: float | None = None
    peak_current_A: float | None = None
    max_condition_number: float | None = None


class Measurement(NamedTuple):
    """What the figures depend on besides the series.

    Attributes:
        steady_from: start of the steady window [s].
        period: control period [s].
        lever: from the centre of the ball joint to the tool tip, body frame [m].
        boundary_layer: half-width per axis of the band around S = 0 [rad/s] that counts as reached, or None.
        resistance: of a coil of a spherical motor [Ω], or None.
    """

    steady_from: float
    period: float
    lever: tuple[float, float, float]
    boundary_layer: tuple[float, float, float] | None
    resistance: float | None = None


class Meter:
    """Gathers the metrics of a run from consecutive pieces of its series."""

    def __init__(self, measurement: Measurement) -> None:
        self._measurement = measurement
        self._count = 0
        self._squares = np.zeros(3)
        self._largest = np.zeros(4)
        self._coils = np.zeros(3)  # sum of squared currents, largest current, largest condition number
        self._saturated = 0.0
        self._variation = 0.0
        self._last_command: Array | None = None
        self._reached: float | None = None

    def add(self, series: Series) -> None:
        """Takes the next piece."""
        how = self._measurement
        self._look_for_reaching(series)
        # half a period of grace: the sample at steady_from belongs to the window however its time was rounded
        first = int(np.searchsorted(series.time, how.steady_from - 0.5 * how.period))
        steady = series.rows(slice(first, None))
        if not len(steady):
            return
        error = _norm(steady.error)
        tip = 1000.0 * _norm(steady.tip - steady.desired_tip)
        torque = _norm(steady.torque)
        self._count += len(steady)
        self._squares += [error @ error, tip @ tip, torque @ torque]
        tilts = tilt(steady.attitude, np.array(how.lever))
        self._largest = np.maximum(self._largest, [error.max(), tip.max(), torque.max(), tilts.max()])
        self._saturated += float(steady.saturated.sum())
        before = steady.command[:1] if self._last_command is None else self._last_command
        self._variation += float(np.abs(np.diff(steady.command, axis=0, prepend=before)).sum())
        self._last_command = steady.command[-1:]
        if how.resistance is not None:
            self._coils[0] += np.square(steady.current).sum()
            self._coils[1:] = np.maximum(self._coils[1:], [np.abs(steady.current).max(), steady.condition.max()])

    def _look_for_reaching(self, series: Series) -> None:
        layer = self._measurement.boundary_layer
        if layer is None or self._reached is not None:
            return
        inside = np.flatnonzero((np.abs(series.surface) <= np.array(layer)).all(axis=1))
        if len(inside):
            self._reached = float(series.time[inside[0]])

    def result(self) -> Metrics:
        """The figures so far."""
        if not self._count:
            return Metrics(None, None, None, None, None, None, None, None, self._reached, None)
        rms = np.sqrt(self._squares / self._count).tolist()
        largest = self._largest.tolist()
        spans = self._count - 1
        return Metrics(
            rms_error_rad=rms[0],
            max_error_rad=largest[0],
            rms_tip_error_mm=rms[1],
            max_tip_error_mm=largest[1],
            chattering_Nm_per_s=self._variation / (3.0 * spans * self._measurement.period) if spans else None,
            peak_torque_Nm=largest[2],
            rms_torque_Nm=rms[2],
            saturated_fraction=self._saturated / self._count,
            reaching_time_s=self._reached,
            max_tilt_rad=largest[3],
            **self._coil_figures(),
        )

    def _coil_figures(self) -> dict[str, float | None]:
        resistance = self._measurement.resistance
        if resistance is None:
            return {}
        squares, current, condition = self._coils.tolist()
        return {
            "copper_loss_W": resistance * squares / self._count,
            "peak_current_A": current,
            "max_condition_number": condition if isfinite(condition) else None,
        }


def measure(series: Series, measurement: Measurement) -> Metrics:
    """The metrics of a whole series."""
    meter = Meter(measurement)
    meter.add(series)
    return meter.result()


def _norm(vectors: Array) -> Array:
    norms: Array = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    return norms
