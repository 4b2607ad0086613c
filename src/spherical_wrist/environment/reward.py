"""What an agent is paid for: a small tip error, little torque and little chattering.

For every control period that an action is held for, with the true tip error d [mm] at its end, the torque τ [N·m] that
the motors delivered in it, and the chattering c = Σ|Δτ_i| / 3T [N·m/s], the change of the torque that was asked for
since the period before, per axis and time,

    r = (w_d / (1 + d/d₀) + w_τ / (1 + |τ|/τ₀) + w_c / (1 + c/c₀)) / (w_d + w_τ + w_c),

and the reward is the mean of r over these periods. It lies between 0 and 1, so that an episode that ends early is never
better than one that goes on; each part is worth one half of its weight at its scale, and keeps paying for a tenfold
smaller error where a square would have vanished. d₀ is 0.1 mm, what coronary surgery needs.
"""

from math import isfinite, sqrt
from typing import Any

from spherical_wrist.dynamics import MOTION
from spherical_wrist.parameters import NonNegative, Parameters, Positive, quantity
from spherical_wrist.simulation.addresses import records
from spherical_wrist.simulation.loop import LOG
from spherical_wrist.so3 import Quaternion, attitude_error, rate_error, rotate


class Reward(Parameters):
    """Weights and scales of the reward."""

    tip: NonNegative = quantity(1.0, "", "weight w_d of a small tip error")
    effort: NonNegative = quantity(0.05, "", "weight w_τ of a small torque")
    chattering: NonNegative = quantity(0.05, "", "weight w_c of little chattering")
    tip_scale: Positive = quantity(0.1, "mm", "tip error d₀ worth one half")
    effort_scale: Positive = quantity(0.1, "N·m", "torque τ₀ worth one half")
    chattering_scale: Positive = quantity(1.0, "N·m/s", "chattering c₀ worth one half")


class Limits(Parameters):
    """What ends an episode, as it ends one that diverges."""

    tip_error_mm: Positive | None = quantity(None, "mm", "largest true tip error")
    error_rad: Positive | None = quantity(None, "rad", "largest true attitude error")


def judge(row: Any, plant: Any, logged: int, period: float, result: Any) -> None:
    """Writes reward, true errors and torque of the control periods that were just played; compiled.

    Args:
        row: a ROW record, whose offset is the instant after them; its ``asked`` is the last torque asked for.
        plant: where they led to.
        logged: how many there were.
        period: control period T [s].
        result: a RESULT record, written.
    """
    log, desired = records(row.run.log, LOG), records(row.run.inputs.desired, MOTION)
    p, w = plant.qpos, plant.qvel
    start, pay = row.offset - logged, 0.0
    result.beyond = False
    for r in range(logged + 1):
        d = desired[start + r].attitude
        target = (d[0], d[1], d[2], d[3])
        q = (p[0], p[1], p[2], p[3])
        if r < logged:
            a = log[r].attitude
            q = (a[0], a[1], a[2], a[3])
        e = attitude_error(q, target)
        far = tip_distance(row, q, target)
        error = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
        if r > 0 or logged == 0:
            result.tip_error_mm = far
            if not (far <= row.most_tip_error and error <= row.most_error):
                result.beyond = True
        for i in range(3):
            result.error[i] = e[i]
        if r > 0:
            pay += paid(row, log[r - 1], far, period) / logged
    v = desired[row.offset].rate
    de = rate_error(q, (w[0], w[1], w[2]), target, (v[0], v[1], v[2]))
    for i in range(3):
        result.rate_error[i] = de[i]
        result.torque[i] = log[logged - 1].torque[i] if logged > 0 else 0.0
    result.reward = pay


def paid(row: Any, played: Any, far: float, period: float) -> float:
    """The reward of one control period, and its torque remembered as the one before."""
    t, c = played.torque, played.commanded_torque
    change = 0.0
    for i in range(3):
        if row.held > 0.5:
            change += abs(c[i] - row.asked[i])
        row.asked[i] = c[i]
    row.held = 1.0
    effort = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    sizes = (far, effort, change / (3.0 * period))
    total, weights = 0.0, 0.0
    for i in range(3):
        weights += row.weights[i]
        if isfinite(sizes[i]):
            total += row.weights[i] / (1.0 + sizes[i] / row.scales[i])
    return total / weights


def tip_distance(row: Any, q: Quaternion, target: Quaternion) -> float:
    """Distance [mm] between the tool tips at two attitudes."""
    lever = (row.lever[0], row.lever[1], row.lever[2])
    tip, goal = rotate(q, lever), rotate(target, lever)
    x, y, z = 1000.0 * (tip[0] - goal[0]), 1000.0 * (tip[1] - goal[1]), 1000.0 * (tip[2] - goal[2])
    return sqrt(x * x + y * y + z * z)
