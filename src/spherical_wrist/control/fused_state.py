"""Attitude and rate error from an attitude sensor that is noisy and a rate sensor that is biased.

A rate that is integrated has little noise but drifts; an attitude does not drift but is noisy. With the measured errors
e [rad] and ė [rad/s], a bias b [rad/s] that is to be added to ė, and n periods T since the last sample,

    ê⁻ = ê + ½ n T (ρ + ρ'),    ν = e − ê⁻,    ê = ê⁻ + l₁ ν,    b̂ = b̂ + l₂ ν,

with ρ = ė + b̂ − ½ ê × (ė + b̂) + ê × (ê × (ė + b̂)) / 12, the rate of the log (of which the next term has |e|⁴ / 720),
and ρ' that of the last sample. The gains are those of a Kalman filter of each axis (Farrenkopf, 1978, J. Guidance and
Control 1(4):282): with P the covariance of ê and b̂, σ_ω the noise of the rate, q_b the walk of its bias and
F = [[1, n T], [0, 1]],

    P⁻ = F P Fᵀ + n diag(T² σ_ω², T q_b²),    l = P⁻ (1, 0)ᵀ / (P⁻₁₁ + σ_a²),    P = P⁻ − l (1, 0) P⁻.

The attitude's noise σ_a is measured: two values of ν that follow one another differ by √2 σ_a on average, whatever the
torques do and however far ê is off. So attitudes without noise are taken as they are, and noisy ones are averaged for
as long as the rate and its bias allow. It follows a noise that changes, at a rate that is given; the first samples
count more. A bias that drifts faster than q_b is not followed.

The measured ė = R_e ω_d − ω has the attitude's noise in R_e. What it adds is (e − ê) × R_e ω_d, and is taken out.

A law that uses the filter derives its state from :class:`FusedState`.
"""

from math import pi, sqrt
from typing import Any, NamedTuple

from spherical_wrist.control.contract import LawState, Signal
from spherical_wrist.parameters import Vector, quantity
from spherical_wrist.so3 import Vector3, cross

_Three = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
_NONE: _Three = ((0.0, 0.0, 0.0),) * 3

FIRST_WEIGHT = 0.1
"""Weight of the first ν in σ_a: what is assumed at the start counts as much as ten samples."""
CHANGE_TO_DEVIATION = sqrt(pi) / 2.0
"""σ / E|x − x'| = √π / 2 of two independent normal numbers."""


class FusedState(LawState):
    """Estimates of the errors and of the rate's bias, per axis."""

    error: Vector = quantity(0.0, "rad", "estimated attitude error ê")
    rate_error: Vector = quantity(0.0, "rad/s", "rate error with the bias taken out")
    bias: Vector = quantity(0.0, "rad/s", "b̂, to be added to the measured rate error")
    log_rate: Vector = quantity(0.0, "rad/s", "rate ρ of the attitude error at the last sample")
    deviation: Vector = quantity(0.0, "rad", "deviation ν of the last attitude from the predicted one")
    attitude_noise: Vector = quantity(0.0, "rad", "estimated standard deviation σ_a of the attitude's noise")
    weight: float = quantity(FIRST_WEIGHT, "", "weight of a sample in σ_a")
    uncertainty: _Three = quantity(_NONE, "", "variance of ê [rad²], covariance, variance of b̂ [rad²/s²]")


class Noise(NamedTuple):
    """Noise that the filter believes in.

    Attributes:
        rate: σ_ω of each axis [rad/s].
        attitude: σ_a that is assumed at the start [rad].
        bias: standard deviation of the bias at the start [rad/s].
        walk: density q_b of the bias's random walk [rad/(s·s½)].
        memory: rate at which σ_a is estimated [1/s].
    """

    rate: Vector3
    attitude: float
    bias: float
    walk: float
    memory: float


def fuse(signal: Signal, state: Any, periods: int, noise: Noise) -> None:
    """Take a sample: update the estimates.

    Args:
        signal: measured and desired state.
        state: of the filter, written.
        periods: periods since the sample before; 0 at the first one, which is taken as it is.
        noise: noise that is believed.
    """
    T, measured, b, P = signal.period, signal.error, state.bias, state.uncertainty
    span = periods * T
    de = signal.rate_error
    now = log_rate((measured[0], measured[1], measured[2]), (de[0] + b[0], de[1] + b[1], de[2] + b[2]))
    for i in range(3):
        if periods == 0:
            state.error[i], state.attitude_noise[i] = measured[i], noise.attitude
            P[i, 0], P[i, 1], P[i, 2] = noise.attitude * noise.attitude, 0.0, noise.bias * noise.bias
        else:
            predicted = state.error[i] + 0.5 * span * (now[i] + state.log_rate[i])
            off = measured[i] - predicted
            change = CHANGE_TO_DEVIATION * abs(off - state.deviation[i])
            state.attitude_noise[i] += state.weight * (change - state.attitude_noise[i])
            state.deviation[i] = off
            rate, attitude = noise.rate[i] * T, state.attitude_noise[i]
            a = P[i, 0] + 2.0 * span * P[i, 1] + span * span * P[i, 2] + periods * rate * rate
            c = P[i, 1] + span * P[i, 2]
            d = P[i, 2] + span * noise.walk * noise.walk
            variance = a + attitude * attitude
            share, drift = (a / variance, c / variance) if variance > 0.0 else (1.0, 0.0)
            state.error[i] = predicted + share * off
            b[i] += drift * off
            P[i, 0], P[i, 1], P[i, 2] = a - share * a, c - share * c, d - drift * c
        state.log_rate[i] = now[i]
    if periods > 0:
        state.weight = max(min(1.0, noise.memory * span), state.weight / (1.0 + state.weight))
    off_now = (measured[0] - state.error[0], measured[1] - state.error[1], measured[2] - state.error[2])
    w = signal.rate
    turned = cross(off_now, (de[0] + w[0], de[1] + w[1], de[2] + w[2]))
    for i in range(3):
        state.rate_error[i] = de[i] + b[i] - turned[i]


def log_rate(e: Vector3, rate: Vector3) -> Vector3:
    """Return the rate of e = log(q⁻¹ q_d) [rad/s], from the rate error [rad/s], to third order in e."""
    once = cross(e, rate)
    twice = cross(e, once)
    return (
        rate[0] - 0.5 * once[0] + twice[0] / 12.0,
        rate[1] - 0.5 * once[1] + twice[1] / 12.0,
        rate[2] - 0.5 * once[2] + twice[2] / 12.0,
    )
