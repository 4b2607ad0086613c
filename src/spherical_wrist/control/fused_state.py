"""Attitude and rate error from an attitude sensor that is noisy and a rate sensor that is biased.

A rate that is integrated has little noise but drifts; an attitude does not drift but is noisy. With the measured errors
e [rad] and ė [rad/s], a bias b [rad/s] that is to be added to ė, and n periods T since the last sample,

    ê⁻ = ê + ½ n T (ρ + ρ'),    ν = e − ê⁻,    ê = ê⁻ + (1 − p₁ p₂) ν,    b̂ = b̂ + (1 − p₁)(1 − p₂) ν / T,

with ρ = ė + b̂ − ½ ê × (ė + b̂) + ê × (ê × (ė + b̂)) / 12, the rate of the log (of which the next term has |e|⁴ / 720),
and ρ' that of the last sample. The errors of ê and b̂ decay by the poles p = exp(−f T): the fixed-gain form of the
complementary filter with a bias (Mahony, Hamel and Pflimlin, 2008, IEEE Trans. Automatic Control 53(5):1203). Slow
poles average the attitude's noise over a second; a bias that drifts faster than they are is not followed.

The measured ė = R_e ω_d − ω has the attitude's noise in R_e. What it adds is (e − ê) × R_e ω_d, and is taken out.

A law that uses the filter derives its state from :class:`FusedState`.
"""

from math import exp
from typing import Any

from spherical_wrist.control.contract import LawState, Signal
from spherical_wrist.parameters import Vector, quantity
from spherical_wrist.so3 import Vector3, cross


class FusedState(LawState):
    """Estimates of the errors and of the rate's bias."""

    error: Vector = quantity(0.0, "rad", "estimated attitude error ê")
    rate_error: Vector = quantity(0.0, "rad/s", "rate error with the bias taken out")
    bias: Vector = quantity(0.0, "rad/s", "b̂, to be added to the measured rate error")
    log_rate: Vector = quantity(0.0, "rad/s", "rate ρ of the attitude error at the last sample")


def fuse(signal: Signal, state: Any, periods: int, fast: float, slow: float) -> None:
    """Take a sample: update the estimates.

    Args:
        signal: measured and desired state.
        state: of the filter, written.
        periods: periods since the sample before; 0 at the first one, which is taken as it is.
        fast: first pole f₁ [1/s].
        slow: second pole f₂ [1/s].
    """
    T, measured, b = signal.period, signal.error, state.bias
    p, q = exp(-fast * T), exp(-slow * T)
    share, drift = 1.0 - p * q, (1.0 - p) * (1.0 - q) / T
    de = signal.rate_error
    now = log_rate((measured[0], measured[1], measured[2]), (de[0] + b[0], de[1] + b[1], de[2] + b[2]))
    for i in range(3):
        if periods == 0:
            state.error[i] = measured[i]
        else:
            predicted = state.error[i] + 0.5 * periods * T * (now[i] + state.log_rate[i])
            off = measured[i] - predicted
            state.error[i] = predicted + share * off
            b[i] += drift * off
        state.log_rate[i] = now[i]
    off_now = (measured[0] - state.error[0], measured[1] - state.error[1], measured[2] - state.error[2])
    w = signal.rate
    noise = cross(off_now, (de[0] + w[0], de[1] + w[1], de[2] + w[2]))
    for i in range(3):
        state.rate_error[i] = de[i] + b[i] - noise[i]


def log_rate(e: Vector3, rate: Vector3) -> Vector3:
    """Return the rate of e = log(q⁻¹ q_d) [rad/s], from the rate error [rad/s], to third order in e."""
    once = cross(e, rate)
    twice = cross(e, once)
    return (
        rate[0] - 0.5 * once[0] + twice[0] / 12.0,
        rate[1] - 0.5 * once[1] + twice[1] / 12.0,
        rate[2] - 0.5 * once[2] + twice[2] / 12.0,
    )
