"""Computed torque with integral action: a PID around feedback linearisation."""

from typing import Any, ClassVar

from spherical_wrist.control.computed_torque import ComputedTorque, computed_torque
from spherical_wrist.control.contract import Bound, Command, LawState, LawStatus, Signal
from spherical_wrist.control.torque_limit import LimitAwareLaw, integrated, limit_of
from spherical_wrist.parameters import NonNegativeVector, PositiveVector, Vector, inherited, quantity


class ComputedTorqueIntegral(LimitAwareLaw, ComputedTorque):
    """Computed torque with integral action: τ = H (q̈_d + Kv ė + Kp e) + N + w, ẇ = H Ki e.

    H [kg·m²] and N [N·m] are the nominal model's, q̈_d the feed-forward [rad/s²], e [rad] and ė [rad/s] the errors,
    all in the body frame; w [N·m] is ``integral`` of the law's state. With d the torque that the plant gets beyond
    the nominal model, H ω̇ = τ − N + d, the error obeys

        ë + Kv ė + Kp e + Ki ∫ e dt = −H⁻¹ d,

    which is eq. (14) with one more integral (Lewis, Dawson and Abdallah, 2004, Robot Manipulator Control, the PID
    outer loop). A constant d leaves no error, a slow one H⁻¹ ḋ / Ki.

    Assumptions: d does not depend on the error; e is small, so that ė is its derivative. Stability: with the nominal
    inertia s³ + Kv s² + Kp s + Ki is Hurwitz for Ki < Kv Kp (Routh), axis by axis; a plant m times as heavy has the
    gains divided by m, and is stable for Ki < Kv Kp / m. The integral stops at ``torque_limit``, and while the whole
    torque is beyond it, so that it does not wind up. It is updated first: the torque of a sample contains what that
    sample adds to w.

    Defaults, as those of every rival law: the gains that ``wrist design`` found, by the criterion of
    :mod:`spherical_wrist.design.criterion`, within the ranges that the parameters declare.
    """

    status: ClassVar[LawStatus] = "rival"
    tracks_to: ClassVar[Bound] = Bound(8.4e-5, 1.3e-4)

    class State(LawState):
        """Memory of the integral."""

        integral: Vector = quantity(0.0, "N·m", "integral torque w")

    Kp: PositiveVector = inherited(ComputedTorque, "Kp", 24200.0, searched=(1000.0, 100000.0))
    Kv: NonNegativeVector = quantity(201.9, "1/s", "derivative gain per axis", searched=(30.0, 1000.0))
    Ki: NonNegativeVector = quantity(715600.0, "1/s³", "integral gain per axis", searched=(10000.0, 10000000.0))

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        computed_torque(signal, parameters.Kp, parameters.Kv, command)
        for i in range(3):
            change = 0.0
            for j in range(3):
                change += signal.period * signal.H[i, j] * parameters.Ki[j] * signal.error[j]
            limit = limit_of(signal, i, parameters.torque_limit)
            state.integral[i] = integrated(state.integral[i], change, command.torque[i], limit)
            command.torque[i] += state.integral[i]
