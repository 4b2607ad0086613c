"""Sensor model: measured attitude and rate from the true state, sample by sample; compiled into the closed loop."""

from math import ceil
from typing import Any, NamedTuple

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.sensing.description import Sensing
from spherical_wrist.so3 import Quaternion, Vector3, quaternion_exp, quaternion_log, quaternion_product
from spherical_wrist.so3 import relative_attitude as relative

SENSOR = np.dtype(
    [
        ("ideal", "f8"),
        ("timestamped", "f8"),
        ("period", "f8"),
        ("whole", "i8"),
        ("fraction", "f8"),
        ("quantum", "f8"),
        ("estimated", "f8"),
        ("filter", "f8"),
        ("attitude", "f8", 4),
        ("rate", "f8", 3),
        ("taken", "i8"),
        ("rate_age", "f8"),
    ],
    align=True,
)
"""Parameters of the sensors, then the sample in force, its control instant (−1 before the first), and the age of its
rate relative to its attitude [s]."""


class Sensor(NamedTuple):
    """Sensors in the form that the loop uses.

    Attributes:
        settings: a SENSOR record, or an array of one.
        history: true attitude and rate at the last control instants, (m, 7), instant k in row k mod m.
    """

    settings: Any
    history: Array


def sensor_of(sensing: Sensing, period: float) -> Sensor:
    """Return the sensors before the first sample, for a control period [s]."""
    settings = np.zeros(1, SENSOR)
    whole, fraction = divmod(sensing.delay / period, 1.0)
    if min(fraction, 1.0 - fraction) < 1e-9:  # a whole number of periods, but for rounding
        whole, fraction = whole + round(fraction), 0.0
    settings["ideal"] = sensing.ideal
    settings["timestamped"] = sensing.timestamped
    settings["period"] = period
    settings["whole"] = whole
    settings["fraction"] = fraction
    settings["quantum"] = sensing.attitude_quantum
    settings["estimated"] = sensing.rate == "estimated"
    settings["filter"] = sensing.rate_filter
    settings["taken"] = -1
    return Sensor(settings, np.zeros((int(whole) + 2, 7)))


def measure(sensor: Sensor, sample: Any, instant: int, attitude: Quaternion, rate: Vector3) -> None:
    """Take the sample of a control instant: update the sample in force in ``sensor.settings``.

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
    if now.estimated < 0.5:
        for i in range(3):
            now.rate[i] = w[i] + b[i]
    elif now.taken < now.whole + ceil(now.fraction):
        # the sample before shows the start, however late: the estimate is settled, on the true rate
        for i in range(3):
            now.rate[i] = w[i]
    else:
        p = now.attitude
        turned = quaternion_log(relative((p[0], p[1], p[2], p[3]), q))
        spacing = now.period * (instant - now.taken)
        share = spacing / (spacing + now.filter)
        now.rate_age = 0.5 * spacing + now.filter
        for i in range(3):
            now.rate[i] += share * (turned[i] / spacing - now.rate[i])
    for i in range(4):
        now.attitude[i] = q[i]
    now.taken = instant


def delayed_state(sensor: Sensor, instant: int) -> tuple[Quaternion, Vector3]:
    """Return the true state one delay before a control instant; before the start, the one at the start.

    Between two instants the rotation vector from the later one is the cubic that has the rates at both (Hermite), the
    rate is linear. A geodesic would be off by up to ω̇ T² / 8, a microradian: more than the best laws leave.
    """
    now, history = sensor.settings, sensor.history
    later = max(0, instant - now.whole)
    a, b = history[later % len(history)], history[max(0, later - 1) % len(history)]
    q, f = (a[0], a[1], a[2], a[3]), now.fraction
    if f == 0.0 or later == 0:
        return q, (a[4], a[5], a[6])
    g = 1.0 - f
    back = quaternion_log(relative(q, (b[0], b[1], b[2], b[3])))
    at, early, late = f * f * (3.0 - 2.0 * f), f * f * g * now.period, f * g * g * now.period
    turn = (
        at * back[0] + early * b[4] - late * a[4],
        at * back[1] + early * b[5] - late * a[5],
        at * back[2] + early * b[6] - late * a[6],
    )
    q = quaternion_product(q, quaternion_exp(turn))
    return q, (g * a[4] + f * b[4], g * a[5] + f * b[5], g * a[6] + f * b[6])


def rounded(value: float, quantum: float) -> float:
    """Return the nearest multiple of ``quantum``."""
    nearest: float = quantum * np.floor(value / quantum + 0.5)  # math.floor, compiled, would overflow far out
    return nearest
