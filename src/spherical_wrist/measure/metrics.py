"""Metrics of a run: the registry of all of them, and the one arithmetic by which they are computed.

A new metric is one entry of :data:`METRICS`, over a quantity of :data:`QUANTITIES`. A new quantity is one name
there and one line in :func:`add_row`. Tables, recordings, JSON, comparisons, campaigns, reports, assertions and
documentation follow from the registry. Recordings of before do not have the metric, so that its ``since`` is one more
than the format that they have (``spherical_wrist.recording.layout.FORMAT``, which follows).

The arithmetic goes over the log of the loop row by row, in plain scalar Python. The same source runs compiled and
interpreted, with the same result to the last bit.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import KW_ONLY, dataclass
from math import atan2, inf, isfinite, isnan, sqrt
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.measure.bound import BOUND
from spherical_wrist.so3 import Vector3, cross, rotate

# --- the arithmetic ---------------------------------------------------------------------------------------------------

QUANTITIES = (
    "error_squared",
    "tip_error_squared",
    "torque_squared",
    "tilt",
    "saturated",
    "motor_use",
    "command_step",
    "current_squared",
    "condition",
)
"""Quantities of a row of the log, of which sum and largest value over the steady window are kept.

In this order: |e|² [rad²]; squared tip error [mm²]; |τ|² [N²·m²]; tilt of the tool [rad]; 1 where a limit cut the
torque; largest share of its limit of a motor or coil; |Δτ| of each axis of the commanded torque [N·m]; i² of each coil
[A²]; condition number of the torque map.
"""

EVENTS = ("surface_reached", "tip_settled", "largest_tip_error")
"""Events of which the time [s] is kept; not-a-number before.

The surface is reached; the tip error is within the bound, where it stays to the end of the steady window; the tip error
is largest in the steady window.
"""

LIMITS = 6
"""Largest number of limits of three motors: one in either direction."""

METRIC_SETTINGS = np.dtype(
    [
        ("start", "f8"),
        ("end", "f8"),
        ("lever", "f8", 3),
        ("layer", "f8", 3),
        ("has_surface", "f8"),
        ("surface_stays", "f8"),
        ("has_coils", "f8"),
        ("bound", "f8"),
        ("limit_shares", "f8", (LIMITS, 3)),
        ("current_limit", "f8"),
    ],
    align=True,
)
"""Record of :class:`MetricSettings` as the arithmetic needs them: start and end of the steady window [s], lever to the
tool tip [m], boundary layer [rad/s]; 1 or 0: the law has a sliding surface, which is reached where the
run stays, the motor has coils; bound on the tip error [mm]; shares of the motors' limits per torque, (LIMITS, 3)
[1/(N·m)]; largest current of a coil [A]."""

TOTALS = np.dtype(
    [("rows", "f8"), ("command", "f8", 3)]
    + [(name, np.dtype([("summed", "f8"), ("largest", "f8")])) for name in QUANTITIES]
    + [(name, "f8") for name in EVENTS],
    align=True,
)
"""Record of the totals: rows in the steady window, the last command [N·m], each quantity, each event."""


def accumulate(settings: Any, totals: Any, time: Array, desired: Any, log: Any, currents: Array) -> None:
    """Add consecutive rows of a log to the totals.

    Args:
        settings: a METRIC_SETTINGS record.
        totals: a TOTALS record, written.
        time: control instants [s], (n,).
        desired: reference as MOTION (n,).
        log: LOG (n,).
        currents: of the coils [A], (n, coils).
    """
    for k in range(len(log)):
        row = log[k]
        if settings.has_surface > 0.5:
            s, b = row.surface, settings.layer
            if abs(s[0]) <= b[0] and abs(s[1]) <= b[1] and abs(s[2]) <= b[2]:
                if isnan(totals.surface_reached):
                    totals.surface_reached = time[k]
            elif settings.surface_stays > 0.5:
                totals.surface_reached = np.nan
        if time[k] <= settings.end:
            q, d = row.attitude, desired[k].attitude
            lever = (settings.lever[0], settings.lever[1], settings.lever[2])
            tip = rotate((q[0], q[1], q[2], q[3]), lever)
            goal = rotate((d[0], d[1], d[2], d[3]), lever)
            away = square((1000.0 * (tip[0] - goal[0]), 1000.0 * (tip[1] - goal[1]), 1000.0 * (tip[2] - goal[2])))
            if not away <= settings.bound * settings.bound:
                totals.tip_settled = np.nan
            elif isnan(totals.tip_settled):
                totals.tip_settled = time[k]
            if settings.start <= time[k]:
                if totals.rows == 0.0 or away > totals.tip_error_squared.largest or isnan(away):
                    totals.largest_tip_error = time[k]
                add(totals.tip_error_squared, away)
                add_row(settings, totals, tip, lever, row, currents, k)
                totals.rows += 1.0


def add_row(settings: Any, totals: Any, tip: Vector3, lever: Vector3, row: Any, currents: Array, k: int) -> None:
    """Add the quantities of one row of the steady window, besides the tip error."""
    e, t, c, used = row.error, row.torque, row.commanded_torque, 0.0
    add(totals.error_squared, square((e[0], e[1], e[2])))
    add(totals.torque_squared, square((t[0], t[1], t[2])))
    add(totals.tilt, atan2(sqrt(square(cross(tip, lever))), tip[0] * lever[0] + tip[1] * lever[1] + tip[2] * lever[2]))
    add(totals.saturated, row.saturated)
    for i in range(3):
        if totals.rows > 0.0:
            add(totals.command_step, abs(c[i] - totals.command[i]))
        totals.command[i] = c[i]
    for i in range(LIMITS):
        share = settings.limit_shares[i]
        used = max(used, share[0] * c[0] + share[1] * c[1] + share[2] * c[2])
    if settings.has_coils > 0.5:
        for j in range(currents.shape[1]):
            add(totals.current_squared, currents[k, j] * currents[k, j])
            used = max(used, abs(currents[k, j]) / settings.current_limit)
        add(totals.condition, row.condition)
    add(totals.motor_use, used)


def add(total: Any, value: float) -> None:
    """Add a value to the sum and the largest value of a quantity; not-a-number stays."""
    total.summed += value
    if value > total.largest or isnan(value):
        total.largest = value


def square(v: Vector3) -> float:
    """Compute |v|²."""
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]


def no_totals() -> npt.NDArray[Any]:
    """Return the totals of no row, TOTALS (1,)."""
    totals = np.zeros(1, TOTALS)
    for name in EVENTS:
        totals[name] = np.nan
    return totals


# --- what a metric is -------------------------------------------------------------------------------------------------


class MetricSettings(NamedTuple):
    """Settings on which the metrics of a run depend besides its log.

    Attributes:
        steady_from: start of the steady window [s].
        period: control period [s].
        lever: from the centre of the ball joint to the tool tip, body frame [m].
        boundary_layer: half-width per axis of the band around S = 0 [rad/s] that counts as reached; None for laws
            without a sliding surface.
        resistance: of a coil of a spherical motor [Ω]; None for other motors.
        steady_until: end of the steady window [s], where the motion ends; None for the end of the run.
        surface_stays: True if the surface is reached where the run stays within the band; False if where it first is,
            as in recordings of older versions.
        bound: on the tip error [mm].
        limit_shares: share of each limit of the motors that a torque takes, as its product with a row [1/(N·m)]; of
            ``Wrist.limit_shares``. Empty for motors without limits, and for recordings of older versions.
        current_limit: largest current of a coil [A]; None without coils, and for recordings of older versions.
    """

    steady_from: float
    period: float
    lever: tuple[float, float, float]
    boundary_layer: tuple[float, float, float] | None
    resistance: float | None = None
    steady_until: float | None = None
    surface_stays: bool = True
    bound: float = BOUND
    limit_shares: tuple[tuple[float, float, float], ...] = ()
    current_limit: float | None = None

    @property
    def window_start(self) -> float:
        """Time from which rows belong to the window [s]: half a period early, so that rounding of times is harmless."""
        return self.steady_from - 0.5 * self.period

    @property
    def window_end(self) -> float:
        """Time up to which rows belong to the window [s], half a period late; infinity where the run ends it."""
        return inf if self.steady_until is None else self.steady_until + 0.5 * self.period

    def in_window(self, time: Array) -> npt.NDArray[np.bool_]:
        """Return True for the times [s], (n,), that belong to the window."""
        return (time >= self.window_start) & (time <= self.window_end)

    def packed(self) -> npt.NDArray[Any]:
        """Return the settings as METRIC_SETTINGS (1,)."""
        record = np.zeros(1, METRIC_SETTINGS)
        record["start"], record["end"], record["lever"] = self.window_start, self.window_end, self.lever
        if self.boundary_layer is not None:
            record["layer"], record["has_surface"] = self.boundary_layer, 1.0
        record["surface_stays"] = self.surface_stays
        record["has_coils"] = self.resistance is not None
        record["bound"], record["current_limit"] = self.bound, inf if self.current_limit is None else self.current_limit
        for row, shares in zip(record["limit_shares"][0], self.limit_shares, strict=False):
            row[:] = shares
        return record


class Needs(NamedTuple):
    """Condition on a run for having a metric.

    Attributes:
        runs: the runs that meet it, in words.
        met: True if a run with these settings meets it.
    """

    runs: str
    met: Callable[[MetricSettings], bool]


EVERY_RUN = Needs("all", lambda settings: True)
SURFACE = Needs("laws with a sliding surface", lambda settings: settings.boundary_layer is not None)
LIMITED = Needs(
    "motors with limits", lambda settings: bool(settings.limit_shares) or settings.current_limit is not None
)
COILS = Needs("spherical motors", lambda settings: settings.resistance is not None)


class Reduction(NamedTuple):
    """Computation of a metric from the totals of its quantity.

    Attributes:
        value: of the totals of a quantity (``summed`` and ``largest``, or the time of an event), the rows in the steady
            window, and the settings; None where there are too few rows.
        extreme: True if leaving out rows can only make the value smaller.
        window: True if the steady window must have a row.
    """

    value: Callable[[Any, float, MetricSettings], float | None]
    extreme: bool = False
    window: bool = True


MEAN = Reduction(lambda total, rows, settings: total["summed"] / rows)
ROOT_MEAN = Reduction(lambda total, rows, settings: sqrt(total["summed"] / rows))
LARGEST = Reduction(lambda total, rows, settings: total["largest"], extreme=True)
ROOT_LARGEST = Reduction(lambda total, rows, settings: sqrt(total["largest"]), extreme=True)
EVENT_TIME = Reduction(lambda total, rows, settings: None if isnan(total) else total, window=False)
EVENT_TIME_IN_WINDOW = Reduction(lambda total, rows, settings: None if isnan(total) else total)
PER_SECOND_AND_AXIS = Reduction(
    lambda total, rows, settings: total["summed"] / (3.0 * (rows - 1.0) * settings.period) if rows > 1.0 else None
)
MEAN_POWER = Reduction(lambda total, rows, settings: (settings.resistance or 0.0) * total["summed"] / rows)


@dataclass(frozen=True)
class Metric:
    """Figure of merit of a run.

    Attributes:
        name: identifier, which ends with the unit of the value; the key in JSON, tables of campaigns and recordings.
        label: its one name in tables, pictures and sentences; a head of two lines breaks after the comma.
        unit: of the value; empty for a number without one.
        quantity: entry of QUANTITIES or EVENTS that it is computed from.
        reduction: how.
        meaning: definition, in a sentence without a full stop.
        since: format of recordings that has it first.
        note: meaning in a few plain words, beside the value in tables.
        shown: factor for people, and the unit of the product; None for the value itself.
        digits: significant digits in tables.
        needs: which runs have it.
        less_is_better: False if it describes the run without judging it.
        unbounded: True if it can be infinite, which counts as no value.
    """

    name: str
    label: str
    unit: str
    quantity: str
    reduction: Reduction
    meaning: str
    _: KW_ONLY
    since: int
    note: str = ""
    shown: tuple[float, str] | None = None
    digits: int = 4
    needs: Needs = EVERY_RUN
    less_is_better: bool = True
    unbounded: bool = False

    @property
    def extreme(self) -> bool:
        """True if a thinned series can only underestimate it."""
        return self.reduction.extreme

    @property
    def shown_unit(self) -> str:
        """Unit in which people see it."""
        return self.unit if self.shown is None else self.shown[1]

    def shown_value(self, value: float | None) -> float | None:
        """Convert a value to the unit in which people see it."""
        return value if value is None or self.shown is None else self.shown[0] * value

    def written(self, value: float | None) -> str:
        """Write a value with two digits and the unit in which people see it; a dash for None."""
        found = self.shown_value(value)
        if found is None:
            return "—"
        return f"{f'{found:.2g}' if abs(found) < 99.5 else f'{found:.0f}'} {self.shown_unit}".strip()

    @property
    def label_and_unit(self) -> str:
        """Label with the unit in which people see it, in brackets."""
        return f"{self.label} [{self.shown_unit}]" if self.shown_unit else self.label

    def value(self, totals: Any, settings: MetricSettings) -> float | None:
        """Compute the value from a TOTALS record; None where there is none."""
        rows = float(totals["rows"])
        if self.reduction.window and not rows:
            return None
        found = self.reduction.value(totals[self.quantity], rows, settings)
        return None if found is None or (self.unbounded and not isfinite(found)) else float(found)


# --- the registry -----------------------------------------------------------------------------------------------------

METRICS: dict[str, Metric] = {
    metric.name: metric
    for metric in (
        Metric(
            "rms_tip_error_mm", "tip error, RMS", "mm", "tip_error_squared", ROOT_MEAN,
            "RMS distance of `tip` from `desired_tip`, where it would be at the desired attitude",
            note="of the tip from its target",
            since=1,
        ),
        Metric(
            "max_tip_error_mm", "tip error, largest", "mm", "tip_error_squared", ROOT_LARGEST,
            "largest distance of `tip` from `desired_tip`",
            since=1,
        ),
        Metric(
            "max_tip_error_at_s", "tip error, largest at", "s", "largest_tip_error", EVENT_TIME_IN_WINDOW,
            "time in the run of the largest tip error",
            since=3, less_is_better=False,
        ),
        Metric(
            "settling_time_s", "tip within bound from", "s", "tip_settled", EVENT_TIME,
            "time in the run from which the tip error stays within the bound, to the end of the steady window",
            note="and stays there; a dash: never",
            since=3,
        ),
        Metric(
            "rms_error_rad", "attitude error, RMS", "rad", "error_squared", ROOT_MEAN,
            "RMS attitude error |e|",
            note="of the tool from its target",
            since=1,
        ),
        Metric(
            "max_error_rad", "attitude error, largest", "rad", "error_squared", ROOT_LARGEST,
            "largest attitude error |e|",
            since=1,
        ),
        Metric(
            "motor_use_fraction", "motor use, peak", "", "motor_use", LARGEST,
            "largest torque or current asked of a motor or coil, as a fraction of its limit",
            note="the busiest motor, of its limit",
            shown=(100.0, "%"), digits=3, needs=LIMITED, since=3,
        ),
        Metric(
            "saturated_fraction", "saturated", "", "saturated", MEAN,
            "fraction of the control instants at which a limit cut the torque",
            note="of the time, at a motor's limit",
            shown=(100.0, "%"), since=1,
        ),
        Metric(
            "peak_torque_Nm", "torque, peak", "N·m", "torque_squared", ROOT_LARGEST,
            "largest torque |τ|",
            since=1,
        ),
        Metric(
            "rms_torque_Nm", "torque, RMS", "N·m", "torque_squared", ROOT_MEAN,
            "RMS torque |τ|",
            since=1,
        ),
        Metric(
            "chattering_Nm_per_s", "chattering", "N·m/s", "command_step", PER_SECOND_AND_AXIS,
            "Σ |τ[k] − τ[k−1]| of the torque asked for, per second, mean over the axes",
            note="the torque's ups and downs, summed",
            since=1,
        ),
        Metric(
            "reaching_time_s", "surface reached at", "s", "surface_reached", EVENT_TIME,
            "time in the run from which |S| stays within the law's boundary layer on every axis, to its end",
            note="the law slides from then on",
            needs=SURFACE, since=1,
        ),
        Metric(
            "max_tilt_rad", "tilt, largest", "rad", "tilt", LARGEST,
            "largest angle between the tool and its direction at the identity",
            note="of the tool from where it rests",
            since=1, less_is_better=False,
        ),
        Metric(
            "copper_loss_W", "copper loss", "W", "current_squared", MEAN_POWER,
            "mean power lost in the coils",
            note="heat in the coils, on average",
            needs=COILS, since=1,
        ),
        Metric(
            "peak_current_A", "coil current, peak", "A", "current_squared", ROOT_LARGEST,
            "largest current of a coil",
            needs=COILS, since=1,
        ),
        Metric(
            "max_condition_number", "condition number, largest", "", "condition", LARGEST,
            "largest condition number of the torque map for which currents were found, if it is finite",
            note="of the torque map; 1 is best",
            needs=COILS, since=1, unbounded=True,
        ),
    )
}  # fmt: skip
"""All metrics by name, in the order of tables.

:meta hide-value:
"""


class Metrics(Mapping[str, float | None]):
    """Metrics of a run: a mapping from every name of :data:`METRICS` to a value, and an attribute for each.

    A value is None where the run does not have the metric, where the steady window has no row, or where what it
    measures did not happen. :attr:`available` tells the first of these cases from the others.

    Args:
        values: of the metrics that the run has, by name; None for those without a value.

    Raises:
        KeyError: there is no metric of such a name.
    """

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[str, float | None]) -> None:
        unknown = [name for name in values if name not in METRICS]
        if unknown:
            raise KeyError(unknown[0])
        self._values = {name: values[name] for name in METRICS if name in values}

    @classmethod
    def computed(cls, totals: Any, settings: MetricSettings) -> Self:
        """Compute the metrics that a run with these settings has from a TOTALS record."""
        return cls({name: each.value(totals, settings) for name, each in METRICS.items() if each.needs.met(settings)})

    @classmethod
    def recorded(cls, values: Mapping[str, float | None], settings: MetricSettings, recording_format: int) -> Self:
        """Restore the metrics of a recording.

        Args:
            values: as they are recorded.
            settings: of the run.
            recording_format: of the recording; metrics of later formats may be missing.

        Raises:
            KeyError: a metric that the recording must have is missing, or there is none of such a name.
        """
        wanted = {name for name, each in METRICS.items() if each.needs.met(settings)}
        for name in wanted - set(values):
            if METRICS[name].since <= recording_format:
                raise KeyError(name)
        return cls({name: value for name, value in values.items() if name in wanted or value is not None})

    @property
    def available(self) -> dict[str, float | None]:
        """Values by name of the metrics that the run has."""
        return dict(self._values)

    def __getitem__(self, name: str) -> float | None:
        """Return the value of a metric; None where the run has none."""
        if name not in METRICS:
            raise KeyError(name)
        return self._values.get(name)

    def __getattr__(self, name: str) -> float | Any:
        """Return the value of a metric as an attribute; None where the run has none.

        For type checkers it is a number, so that a bound can be checked without a question for None each time.
        """
        if name not in METRICS:
            raise AttributeError(f"there is no metric {name!r}")
        return self._values.get(name)

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of all metrics."""
        return iter(METRICS)

    def __len__(self) -> int:
        """Return the number of all metrics."""
        return len(METRICS)

    def __dir__(self) -> Iterable[str]:
        """List the attributes, metrics included."""
        return [*super().__dir__(), *METRICS]

    def __repr__(self) -> str:
        """Return the values as one would write them."""
        return f"Metrics({self._values!r})"


def _described(metric: Metric) -> str:
    """Describe a metric in the way of a docstring's section of attributes."""
    unit = f" [{metric.unit}]" if metric.unit else ""
    runs = "" if metric.needs is EVERY_RUN else f"; of {metric.needs.runs} only"
    return f"        {metric.name}: {metric.meaning.replace('`', '``')}{unit}{runs}."


_ATTRIBUTES = "\n".join(map(_described, METRICS.values()))
Metrics.__doc__ = f"{(Metrics.__doc__ or '').rstrip()}\n\n    Attributes:\n{_ATTRIBUTES}\n    "


def markdown_table() -> str:
    """Return the registry as a Markdown table for the documentation."""
    rows = [("figure", "name", "unit", "is", "runs"), ("---",) * 5]
    rows += [(each.label, f"`{name}`", each.unit, each.meaning, each.needs.runs) for name, each in METRICS.items()]
    return "\n".join("| {} | {} | {} | {} | {} |".format(*(cell.replace("|", "\\|") for cell in row)) for row in rows)
