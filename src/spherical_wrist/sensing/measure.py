"""What the sensors make of the true state, sample by sample; compiled into the closed loop."""

from math import floor
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.sensing.description import Sensing
from spherical_wrist.so3 import Quaternion, Vector3, quaternion_exp, quaternion_log, quaternion_product
from spherical_wrist.so3 import relative_attitude as relative

Array = npt.NDArray[np.float64]

SENSOR = np.dtype(
    [
        ("perfect", "f8"),
        ("timestamped", "f8"),
        ("period", "f8"),
        ("whole", "i8"),
        ("fraction", "f8"),
        ("quantum", "f8"),
        ("estimated", "f8"),
        ("filter", "f8"),
        ("attitude", "f8", 4),
        ("rate", "f8", 3),
        ("since", "f8"),
    ],
    align=True,
)
"""The sensors' parameters, then the sample in force and the time [s] since it was taken."""


class Sensor(NamedTuple):
    """Sensors in the form that the loop uses.

    Attributes:
        settings: a SENSOR record, or an array of one.
        history: true attitude and rate at the last control instants, (m, 7), instant k in row k mod m.
    """

    settings: Any
    history: Array


def sensor_of(sensing: Sensing, period: float) -> Sensor:
    """The sensors at rest, for a control period [s]."""
    settings = np.zeros(1, SENSOR)
    delayed = sensing.delay / period
    whole = floor(delayed + 1e-9)
    settings["perfect"] = sensing.perfect
    settings["timestamped"] = sensing.timestamped
    settings["period"] = period
    settings["whole"] = whole
    settings["fraction"] = max(0.0, delayed - whole)
    settings["quantum"] = sensing.attitude_quantum
    settings["estimated"] = sensing.rate == "estimated"
    settings["filter"] = sensing.rate_filter
    return Sensor(settings, np.zeros((whole + 2, 7)))


def measure(sensor: Sensor, sample: Any, instant: int, attitude: Quaternion, rate: Vector3) -> None:
    """Takes the sample of a control instant: updates the sample in force in ``sensor.settings``.

    Args:
        sensor: the sensors; called for every instant in turn.
        sample: a SAMPLE record, the faults of this one.
        instant: number of the control instant, from 0.
        attitude: true attitude now.
        rate: true rate now [rad/s].
    """
    now = sensor.settings
    row = sensor.history[instant % len(sensor.history)]
    row[0], row[1], row[2], row[3] = attitude[0], attitude[1], attitude[2], attitude[3]
    row[4], row[5], row[6] = rate[0], rate[1], rate[2]
    now.since += now.period
    if sample.lost > 0.5:
        return
    q, w = delayed_state(sensor, instant)
    n, b = sample.attitude_noise, sample.rate_noise
    q = quaternion_product(q, quaternion_exp((n[0], n[1], n[2])))
    if now.quantum > 0.0:
        v = quaternion_log(q)
        q = quaternion_exp(
            (rounded(v[0], now.quantum), rounded(v[1], now.quantum), rounded(v[2], now.quantum)),
        )
    if now.estimated > 0.5 and instant > 0:
        p = now.attitude
        turned = quaternion_log(relative((p[0], p[1], p[2], p[3]), q))
        share = now.since / (now.since + now.filter)
        for i in range(3):
            now.rate[i] += share * (turned[i] / now.since - now.rate[i])
    else:  # an estimate starts settled: on the rate of the first sample
        for i in range(3):
            now.rate[i] = w[i] + b[i]
    for i in range(4):
        now.attitude[i] = q[i]
    now.since = 0.0


def delayed_state(sensor: Sensor, instant: int) -> tuple[Quaternion, Vector3]:
    """The true state one delay before a control instant; before the start, the one at the start."""
    now, history = sensor.settings, sensor.history
    later = max(0, instant - now.whole)
    a, b = history[later % len(history)], history[max(0, later - 1) % len(history)]
    q, f = (a[0], a[1], a[2], a[3]), now.fraction
    if f == 0.0 or later == 0:
        return q, (a[4], a[5], a[6])
    back = quaternion_log(relative(q, (b[0], b[1], b[2], b[3])))
    q = quaternion_product(q, quaternion_exp((f * back[0], f * back[1], f * back[2])))
    g = 1.0 - f
    return q, (g * a[4] + f * b[4], g * a[5] + f * b[5], g * a[6] + f * b[6])


def rounded(value: float, quantum: float) -> float:
    """The multiple of ``quantum`` that is nearest."""
    return quantum * floor(value / quantum + 0.5)
