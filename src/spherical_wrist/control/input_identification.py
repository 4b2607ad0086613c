"""Identification on line of what nobody said of the input: its gain, and how much later than known it acts.

If the plant is heavier or lighter than the model, or a delay is not known, the observer's innovations correlate with
the law's own past commands. To first order in the errors Δγ of the gain and Δd [periods] of the delay, the innovation
is

    r = h_γ Δγ + h_d Δd + noise,

where h_γ and h_d are what the innovation of the observer itself answers to −w and to γ̂ (w − w'), w' being w one
period earlier: copies of the observer's error dynamics, driven by these. A Kalman filter with random walks of γ and d
and these two regressors estimates both (Ljung, 1999, *System Identification*, chapter 11). The variance of its
measurement is the noise's σ² + c r²: a large innovation is a disturbance rather than news of the input, and counts
little. Estimates are kept within bounds, and leak to 1 and 0: a disturbance that keeps time with the commands would
otherwise drive them on for as long as it lasts.

While a loop follows smoothly, its commands are an echo of the disturbance, and say nothing of the input: the estimates
would drift, until the loop oscillates and they are learnt anew. So a degree of trust, which a law gives, says how far
the innovation is news; with none, the estimates rest, but for a share of the leak.

A law that uses it derives its state from :class:`Identified`.
"""

from typing import Any

from spherical_wrist.control.contract import LawState
from spherical_wrist.control.surface_observer import Gains
from spherical_wrist.parameters import Vector, quantity

_Three = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
_NONE: _Three = ((0.0, 0.0, 0.0),) * 3
LEAST_GAIN, MOST_GAIN, MOST_DELAY = 0.9, 3.0, 2.5
"""Bounds of the estimates: of γ, and of d [periods]. A gain that is believed too small makes the loop faster."""
OUTSIDE = 0.5
"""Rate at which a delay is forgotten while a gain below the bound is asked for [1/s]. That is the mark of a torque from
outside: a sine that lasts would otherwise pass for a delay."""
HELD = 0.1
"""Share of the leak while nothing is learnt."""


class Identified(LawState):
    """State of the identification, per axis."""

    gain: Vector = quantity(1.0, "", "estimated gain γ̂ of the input")
    delay: Vector = quantity(0.0, "", "estimated delay d̂ that is not known, in periods")
    covariance: _Three = quantity(((0.09, 0.0, 0.25),) * 3, "", "variance of γ̂, covariance, variance of d̂")
    gain_response: _Three = quantity(_NONE, "", "copy of the observer that answers to −w")
    delay_response: _Three = quantity(_NONE, "", "copy of the observer that answers to γ̂ (w − w')")


def drive(state: Any, axis: int, newer: float, older: float, rho: float, period: float) -> None:
    """Move the copies of the observer on by a period.

    Args:
        state: of the identification, written.
        axis: axis.
        newer: w that acted [rad/s²].
        older: w of one period earlier [rad/s²].
        rho: factor by which the ramp decays in a period.
        period: T [s].
    """
    for copy, change in ((state.gain_response, -newer), (state.delay_response, state.gain[axis] * (newer - older))):
        copy[axis, 0] += period * (copy[axis, 1] + 0.5 * period * copy[axis, 2] + change)
        copy[axis, 1] += period * copy[axis, 2]
        copy[axis, 2] *= rho


def identify(
    state: Any, axis: int, innovation: float, noise: float, trust: float, discount: float, gain_walk: float,
    delay_walk: float, leak: float, correction: Gains, period: float,
) -> None:  # fmt: skip
    """Take an innovation: update the estimates, then correct the copies as the observer is.

    Args:
        state: of the identification, written.
        axis: axis.
        innovation: r [rad/s].
        noise: σ, standard deviation of the innovations [rad/s].
        trust: degree, 0 to 1, to which the innovation is news of the input.
        discount: factor c on r² in the variance of the measurement.
        gain_walk: standard deviation of the change of γ per sample that is news.
        delay_walk: standard deviation of the change of d per sample that is news [periods].
        leak: part of the estimates' deviation from 1 and 0 that such a sample takes away.
        correction: gains of the observer.
        period: T [s].
    """
    gain, delay, left = state.gain[axis], state.delay[axis], leak * (HELD + (1.0 - HELD) * trust)
    gain, delay = gain + left * (1.0 - gain), delay - left * delay
    P = state.covariance
    a, b, c = P[axis, 0] + gain_walk * gain_walk, P[axis, 1], P[axis, 2] + delay_walk * delay_walk
    h, g = state.gain_response[axis, 0], state.delay_response[axis, 0]
    u, v = a * h + b * g, b * h + c * g
    variance = h * u + g * v + noise * noise + discount * innovation * innovation
    if trust > 0.0 and variance > 0.0:
        k, m = trust * u / variance, trust * v / variance
        gain, delay = gain + k * innovation, delay + m * innovation
        if gain < LEAST_GAIN:
            delay -= OUTSIDE * period * delay
        P[axis, 0], P[axis, 1], P[axis, 2] = a - k * u, b - k * v, c - m * v
    state.gain[axis] = min(MOST_GAIN, max(LEAST_GAIN, gain))
    state.delay[axis] = min(MOST_DELAY, max(0.0, delay))
    for copy in (state.gain_response, state.delay_response):
        answer = copy[axis, 0]
        copy[axis, 0] -= correction.surface * answer
        copy[axis, 1] -= correction.mismatch * answer / period
        copy[axis, 2] -= correction.growth * answer / (period * period)
