"""Memory of what was asked of the wrist: samples are late, torques act late, and motors have limits.

With τ = N + H (q̈_d + w) a wrist whose model is right follows ë = −w, axis by axis; w [rad/s²], body frame, is the
deviation of the acceleration from the feed-forward, and δ [rad/s²] all that makes it ë = −w + δ.

The torque that acts during the period before a sample is not the one that was asked for last: the sample is ``late``
periods old when it is used, the age of the sample and the lag of the motors together. So the w that were asked for are
kept, and what they are about to do is added to the sample; of a torque beyond the motors, as much as they give.

A law that uses these functions derives its state from :class:`PastCommands`.
"""

from math import floor
from typing import Any

from spherical_wrist.control.contract import Command, LawState, Signal
from spherical_wrist.control.torque_limit import limited
from spherical_wrist.parameters import quantity
from spherical_wrist.so3 import Vector3

PAST = 16
"""Periods for which w is kept: beyond that lateness the oldest one stands for those before it."""

_Past = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]


class PastCommands(LawState):
    """Memory of the last commands, and of the last sample's lateness."""

    past: _Past = quantity(((0.0,) * PAST,) * 3, "rad/s²", "w of the last periods, the newest first")
    late: float = quantity(0.0, "", "lateness of the last sample, in periods")
    running: float = quantity(0.0, "", "1 after the first step")


def arrive(signal: Signal, state: Any) -> tuple[float, int]:
    """Return the lateness of the sample in periods, and the number of periods since the last new one.

    The number is 0 if the sample is the one that was taken before, as after a loss, and at the first step.
    """
    late = max(0.0, signal.horizon / signal.period - 0.5)
    periods = samples_since(state.late, late) if state.running > 0.5 else 0
    state.running, state.late = 1.0, late
    return late, periods


def asked(state: Any, axis: int, back: float) -> float:
    """Return the mean of w [rad/s²] over the period that ended ``back`` periods before now, any fraction of them."""
    whole = floor(back)
    part = back - whole
    newer, older = min(PAST - 1, whole), min(PAST - 1, whole + 1)
    mean: float = (1.0 - part) * state.past[axis, newer] + part * state.past[axis, older]
    return mean


def project(
    state: Any, axis: int, rate_error: float, mismatch: float, growth: float, late: float, period: float
) -> tuple[float, float]:
    """Predict the errors from the sample until the time at which the next torque acts.

    Args:
        state: memory of the commands.
        axis: body axis.
        rate_error: ė at the sample [rad/s].
        mismatch: δ at the sample [rad/s²].
        growth: its rate of change [rad/s³].
        late: lateness of the sample, in periods.
        period: control period [s].

    Returns:
        The changes of the error e [rad] and of its rate ė [rad/s].
    """
    whole = floor(late)
    turned, gained, passed = 0.0, 0.0, 0.0
    for j in range(whole + 1):
        span = period * (late - whole) if j == 0 else period
        w = state.past[axis, min(PAST - 1, whole - j)]
        acceleration = mismatch + growth * (passed + 0.5 * span) - w
        turned += span * (rate_error + gained + 0.5 * span * acceleration)
        gained += span * acceleration
        passed += span
    return turned, gained


def remember(state: Any, axis: int, w: float) -> None:
    """Keep the w [rad/s²] of the period that begins now."""
    for j in range(PAST - 1, 0, -1):
        state.past[axis, j] = state.past[axis, j - 1]
    state.past[axis, 0] = w


def send(signal: Signal, w: Vector3, command: Command, state: Any) -> None:
    """Write the torque N + H (q̈_d + w), and keep the w [rad/s²] that the motors can give of it."""
    H, ahead = signal.H, signal.feed_forward
    beyond = False
    for i in range(3):
        command.torque[i] = signal.N[i]
        for j in range(3):
            command.torque[i] += H[i, j] * (ahead[j] + w[j])
        beyond = beyond or abs(command.torque[i]) > signal.torque_limit[i]
    if beyond:
        x, y, z = (
            limited(command.torque[0], signal.torque_limit[0]) - signal.N[0],
            limited(command.torque[1], signal.torque_limit[1]) - signal.N[1],
            limited(command.torque[2], signal.torque_limit[2]) - signal.N[2],
        )
        # cofactors of the symmetric H
        A, D = H[1, 1] * H[2, 2] - H[1, 2] * H[1, 2], H[0, 2] * H[1, 2] - H[0, 1] * H[2, 2]
        E, B = H[0, 1] * H[1, 2] - H[0, 2] * H[1, 1], H[0, 0] * H[2, 2] - H[0, 2] * H[0, 2]
        F, G = H[0, 1] * H[0, 2] - H[0, 0] * H[1, 2], H[0, 0] * H[1, 1] - H[0, 1] * H[0, 1]
        determinant = H[0, 0] * A + H[0, 1] * D + H[0, 2] * E
        w = (
            (A * x + D * y + E * z) / determinant - ahead[0],
            (D * x + B * y + F * z) / determinant - ahead[1],
            (E * x + F * y + G * z) / determinant - ahead[2],
        )
    for i in range(3):
        remember(state, i, w[i])


def samples_since(before: float, late: float) -> int:
    """Return the periods between the last sample and this one, from the lateness of both; 0 if no new one came."""
    return max(0, min(PAST, int(1 + floor(before - late + 0.5))))
