"""How well a run tracked, in figures, gathered chunk by chunk from its full series.

Everything is taken over the steady window t ≥ ``steady_from``, except the reaching time. Root mean square (RMS) and
largest values are of the Euclidean norm of a vector.
"""

from dataclasses import dataclass
from math import isfinite, isnan
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.kinematics import tilt
from spherical_wrist.simulation.engine import Engine
from spherical_wrist.simulation.gauge import TOTALS, WINDOW
from spherical_wrist.simulation.logged import Logged
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
        max_condition_number: largest condition number of the torque map that currents were found with; None too where
            it was infinite.
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

    @property
    def window_start(self) -> float:
        """Time from which samples belong to the window [s]: half a period of grace, however times were rounded."""
        return self.steady_from - 0.5 * self.period


class Meter:
    """Gathers the metrics of a run from consecutive pieces of its series."""

    def __init__(self, measurement: Measurement) -> None:
        self._measurement = measurement
        self._totals = _nothing()

    def add(self, series: Series) -> None:
        """Takes the next piece."""
        how, totals = self._measurement, self._totals[0]
        self._look_for_reaching(series)
        first = int(np.searchsorted(series.time, how.window_start))
        steady = series.rows(slice(first, None))
        if not len(steady):
            return
        error = _norm(steady.error)
        tip = 1000.0 * _norm(steady.tip - steady.desired_tip)
        torque = _norm(steady.torque)
        tilts = tilt(steady.attitude, np.array(how.lever))
        totals["squares"] += [error @ error, tip @ tip, torque @ torque]
        totals["largest"] = np.maximum(totals["largest"], [error.max(), tip.max(), torque.max(), tilts.max()])
        totals["saturated"] += steady.saturated.sum()
        before = totals["command"][None] if totals["count"] else steady.command[:1]
        totals["variation"] += np.abs(np.diff(steady.command, axis=0, prepend=before)).sum()
        totals["command"] = steady.command[-1]
        totals["count"] += len(steady)
        if how.resistance is not None:
            totals["coils"][0] += np.square(steady.current).sum()
            extremes = [np.abs(steady.current).max(), steady.condition.max()]
            totals["coils"][1:] = np.maximum(totals["coils"][1:], extremes)

    def _look_for_reaching(self, series: Series) -> None:
        layer, totals = self._measurement.boundary_layer, self._totals[0]
        if layer is None or not np.isnan(totals["reached"]):
            return
        inside = np.flatnonzero((np.abs(series.surface) <= np.array(layer)).all(axis=1))
        if len(inside):
            totals["reached"] = series.time[inside[0]]

    def result(self) -> Metrics:
        """The figures so far."""
        return _figures(self._totals[0], self._measurement)


class LogMeter:
    """The same, from what the loop logs, without series in between.

    Args:
        measurement: what the figures depend on besides.
        engine: whose ``gauge`` it runs.

    Attributes:
        window: what is summed up, a WINDOW array of length one.
        totals: the sums so far, a TOTALS array of length one.
    """

    def __init__(self, measurement: Measurement, engine: Engine) -> None:
        self._measurement, self._engine = measurement, engine
        self.totals, self.window = _nothing(), np.zeros(1, WINDOW)
        self.window["start"], self.window["lever"] = measurement.window_start, measurement.lever
        if measurement.boundary_layer is not None:
            self.window["layer"], self.window["layered"] = measurement.boundary_layer, 1.0
        self.window["coiled"] = measurement.resistance is not None

    def add(self, logged: Logged) -> None:
        """Takes the next piece."""
        engine = self._engine
        engine.gauge(
            engine.record(self.window),
            engine.record(self.totals),
            logged.time,
            engine.records(logged.desired),
            engine.records(logged.log),
            logged.currents,
        )

    def result(self) -> Metrics:
        """The figures so far."""
        return _figures(self.totals[0], self._measurement)


def _nothing() -> npt.NDArray[np.void]:
    totals = np.zeros(1, TOTALS)
    totals["reached"] = np.nan
    return totals


def _figures(totals: Any, how: Measurement) -> Metrics:
    count, reached = float(totals["count"]), float(totals["reached"])
    reaching_time = None if isnan(reached) else reached
    if not count:
        return Metrics(None, None, None, None, None, None, None, None, reaching_time, None)
    rms = np.sqrt(totals["squares"] / count).tolist()
    largest = totals["largest"].tolist()
    spans = count - 1.0
    return Metrics(
        rms_error_rad=rms[0],
        max_error_rad=largest[0],
        rms_tip_error_mm=rms[1],
        max_tip_error_mm=largest[1],
        chattering_Nm_per_s=float(totals["variation"]) / (3.0 * spans * how.period) if spans else None,
        peak_torque_Nm=largest[2],
        rms_torque_Nm=rms[2],
        saturated_fraction=float(totals["saturated"]) / count,
        reaching_time_s=reaching_time,
        max_tilt_rad=largest[3],
        **_coil_figures(totals, how),
    )


def _coil_figures(totals: Any, how: Measurement) -> dict[str, float | None]:
    if how.resistance is None:
        return {}
    squares, current, condition = totals["coils"].tolist()
    return {
        "copper_loss_W": how.resistance * squares / float(totals["count"]),
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
