"""Observer of the model mismatch from the sliding surface, with samples that are late and torques that act late.

With τ = N + H (q̈_d + w) a wrist whose model is right follows ë = −w. Let δ [rad/s²] be all that makes it ë = −w + δ,
and S = ė + c(e) any surface with Ṡ = ë + g, g known. Then Ṡ = δ + g − w, for which, with δ̈ taken for zero,

    Ŝ⁺ = Ŝ + T (δ̂ + ½ T δ̂' + g − w),    δ̂⁺ = δ̂ + T δ̂',    δ̂'⁺ = δ̂'

predicts one period T, and the innovation r = S − Ŝ corrects by (1 − p³) r, 3/2 (1 − p²)(1 − p) r / T and
(1 − p)³ r / T²: the error then has the triple pole p = exp(−ω T), the critically damped g-h-k filter (Brookner, 1998).
In continuous time δ − δ̂ = (s + 3 ω) δ̈ / (s + ω)³, or 3 δ̈ / ω² where δ changes slowly: it follows ramps without lag,
unlike that of a single integrator. It is an extended state observer in the sense of Han (2009).

The w that acted before a sample, and those that are about to act, are those of ``past_commands``. A law that uses the
observer derives its state from :class:`Mismatch`.
"""

from math import exp
from typing import Any

from spherical_wrist.control.past_commands import PAST, PastCommands, asked, project
from spherical_wrist.parameters import Vector, quantity


class Mismatch(PastCommands):
    """State of the observer, per axis."""

    surface: Vector = quantity(0.0, "rad/s", "estimated surface Ŝ")
    mismatch: Vector = quantity(0.0, "rad/s²", "estimated mismatch δ̂")
    growth: Vector = quantity(0.0, "rad/s³", "its rate of change δ̂'")


def observe(
    state: Any,
    axis: int,
    surface: float,
    known: float,
    periods: int,
    late: float,
    period: float,
    bandwidth: float,
    limit: float,
) -> None:
    """Update the observer with a sample of the surface.

    Args:
        state: the observer's, written.
        axis: axis of the sample.
        surface: S [rad/s].
        known: g [rad/s²] at the sample.
        periods: number of periods since the last sample that was taken; 0 takes none.
        late: lateness of the sample, in periods.
        period: T [s].
        bandwidth: ω [1/s].
        limit: largest δ̂ [rad/s²]; a motor at its limit would otherwise wind it up.
    """
    for n in range(periods):
        w = asked(state, axis, late + periods - 1 - n)
        state.surface[axis] += period * (state.mismatch[axis] + 0.5 * period * state.growth[axis] + known - w)
        state.mismatch[axis] += period * state.growth[axis]
    if periods > 0:
        p = exp(-bandwidth * period)
        innovation = surface - state.surface[axis]
        state.surface[axis] += (1.0 - p * p * p) * innovation
        state.mismatch[axis] += 1.5 * (1.0 - p * p) * (1.0 - p) * innovation / period
        state.growth[axis] += (1.0 - p) * (1.0 - p) * (1.0 - p) * innovation / (period * period)
        if abs(state.mismatch[axis]) > limit:
            state.mismatch[axis] = min(limit, max(-limit, state.mismatch[axis]))
            state.growth[axis] = 0.0


def foresee(state: Any, axis: int, rate_error: float, late: float, period: float) -> tuple[float, float, float]:
    """Predict the errors from the sample until the time at which the next torque acts.

    Returns:
        The changes of the error e [rad] and of its rate ė [rad/s], and the mismatch δ [rad/s²] in the middle of the
        period in which that torque acts.
    """
    mismatch, growth = state.mismatch[axis], state.growth[axis]
    turned, gained = project(state, axis, rate_error, mismatch, growth, late, period)
    return turned, gained, mismatch + growth * (late + 0.5) * period


def start(state: Any, axis: int, surface: float) -> None:
    """Begin at the first sample of the surface, with no mismatch known."""
    state.surface[axis] = surface
    state.mismatch[axis] = 0.0
    state.growth[axis] = 0.0
    for j in range(PAST):
        state.past[axis, j] = 0.0
