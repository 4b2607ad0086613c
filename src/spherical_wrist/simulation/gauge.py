"""The sums and extremes that metrics are made of, taken from the log of the loop row by row; compiled.

Series hold the same numbers in arrays of their own, and :class:`spherical_wrist.metrics.Meter` takes the same sums from
them in NumPy. Here nothing is copied: for runs whose series nobody keeps, that is most of the cost of measuring.
"""

from math import atan2, isnan, sqrt
from typing import Any

import numpy as np

from spherical_wrist.dynamics import Array
from spherical_wrist.so3 import Vector3, cross, rotate

WINDOW = np.dtype(
    [("start", "f8"), ("lever", "f8", 3), ("layer", "f8", 3), ("layered", "f8"), ("coiled", "f8")],
    align=True,
)
"""What is summed up: start of the steady window [s]; lever to the tool tip [m]; boundary layer [rad/s], if there is one
(1 or 0); coils, if there are any (1 or 0)."""

TOTALS = np.dtype(
    [
        ("count", "f8"),
        ("squares", "f8", 3),
        ("largest", "f8", 4),
        ("coils", "f8", 3),
        ("saturated", "f8"),
        ("variation", "f8"),
        ("command", "f8", 3),
        ("reached", "f8"),
    ],
    align=True,
)
"""Rows in the window; squares of attitude error, tip error [mm] and torque; largest of these three, and of the tilt;
square of the currents, largest current and condition number; rows cut by a limit; total variation of the command; the
last command; time at which the boundary layer was reached, not-a-number before."""


def gauge(window: Any, totals: Any, time: Array, desired: Any, log: Any, currents: Array) -> None:
    """Adds consecutive rows of a log to the totals.

    Args:
        window: a WINDOW record.
        totals: a TOTALS record, written.
        time: control instants [s], (n,).
        desired: reference as MOTION (n,).
        log: LOG (n,).
        currents: of the coils [A], (n, coils).
    """
    lever = (window.lever[0], window.lever[1], window.lever[2])
    for k in range(len(log)):
        row = log[k]
        if window.layered > 0.5 and isnan(totals.reached):
            s, b = row.surface, window.layer
            if abs(s[0]) <= b[0] and abs(s[1]) <= b[1] and abs(s[2]) <= b[2]:
                totals.reached = time[k]
        if time[k] < window.start:
            continue
        q, d, e, t = row.attitude, desired[k].attitude, row.error, row.torque
        tip = rotate((q[0], q[1], q[2], q[3]), lever)
        goal = rotate((d[0], d[1], d[2], d[3]), lever)
        away = (1000.0 * (tip[0] - goal[0]), 1000.0 * (tip[1] - goal[1]), 1000.0 * (tip[2] - goal[2]))
        keep(totals, 0, square((e[0], e[1], e[2])))
        keep(totals, 1, square(away))
        keep(totals, 2, square((t[0], t[1], t[2])))
        tilt = atan2(sqrt(square(cross(tip, lever))), tip[0] * lever[0] + tip[1] * lever[1] + tip[2] * lever[2])
        totals.largest[3] = larger(totals.largest[3], tilt)
        totals.saturated += row.saturated
        for i in range(3):
            if totals.count > 0.0:
                totals.variation += abs(row.commanded_torque[i] - totals.command[i])
            totals.command[i] = row.commanded_torque[i]
        if window.coiled > 0.5:
            for j in range(currents.shape[1]):
                totals.coils[0] += currents[k, j] * currents[k, j]
                totals.coils[1] = larger(totals.coils[1], abs(currents[k, j]))
            totals.coils[2] = larger(totals.coils[2], row.condition)
        totals.count += 1.0


def keep(totals: Any, which: int, squared: float) -> None:
    """Adds a squared length to its sum and its largest value."""
    totals.squares[which] += squared
    totals.largest[which] = larger(totals.largest[which], sqrt(squared))


def larger(a: float, b: float) -> float:
    """The larger of two numbers; not-a-number if one of them is."""
    return b if b > a or isnan(b) else a


def square(v: Vector3) -> float:
    """|v|²."""
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
