"""Geometric tracking on SO(3), with integral action."""

from math import sin, sqrt
from typing import Any, ClassVar, Literal

from spherical_wrist.control.contract import Array, Bound, Command, LawState, LawStatus, Signal, choice
from spherical_wrist.control.torque_limit import LimitAwareLaw, integrated, limit_of
from spherical_wrist.parameters import NonNegative, Positive, Vector, quantity

AttitudeError = Literal["sine", "half_angle"]
HALF_ANGLE = choice(AttitudeError, "half_angle")


class GeometricTracking(LimitAwareLaw):
    """Geometric PID on SO(3): τ = H (q̈_d + k_R e_R + k_Ω ė) + N + w, ẇ = k_I H (ė + c e_R).

    With R_e = RᵀR_d = exp(ê), e the attitude error [rad] and θ = |e|, all in the body frame, e_R is the gradient of an
    error function Ψ on SO(3), so that Ψ̇ = e_R · ė without approximation, however large the error:

        sine:        e_R = vee(½ (R_e − R_eᵀ)) = e sin θ / θ,   Ψ = ½ tr(I − R_e) = 1 − cos θ,
        half_angle:  e_R = 2 e sin(θ/2) / θ,                    Ψ = 4 − 2 √(1 + tr R_e) = 4 (1 − cos θ/2),

    the first of Lee, Leok and McClamroch (2010), the second, which does not weaken towards a half turn, twice that of
    Lee (2012). w [N·m] is the integral term of the geometric PID (Goodarzi, Lee and Leok, 2013). Signs are those of
    desired − actual; the gains are in front of H instead of alone, so that one number serves axes of any inertia.

    Derivation: with d the torque beyond the nominal model, H ω̇ = τ − N + d, dė/dt = −k_R e_R − k_Ω ė − H⁻¹ (w + d). For
    k_I = 0 = d, V = ½ |ė|² + k_R Ψ has V̇ = −k_Ω |ė|² ≤ 0: the error tends to zero from every start with
    ½ |ė|² + k_R Ψ < 2 k_R (sine), k_R Ψ < 4 k_R (half_angle), the values at a half turn. A constant d is balanced by w.

    Assumptions: d does not depend on the error. Stability with the integral: exponential for small c (Goodarzi, Lee
    and Leok, 2013, by V with cross terms in e_R, ė and w + d); near e = 0 exactly for k_I c < k_Ω (k_R + k_I) (Routh).
    Defaults by ``wrist design``. The integral stops at ``torque_limit``, and while the whole torque is beyond it.
    """

    status: ClassVar[LawStatus] = "rival"
    tracks_to: ClassVar[Bound] = Bound(6.9e-5, 1.1e-4)

    class State(LawState):
        """Memory of the integral."""

        integral: Vector = quantity(0.0, "N·m", "integral torque w")

    Kr: Positive = quantity(6248.0, "1/s²", "attitude gain k_R", searched=(500.0, 50000.0))
    Kw: Positive = quantity(199.2, "1/s", "rate gain k_Ω", searched=(30.0, 1000.0))
    Ki: NonNegative = quantity(13460.0, "1/s²", "integral gain k_I", searched=(1000.0, 100000.0))
    slope: Positive = quantity(
        64.64, "1/s", "share c of the attitude error in the integral, against the rate error", searched=(10.0, 500.0)
    )
    attitude_error: AttitudeError = quantity("sine", "", "attitude error vector e_R")

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        e, de = error_vector(parameters.attitude_error, signal.error), signal.rate_error
        for i in range(3):
            command.torque[i] = signal.N[i]
            change = 0.0
            for j in range(3):
                acceleration = signal.feed_forward[j] + parameters.Kr * e[j] + parameters.Kw * de[j]
                command.torque[i] += signal.H[i, j] * acceleration
                change += signal.period * parameters.Ki * signal.H[i, j] * (de[j] + parameters.slope * e[j])
            limit = limit_of(signal, i, parameters.torque_limit)
            state.integral[i] = integrated(state.integral[i], change, command.torque[i], limit)
            command.torque[i] += state.integral[i]


def error_vector(kind: float, error: Array) -> tuple[float, float, float]:
    """Return e_R of the attitude error e [rad].

    Args:
        kind: ``HALF_ANGLE`` for half_angle, any other number for sine.
        error: attitude error (3,) [rad].
    """
    angle = sqrt(error[0] * error[0] + error[1] * error[1] + error[2] * error[2])
    scale = 1.0
    if angle > 0.0:
        scale = 2.0 * sin(0.5 * angle) / angle if kind == HALF_ANGLE else sin(angle) / angle
    return (scale * error[0], scale * error[1], scale * error[2])
