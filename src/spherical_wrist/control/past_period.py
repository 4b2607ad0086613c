"""What a law remembers of the period that just ended, to tell what the nominal model missed in it.

With d the torque that the plant gets beyond the nominal model, H ω̇ = τ − N + d, and with the deviation
δ = τ − N − H q̈_d of the torque from the feed-forward, dė/dt = q̈_d − ω̇ gives

    d = −δ − H dė/dt.

The means over a period need no acceleration: that of δ was commanded, that of dė/dt is a difference of two samples.
It is the generalised momentum H ė that is differenced, H being constant in the body frame of a ball joint.

The memory is the start of the law's state: δ (3), then ė (3), then 1 once there is a past period.
"""

from spherical_wrist.control.contract import Array, Command, Signal
from spherical_wrist.control.torque_limit import limited

MEMORY = 7
"""How many numbers of the state the memory takes."""


def rate_error_change(signal: Signal, axis: int, state: Array) -> float:
    """Mean of dė/dt over the period that just ended [rad/s²]; zero at the first step, which has no past."""
    if state[6] == 0.0:
        return 0.0
    return float((signal.rate_error[axis] - state[3 + axis]) / signal.period)


def missed_torque(signal: Signal, axis: int, state: Array) -> float:
    """Mean of d over the period that just ended [N·m]."""
    missed = -state[axis]
    for j in range(3):
        missed -= signal.H[axis, j] * rate_error_change(signal, j, state)
    return float(missed)


def remember(signal: Signal, command: Command, limit: Array, state: Array) -> None:
    """Keeps δ and ė for the next step; of the torque as much as the motors give, ``limit`` [N·m] per axis."""
    for i in range(3):
        state[i] = limited(command.torque[i], limit[i]) - signal.N[i]
        for j in range(3):
            state[i] -= signal.H[i, j] * signal.feed_forward[j]
        state[3 + i] = signal.rate_error[i]
    state[6] = 1.0
