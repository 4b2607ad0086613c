"""Memory of the period that just ended, from which the torque follows that the nominal model missed in it.

With d the torque that the plant gets beyond the nominal model, H ω̇ = τ − N + d, and with the deviation
δ = τ − N − H q̈_d of the torque from the feed-forward, dė/dt = q̈_d − ω̇ gives

    d = −δ − H dė/dt.

The means over a period need no acceleration: that of δ was commanded, that of dė/dt is a difference of two samples.
It is the generalised momentum H ė that is differenced, H being constant in the body frame of a ball joint.

A law that uses these functions derives its state from :class:`PastPeriod`.
"""

from typing import Any

from spherical_wrist.control.contract import Array, Command, LawState, Signal
from spherical_wrist.control.torque_limit import limit_of, limited
from spherical_wrist.parameters import Vector, quantity


class PastPeriod(LawState):
    """Memory of the period that just ended."""

    deviation: Vector = quantity(0.0, "N·m", "deviation δ of the torque from the feed-forward")
    rate_error: Vector = quantity(0.0, "rad/s", "rate error ė at its start")
    started: float = quantity(0.0, "", "1 once there is a past period")


def rate_error_change(signal: Signal, axis: int, state: Any) -> float:
    """Return the mean of dė/dt over the period that just ended [rad/s²]; zero at the first step, which has no past."""
    if state.started == 0.0:
        return 0.0
    return float((signal.rate_error[axis] - state.rate_error[axis]) / signal.period)


def missed_torque(signal: Signal, axis: int, state: Any) -> float:
    """Return the mean of d over the period that just ended [N·m]."""
    missed = -state.deviation[axis]
    for j in range(3):
        missed -= signal.H[axis, j] * rate_error_change(signal, j, state)
    return float(missed)


def remember(signal: Signal, command: Command, own: Array, state: Any) -> None:
    """Keep δ and ė for the next step; of the torque as much as the motors give, or ``own`` allows, if not 0 [N·m]."""
    for i in range(3):
        state.deviation[i] = limited(command.torque[i], limit_of(signal, i, own)) - signal.N[i]
        for j in range(3):
            state.deviation[i] -= signal.H[i, j] * signal.feed_forward[j]
        state.rate_error[i] = signal.rate_error[i]
    state.started = 1.0
