"""Kalman filter of the errors, of the disturbance with its growth, and of the gyroscope's bias.

Per axis ë = −w + δ, and both sensors see the same motion. The model of what is not known is white noise of given
density into the disturbance δ [rad/s²], its growth γ [rad/s³] and the gyroscope's bias b [rad/s]:

    d/dt (e, ė, δ, γ, b) = (ė, δ − w, γ + q_δ ν₁, q_γ ν₂, q_b ν₃),    y = (e + σ_e n₁, ė − b + σ_ω n₂),

−b since the rate error is desired minus measured. Sampled with the period T, Van Loan (1978) gives the noise's exact
covariance Q; P = A P Aᵀ + Q − A P Cᵀ (C P Cᵀ + R)⁻¹ C P Aᵀ its stationary error before a sample, and
L = P Cᵀ (C P Cᵀ + R)⁻¹ the gain that corrects with one (Kalman, 1960; Anderson and Moore, 1979, Optimal Filtering,
chapter 4). The pair is observable: e, which is known but for white noise, tells the rate from the bias. L is solved for
by SciPy, in units of σ_e and T, when the law is prepared for its period.

For large errors the rate of the log is not ė, but ė − ½ e × ė + e × (e × ė) / 12 − … (of which the next term has
|e|⁴ / 720). What the first terms add to ė at a sample is added to the prediction of e, which would otherwise be taken
for a bias of the gyroscope.

The w that acted before a sample, late ones too, are those of ``past_commands``. A law that uses the filter derives from
:class:`KalmanLaw`, its state from :class:`Estimate`.
"""

from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from spherical_wrist.control.contract import Array, ModelBasedLaw, Signal
from spherical_wrist.control.past_commands import PastCommands, asked
from spherical_wrist.control.riccati import riccati
from spherical_wrist.control.torque_limit import largest_mismatch
from spherical_wrist.parameters import Positive, Vector, quantity
from spherical_wrist.so3 import cross


class Estimate(PastCommands):
    """State of the filter, per axis, and memory of the commands."""

    error: Vector = quantity(0.0, "rad", "estimated error e")
    rate_error: Vector = quantity(0.0, "rad/s", "estimated rate error ė")
    mismatch: Vector = quantity(0.0, "rad/s²", "estimated disturbance δ")
    growth: Vector = quantity(0.0, "rad/s³", "its estimated growth γ")
    bias: Vector = quantity(0.0, "rad/s", "estimated bias b of the gyroscope")


class KalmanLaw(ModelBasedLaw):
    """A law around the Kalman filter, with the noise that the filter believes in."""

    abstract: ClassVar[bool] = True

    attitude_noise: Positive = quantity(2.9e-4, "rad", "standard deviation σ_e of the attitude per sample", gain=False)
    rate_noise: Positive = quantity(1.1e-3, "rad/s", "standard deviation σ_ω of the rate per sample", gain=False)
    bias_walk: Positive = quantity(1e-4, "rad/(s·s½)", "density q_b of the bias's random walk", gain=False)
    disturbance_walk: Positive = quantity(
        331.0, "rad/(s²·s½)", "density q_δ of the disturbance's random walk", searched=(1.0, 1000.0)
    )
    growth_walk: Positive = quantity(
        1070.0, "rad/(s³·s½)", "density q_γ of its growth's random walk", searched=(30.0, 30000.0)
    )

    def designed(self, period: float) -> dict[str, Array]:
        """Return the gain of the filter (5, 2): of e [rad] and ė [rad/s] on e, ė, δ, γ and b."""
        walks = self.disturbance_walk, self.growth_walk, self.bias_walk
        return {"filter": kalman_gain(period, self.attitude_noise, self.rate_noise, *walks)}


@lru_cache(maxsize=64)
def kalman_gain(
    period: float,
    attitude_noise: float,
    rate_noise: float,
    disturbance_walk: float,
    growth_walk: float,
    bias_walk: float,
) -> Array:
    """Return the stationary gain L (5, 2) of the filter; the arguments are those of :class:`KalmanLaw`.

    Raises:
        LawError: see :func:`.riccati.riccati`.
    """
    from scipy.linalg import expm

    T, size = period, attitude_noise
    motion = np.zeros((5, 5))
    motion[0, 1] = motion[1, 2] = motion[2, 3] = 1.0
    # in units of σ_e and T
    walks = [disturbance_walk * T**2.5 / size, growth_walk * T**3.5 / size, bias_walk * T**1.5 / size]
    noise = np.diag(np.square([0.0, 0.0, *walks]))
    whole = expm(np.block([[-motion, noise], [np.zeros((5, 5)), motion.T]]))
    A = whole[5:, 5:].T
    Q = A @ whole[:5, 5:]
    C = np.array([[1.0, 0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0, -1.0]])
    R = np.diag([1.0, (rate_noise * T / size) ** 2])
    _, P = riccati(A.T, C.T, 0.5 * (Q + Q.T), R, "noise or walk")
    gain = np.linalg.solve(C @ P @ C.T + R, C @ P).T
    units = T ** -np.array([0.0, 1.0, 2.0, 3.0, 1.0])
    found: Array = units[:, None] * gain / units[:2]
    return found


def estimate(signal: Signal, gain: Array, state: Any, axis: int, late: float, periods: int, first: bool) -> None:
    """Advance the filter of one axis to a sample that came ``periods`` after the last, and correct it.

    Args:
        signal: the sample.
        gain: L (5, 2).
        state: the filter's, written.
        axis: body axis.
        late: lateness of the sample, in periods.
        periods: number of periods since the last sample; 0 takes none.
        first: the sample is the first one, from which the filter starts.
    """
    T = signal.period
    turning = cross(
        (signal.error[0], signal.error[1], signal.error[2]),
        (signal.rate_error[0], signal.rate_error[1], signal.rate_error[2]),
    )
    twice = cross((signal.error[0], signal.error[1], signal.error[2]), turning)
    beside = twice[axis] / 12.0 - 0.5 * turning[axis]
    if first:
        state.error[axis], state.rate_error[axis] = signal.error[axis], signal.rate_error[axis]
    for n in range(periods):
        growth = state.growth[axis]
        acceleration = state.mismatch[axis] - asked(state, axis, late + periods - 1 - n)
        state.error[axis] += T * (state.rate_error[axis] + beside + T * (0.5 * acceleration + T * growth / 6.0))
        state.rate_error[axis] += T * (acceleration + 0.5 * T * growth)
        state.mismatch[axis] += T * growth
    if periods == 0:
        return
    turned = signal.error[axis] - state.error[axis]
    gained = signal.rate_error[axis] - state.rate_error[axis] + state.bias[axis]
    state.error[axis] += gain[0, 0] * turned + gain[0, 1] * gained
    state.rate_error[axis] += gain[1, 0] * turned + gain[1, 1] * gained
    state.mismatch[axis] += gain[2, 0] * turned + gain[2, 1] * gained
    state.growth[axis] += gain[3, 0] * turned + gain[3, 1] * gained
    state.bias[axis] += gain[4, 0] * turned + gain[4, 1] * gained
    most = largest_mismatch(signal, axis)
    if abs(state.mismatch[axis]) > most:
        state.mismatch[axis] = min(most, max(-most, state.mismatch[axis]))
        state.growth[axis] = 0.0
