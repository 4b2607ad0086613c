"""Computed torque with integral action: a PID around feedback linearisation."""

from typing import Any, ClassVar

from spherical_wrist.control.computed_torque import ComputedTorque, computed_torque
from spherical_wrist.control.contract import Array, Command, Signal
from spherical_wrist.control.torque_limit import LimitAwareLaw, integrated
from spherical_wrist.parameters import NonNegativeVector, PositiveVector, quantity


class ComputedTorqueIntegral(LimitAwareLaw, ComputedTorque):
    """Computed torque with integral action: τ = H (q̈_d + Kv ė + Kp e) + N + w, ẇ = H Ki e.

    H [kg·m²] and N [N·m] are the nominal model's, q̈_d the feed-forward [rad/s²], e [rad] and ė [rad/s] the errors,
    all in the body frame; w [N·m] is the law's state. With d the torque that the plant gets beyond the nominal model,
    H ω̇ = τ − N + d, the error obeys

        ë + Kv ė + Kp e + Ki ∫ e dt = −H⁻¹ d,

    which is eq. (14) with one more integral (Lewis, Dawson and Abdallah, 2004, Robot Manipulator Control, the PID
    outer loop). A constant d leaves no error, a slow one H⁻¹ ḋ / Ki.

    Assumptions: d does not depend on the error; e is small, so that ė is its derivative. Stability: with the nominal
    inertia s³ + Kv s² + Kp s + Ki is Hurwitz for Ki < Kv Kp (Routh), axis by axis; a plant m times as heavy has the
    gains divided by m, and is stable for Ki < Kv Kp / m. The integral stops at ``torque_limit``, and while the whole
    torque is beyond it, so that it does not wind up.

    Defaults, as those of every rival law: the smallest geometric mean of the RMS error in six ideal cases
    (``lissajous``, 25 % constant and 1 Hz, plant of 0.75, 1 and 1.25 times the mass) for which the loop, with one more
    period of delay and 1 ms of motor lag, keeps gain margins of 6 dB up and down and a phase margin of 35° on the
    nominal wrist, and a damping ratio of 0.1 at 0.5 and 1.5 times its mass.
    """

    state_size: ClassVar[int] = 3

    Kp: PositiveVector = quantity(20000.0, "1/s²", "proportional gain per axis")
    Kv: NonNegativeVector = quantity(285.0, "1/s", "derivative gain per axis")
    Ki: NonNegativeVector = quantity(2.5e6, "1/s³", "integral gain per axis")

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Array, command: Command) -> None:
        """See the class."""
        computed_torque(signal, parameters.Kp, parameters.Kv, command)
        for i in range(3):
            change = 0.0
            for j in range(3):
                change += signal.period * signal.H[i, j] * parameters.Ki[j] * signal.error[j]
            state[i] = integrated(state[i], change, command.torque[i], parameters.torque_limit[i])
            command.torque[i] += state[i]
