"""Reward for a small tip error, little torque and little chattering.

In one control period, d is the true tip error at its end [mm], τ the torque that the motors deliver [N·m], and
c = Σ|Δτ_i| / 3T the chattering [N·m/s], the change of the commanded torque since the last period, per axis and time.
Then

    r = (w_d / (1 + d/d₀) + w_τ / (1 + |τ|/τ₀) + w_c / (1 + c/c₀)) / (w_d + w_τ + w_c),

and the reward of a step is the mean of r over its control periods. It is between 0 and 1, so that an early end of an
episode is never an advantage. Each term is half of its weight at its scale, and still rewards a tenfold smaller error,
unlike a square, which would vanish. d₀ is 0.1 mm, the accuracy that coronary surgery needs.
"""

from math import isfinite, sqrt
from typing import Any

from spherical_wrist.dynamics import MOTION
from spherical_wrist.loop.addresses import records
from spherical_wrist.loop.loop import LOG
from spherical_wrist.measure.bound import BOUND
from spherical_wrist.parameters import NonNegative, Parameters, Positive, quantity
from spherical_wrist.so3 import Quaternion, attitude_error, rate_error, rotate


class Reward(Parameters):
    """Weights and scales of the reward."""

    tip: NonNegative = quantity(1.0, "", "weight w_d of a small tip error")
    effort: NonNegative = quantity(0.05, "", "weight w_τ of a small torque")
    chattering: NonNegative = quantity(0.05, "", "weight w_c of little chattering")
    tip_scale: Positive = quantity(BOUND, "mm", "tip error d₀ worth one half")
    effort_scale: Positive = quantity(0.1, "N·m", "torque τ₀ worth one half")
    chattering_scale: Positive = quantity(1.0, "N·m/s", "chattering c₀ worth one half")


class Limits(Parameters):
    """Thresholds that terminate an episode early."""

    tip_error_mm: Positive | None = quantity(None, "mm", "largest true tip error")
    error_rad: Positive | None = quantity(None, "rad", "largest true attitude error")


def evaluate_reward(record: Any, plant: Any, logged: int, period: float, result: Any) -> None:
    """Write reward, true errors and torque of a step. Compiled.

    Args:
        record: EPISODE_RECORD record, whose offset is the instant after the step; its last command is updated.
        plant: plant after the step.
        logged: number of control periods in the step.
        period: control period T [s].
        result: STEP_RESULT record, written.
    """
    log, desired = records(record.run.log, LOG), records(record.run.inputs.desired, MOTION)
    p, w = plant.qpos, plant.qvel
    start, reward = record.offset - logged, 0.0
    result.out_of_bounds = False
    for r in range(logged + 1):
        d = desired[start + r].attitude
        target = (d[0], d[1], d[2], d[3])
        q = (p[0], p[1], p[2], p[3])
        if r < logged:
            a = log[r].attitude
            q = (a[0], a[1], a[2], a[3])
        e = attitude_error(q, target)
        tip_error = tip_distance(record, q, target)
        error = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
        if r > 0 or logged == 0:
            result.tip_error_mm = tip_error
            if not (tip_error <= record.max_tip_error and error <= record.max_error):
                result.out_of_bounds = True
        for i in range(3):
            result.error[i] = e[i]
        if r > 0:
            reward += period_reward(record, log[r - 1], tip_error, period) / logged
    v = desired[record.offset].rate
    de = rate_error(q, (w[0], w[1], w[2]), target, (v[0], v[1], v[2]))
    for i in range(3):
        result.rate_error[i] = de[i]
        result.torque[i] = log[logged - 1].torque[i] if logged > 0 else 0.0
    result.reward = reward


def period_reward(record: Any, row: Any, tip_error: float, period: float) -> float:
    """Compute the reward of one control period from its row of the log, and store its commanded torque."""
    t, c = row.torque, row.commanded_torque
    change = 0.0
    for i in range(3):
        if record.has_last_command > 0.5:
            change += abs(c[i] - record.last_command[i])
        record.last_command[i] = c[i]
    record.has_last_command = 1.0
    effort = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    sizes = (tip_error, effort, change / (3.0 * period))
    total, weights = 0.0, 0.0
    for i in range(3):
        weights += record.weights[i]
        if isfinite(sizes[i]):
            total += record.weights[i] / (1.0 + sizes[i] / record.scales[i])
    return total / weights


def tip_distance(record: Any, q: Quaternion, target: Quaternion) -> float:
    """Compute the distance [mm] between the tool tips at two attitudes."""
    lever = (record.lever[0], record.lever[1], record.lever[2])
    tip, goal = rotate(q, lever), rotate(target, lever)
    x, y, z = 1000.0 * (tip[0] - goal[0]), 1000.0 * (tip[1] - goal[1]), 1000.0 * (tip[2] - goal[2])
    return sqrt(x * x + y * y + z * z)
