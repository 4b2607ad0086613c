"""Adaptive control of Slotine and Li: the torque that the model misses is learned as a combination of known motions."""

from math import sqrt
from typing import Any, ClassVar

from spherical_wrist.control.contract import Array, Bound, Command, LawState, LawStatus, Signal
from spherical_wrist.control.sliding_mode import equivalent_torque
from spherical_wrist.control.torque_limit import LimitAwareLaw, integrated, limit_of, limited
from spherical_wrist.parameters import NonNegative, Positive, Vector, quantity
from spherical_wrist.so3 import Vector3, cross

_Six = tuple[float, float, float, float, float, float]


class SlotineLi(LimitAwareLaw):
    """Adaptive computed torque: τ = H (a + K S) + N + Y θ, θ̇ = Γ Yᵀ S, with S = λ e + ė and a = q̈_d + λ ė.

    θ are the deviations of the wrist from the nominal model (H, N), in the body frame, and Y θ [N·m] their torque:

        Y θ = ΔH a + ω × ΔH ω + μ × ẑ + b ∘ ω + c,

    ΔH [kg·m²] symmetric (6), μ [N·m] of gravity, mass times gravity times the shift of its centre (3), ẑ = Rᵀ (0, 0,
    1) the vertical in the body, b [N·m·s/rad] of viscous damping (3), c [N·m] a constant torque (3). They are the
    law's state. Γ is diagonal but for c: γ_H h, γ_μ h, γ_b h with h = tr H / 3, and γ_c H, so that the
    gains γ are those of a wrist of any size.

    Derivation (Slotine and Li, 1987): a ball joint's inertia H* is constant in the body frame. If θ* are the true
    deviations, H* a + ω × H* ω + … = H a + N + Y θ*, so that with θ̃ = θ − θ*

        H* Ṡ = −H K S − Y θ̃,   V = ½ SᵀH* S + ½ θ̃ᵀ Γ⁻¹ θ̃,   V̇ = −K SᵀH S ≤ 0,

    the terms in θ̃ cancelling by the adaptation. S tends to zero by Barbalat's lemma, and e after it, however far θ is
    from θ*: it finds θ* only in a motion that excites all of Y. Slotine and Li have C(q, ω) (ω + S) for the gyroscopic
    term, to make Ḣ − 2 C skew; with Ḣ = 0 the difference S × H ω does no work on S, and ω × H ω will do.

    Assumptions: what the model misses is of the form Y θ*, and small e, so that ė is its derivative. Other
    disturbances d leave S bounded: c follows slow ones as an integral does, at S of about H⁻¹ ḋ / γ_c. θ is projected
    onto bounds, which does not increase V for a θ* within them, and rests while the torque is beyond ``torque_limit``.
    Of a sample's torque, c already contains what the sample taught; the rest of θ is that of the samples before.

    Defaults by ``wrist design``. Each γ adds to the same loop gain, while only c helps against every disturbance; with
    noise and delays, a fast ΔH drifts.
    """

    status: ClassVar[LawStatus] = "rival"
    has_surface: ClassVar[bool] = True
    tracks_to: ClassVar[Bound] = Bound(4.2e-5, 6.5e-5)

    class State(LawState):
        """Learned deviations θ of the wrist from the nominal model."""

        inertia: _Six = quantity((0.0,) * 6, "kg·m²", "entries xx, xy, xz, yy, yz, zz of ΔH")
        gravity: Vector = quantity(0.0, "N·m", "gravity moment μ")
        damping: Vector = quantity(0.0, "N·m·s/rad", "viscous damping b")
        constant: Vector = quantity(0.0, "N·m", "constant torque c")

    slope: Positive = quantity(75.0, "1/s", "slope λ of the sliding surface", searched=(20.0, 500.0))
    K: Positive = quantity(140.8, "1/s", "gain of the surface", searched=(20.0, 500.0))
    inertia_adaptation: NonNegative = quantity(
        0.0006526, "s²/rad²", "adaptation gain of the inertia", searched=(1e-05, 0.01)
    )
    gravity_adaptation: NonNegative = quantity(
        105.5, "1/s²", "adaptation gain of the gravity moment", searched=(1.0, 1000.0)
    )
    damping_adaptation: NonNegative = quantity(
        0.1107, "1/rad²", "adaptation gain of the damping", searched=(0.001, 1.0)
    )
    torque_adaptation: NonNegative = quantity(
        19150.0, "1/s²", "adaptation gain of the constant torque", searched=(1000.0, 100000.0)
    )
    inertia_limit: Positive = quantity(
        0.5, "", "largest deviation of the inertia, as a share of the nominal one", gain=False
    )
    gravity_limit: NonNegative = quantity(
        0.0, "N·m", "largest deviation of the gravity moment; 0 for what the motors can hold", gain=False
    )
    damping_limit: NonNegative = quantity(
        0.0, "N·m·s/rad", "largest deviation of the damping; 0 for a tenth of the law's own, K h", gain=False
    )

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        equivalent_torque(signal, parameters.slope, command)
        H, ahead, lead = signal.H, signal.feed_forward, signal.horizon
        e, de, w = signal.error, signal.rate_error, signal.rate
        slope = parameters.slope
        s = (de[0] + slope * e[0], de[1] + slope * e[1], de[2] + slope * e[2])
        a = (ahead[0] + slope * de[0], ahead[1] + slope * de[1], ahead[2] + slope * de[2])
        rate = (w[0] + lead * ahead[0], w[1] + lead * ahead[1], w[2] + lead * ahead[2])
        up = up_after(signal.attitude, rate, lead)
        learned = deviation_torque(state, a, rate, up)
        saturated = False
        for i in range(3):
            command.torque[i] += learned[i]
            change, limit = 0.0, limit_of(signal, i, parameters.torque_limit)
            for j in range(3):
                command.torque[i] += H[i, j] * parameters.K * s[j]
                change += signal.period * parameters.torque_adaptation * H[i, j] * s[j]
            state.constant[i] = integrated(state.constant[i], change, command.torque[i], limit)
            command.torque[i] += state.constant[i]
            saturated = saturated or abs(command.torque[i]) > limit
            command.surface[i] = s[i]
            command.slope[i] = slope
        if not saturated:
            adapt(signal, parameters, state, s, a, rate, up)


def up_after(attitude: Array, rate: Vector3, time: float) -> Vector3:
    """Return the vertical Rᵀ ẑ in the body frame, ``time`` [s] after it is seen at ``attitude``: ẑ' = −ω × ẑ."""
    w, x, y, z = attitude[0], attitude[1], attitude[2], attitude[3]
    up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
    turn = cross(up, rate)
    return (up[0] + time * turn[0], up[1] + time * turn[1], up[2] + time * turn[2])


def inertia_times(inertia: Array, v: Vector3) -> Vector3:
    """Return ΔH v from the entries xx, xy, xz, yy, yz, zz of ΔH."""
    return (
        inertia[0] * v[0] + inertia[1] * v[1] + inertia[2] * v[2],
        inertia[1] * v[0] + inertia[3] * v[1] + inertia[4] * v[2],
        inertia[2] * v[0] + inertia[4] * v[1] + inertia[5] * v[2],
    )


def deviation_torque(theta: Any, acceleration: Vector3, rate: Vector3, up: Vector3) -> Vector3:
    """Return Y θ without c: ΔH a + ω × ΔH ω + μ × ẑ + b ∘ ω [N·m]."""
    straight = inertia_times(theta.inertia, acceleration)
    turning = cross(rate, inertia_times(theta.inertia, rate))
    weight = cross((theta.gravity[0], theta.gravity[1], theta.gravity[2]), up)
    return (
        straight[0] + turning[0] + weight[0] + theta.damping[0] * rate[0],
        straight[1] + turning[1] + weight[1] + theta.damping[1] * rate[1],
        straight[2] + turning[2] + weight[2] + theta.damping[2] * rate[2],
    )


def adapt(
    signal: Signal, parameters: Any, theta: Any, s: Vector3, acceleration: Vector3, rate: Vector3, up: Vector3
) -> None:
    """Add T Γ Yᵀ S to θ and project it onto its bounds."""
    H, a = signal.H, acceleration
    size = signal.period * (H[0, 0] + H[1, 1] + H[2, 2]) / 3.0
    # S · (ω × ΔH ω) = (S × ω) · ΔH ω, and S · (μ × ẑ) = μ · (ẑ × S)
    t, g = cross(s, rate), cross(up, s)
    n = 0
    for i in range(3):
        for j in range(i, 3):
            gradient = s[i] * a[j] + t[i] * rate[j]
            if i != j:
                gradient += s[j] * a[i] + t[j] * rate[i]
            limit = parameters.inertia_limit * sqrt(H[i, i] * H[j, j])
            theta.inertia[n] = limited(theta.inertia[n] + size * parameters.inertia_adaptation * gradient, limit)
            n += 1
    drag = parameters.damping_limit
    if drag == 0.0:
        drag = 0.1 * parameters.K * size / signal.period
    for i in range(3):
        hold = signal.torque_limit[i] if parameters.gravity_limit == 0.0 else parameters.gravity_limit
        gravity = theta.gravity[i] + size * parameters.gravity_adaptation * g[i]
        damping = theta.damping[i] + size * parameters.damping_adaptation * rate[i] * s[i]
        theta.gravity[i] = limited(gravity, hold)
        theta.damping[i] = limited(damping, drag)
