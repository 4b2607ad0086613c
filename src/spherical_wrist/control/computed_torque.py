"""Computed torque, eq. (14): feedback linearisation with a PD law around it.

With x = (e, ė), e = desired − actual as in eq. (9), the wrist in the Brunovsky form of eq. (10)–(11) is
ẋ = [[0, 1], [0, 0]] x + [0, 1] U with the input U = q̈_d + H⁻¹ (N − τ), eq. (12). Its inverse τ = H (q̈_d − U) + N, eq.
(13), turns any choice of U into a torque; U = −Kv ė − Kp e is eq. (14), and leaves the error dynamics of eq. (15).
"""

from typing import Any, ClassVar

from spherical_wrist.control.contract import Array, Bound, Command, LawStatus, ModelBasedLaw, Signal
from spherical_wrist.parameters import NonNegativeVector, PositiveVector, quantity


def computed_torque(signal: Signal, Kp: Array, Kv: Array, command: Command) -> None:
    """Write τ = H (q̈_d + Kv ė + Kp e) + N, eq. (14), with q̈_d the feed-forward in the body frame."""
    for i in range(3):
        command.torque[i] = signal.N[i]
        for j in range(3):
            acceleration = signal.feed_forward[j] + Kv[j] * signal.rate_error[j] + Kp[j] * signal.error[j]
            command.torque[i] += signal.H[i, j] * acceleration


class ComputedTorque(ModelBasedLaw):
    """Computed torque, eq. (14): τ = H (q̈_d + Kv ė + Kp e) + N.

    With a perfect model the error obeys ë + Kv ė + Kp e = 0, eq. (15), exponentially stable for Kp, Kv > 0. Against a
    constant torque d that the model does not have, it stays at e = (H Kp)⁻¹ d.
    """

    status: ClassVar[LawStatus] = "paper"
    tracks_to: ClassVar[Bound] = Bound(0.100, 0.135)

    Kp: PositiveVector = quantity(400.0, "1/s²", "proportional gain per axis")
    Kv: NonNegativeVector = quantity(40.0, "1/s", "derivative gain per axis; 2 √Kp is critical damping")

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        computed_torque(signal, parameters.Kp, parameters.Kv, command)
