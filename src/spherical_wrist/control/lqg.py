"""LQG: a Kalman filter of the errors, the disturbance and the gyroscope's bias, and a linear-quadratic regulator."""

from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from spherical_wrist.control.contract import Array, Bound, Command, LawStatus, Signal
from spherical_wrist.control.kalman_observer import Estimate, KalmanLaw, estimate
from spherical_wrist.control.past_commands import arrive, project, send
from spherical_wrist.control.riccati import riccati
from spherical_wrist.parameters import Positive, inherited, quantity


class LQG(KalmanLaw):
    """LQG: τ = N + H (q̈_d + k₀ ê + k₁ ê' + δ̂), estimates of a Kalman filter, gains of a linear-quadratic regulator.

    H [kg·m²] and N [N·m], body frame, are the nominal model's, q̈_d [rad/s²] the feed-forward; ê [rad], ê' [rad/s] and
    δ̂ [rad/s²] the filtered errors and disturbance, projected to the middle of the period in which τ acts. The filter,
    with its model of noise, disturbance and bias, is that of ``kalman_observer``: the gyroscope's bias is estimated,
    and neither attitude nor rate is used as measured.

    Derivation: ë = −w + δ, so that with u = w − δ the error is a double integrator, and the regulator minimises

        J = Σ e² + u² / ω⁴,    k = (B'S B + 1/ω⁴)⁻¹ B'S A,    S = A'S A + diag(1, 0) − A'S B k,

    A and B those of a period T with u held (Anderson and Moore, 1990, Optimal Control, chapter 3). For short periods
    k = (ω², √2 ω): two Butterworth poles of bandwidth ω. By the separation theorem filter and regulator are optimal
    together for white Gaussian noise as declared. Robust they are not by themselves (Doyle, 1978): the densities of the
    disturbance say how fast δ̂ is, and so what the loop bears; they are gains, to be tuned by the margins.

    Sampled: both Riccati equations are solved by SciPy for the control period when the law is prepared. Samples that
    are lost or late, torques that are late or cut by the motors enter the filter's prediction (``past_commands``); it
    starts with the stationary gain. |δ̂| is kept to twice what the motors can do.

    Assumptions: nominal inertia; noise as declared. Stability: nominally guaranteed by both Riccati equations, e and ė
    being controllable, and all five states observable and excited by the declared noise.

    Defaults by ``wrist design``; the filter believes in the noise of realistic sensors.
    """

    status: ClassVar[LawStatus] = "rival"
    tracks_to: ClassVar[Bound] = Bound(2.9e-6, 4.5e-6)

    State = Estimate

    disturbance_walk: Positive = inherited(KalmanLaw, "disturbance_walk", 20.94)
    growth_walk: Positive = inherited(KalmanLaw, "growth_walk", 241.8)
    bandwidth: Positive = quantity(
        201.8, "1/s", "bandwidth ω of the regulator: 1/ω⁴ is the weight of w²", searched=(20.0, 500.0)
    )

    def designed(self, period: float) -> dict[str, Array]:
        """Return the gain of the filter (5, 2), and that of the regulator (2,) on e [1/s²] and ė [1/s]."""
        return {**super().designed(period), "regulator": regulator_gain(period, self.bandwidth)}

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        first = state.running < 0.5
        late, periods = arrive(signal, state)
        for i in range(3):
            estimate(signal, parameters.filter, state, i, late, periods, first)
        gain = parameters.regulator
        w = demand(signal, gain, state, 0, late), demand(signal, gain, state, 1, late)
        send(signal, (w[0], w[1], demand(signal, gain, state, 2, late)), command, state)


def demand(signal: Signal, gain: Array, state: Any, axis: int, late: float) -> float:
    """Return w [rad/s²] of one axis, from the estimates projected to the time at which it acts."""
    rate, mismatch, growth = state.rate_error[axis], state.mismatch[axis], state.growth[axis]
    turned, gained = project(state, axis, rate, mismatch, growth, late, signal.period)
    balanced = mismatch + growth * (late + 0.5) * signal.period
    return float(gain[0] * (state.error[axis] + turned) + gain[1] * (rate + gained) + balanced)


@lru_cache(maxsize=64)
def regulator_gain(period: float, bandwidth: float) -> Array:
    """Return the gain (2,) of the regulator for u = k (e, ė).

    Args:
        period: T [s].
        bandwidth: ω [1/s].

    Raises:
        LawError: see :func:`.riccati.riccati`.
    """
    h = bandwidth * period  # in units of 1/ω, in which the weights are 1; u pulls the other way
    A, B = np.array([[1.0, h], [0.0, 1.0]]), np.array([[0.5 * h * h], [h]])
    gain, _ = riccati(A, B, np.diag([1.0, 0.0]), np.eye(1), "bandwidth")
    found: Array = gain[0] * np.array([bandwidth**2, bandwidth])
    return found
