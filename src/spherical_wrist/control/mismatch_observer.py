"""What the model misses, estimated from the sliding surface, when samples are late and torques act late.

With τ = N + H (q̈_d + w) a wrist whose model is right follows ë = −w. Let δ [rad/s²] be all that makes it ë = −w + δ,
and S = ė + c(e) any surface with Ṡ = ë + g, g known. Then Ṡ = δ + g − w, for which, with δ̈ taken for zero,

    Ŝ⁺ = Ŝ + T (δ̂ + ½ T δ̂' + g − w),    δ̂⁺ = δ̂ + T δ̂',    δ̂'⁺ = δ̂'

predicts one period T, and the innovation r = S − Ŝ corrects by (1 − p³) r, 3/2 (1 − p²)(1 − p) r / T and
(1 − p)³ r / T²: the error then has the triple pole p = exp(−ω T), the critically damped g-h-k filter (Brookner, 1998).
In continuous time δ − δ̂ = (s + 3 ω) δ̈ / (s + ω)³, or 3 δ̈ / ω² where δ changes slowly: it follows ramps without lag,
unlike that of a single integrator. It is an extended state observer in the sense of Han (2009).

The torque that acts during the period before a sample is not the one that was asked for last: the sample is ``late``
periods old when it is used, the age of the sample and the lag of the motors together. So the w that were asked for are
kept, and what they are about to do is added to the sample. One axis has MEMORY numbers of state: Ŝ, δ̂, δ̂' and the past
of w.
"""

from math import exp, floor
from typing import Any

from spherical_wrist.control.contract import Array

PAST = 16
"""Periods for which what was asked for is kept: beyond that lateness the oldest stands for what came before."""

MEMORY = 3 + PAST


def asked(memory: Array, back: float) -> float:
    """The mean of w [rad/s²] over the period that ended ``back`` periods before now, any fraction of them."""
    whole = floor(back)
    part = back - whole
    newer, older = min(PAST - 1, whole), min(PAST - 1, whole + 1)
    mean: float = (1.0 - part) * memory[3 + newer] + part * memory[3 + older]
    return mean


def observe(
    memory: Any, surface: float, known: float, periods: int, late: float, period: float, bandwidth: float, limit: float
) -> None:
    """Takes a sample of the surface.

    Args:
        memory: of one axis.
        surface: S [rad/s].
        known: g [rad/s²] at the sample.
        periods: how many periods after the last one that was taken this sample is; 0 takes none.
        late: its lateness, in periods.
        period: T [s].
        bandwidth: ω [1/s].
        limit: largest δ̂ [rad/s²]; a motor at its limit would otherwise wind it up.
    """
    for n in range(periods):
        w = asked(memory, late + periods - 1 - n)
        memory[0] += period * (memory[1] + 0.5 * period * memory[2] + known - w)
        memory[1] += period * memory[2]
    if periods > 0:
        p = exp(-bandwidth * period)
        innovation = surface - memory[0]
        memory[0] += (1.0 - p * p * p) * innovation
        memory[1] += 1.5 * (1.0 - p * p) * (1.0 - p) * innovation / period
        memory[2] += (1.0 - p) * (1.0 - p) * (1.0 - p) * innovation / (period * period)
        if abs(memory[1]) > limit:
            memory[1] = min(limit, max(-limit, memory[1]))
            memory[2] = 0.0


def foresee(memory: Array, rate_error: float, late: float, period: float) -> tuple[float, float, float]:
    """What happens between the sample and the time at which the next torque acts.

    Returns:
        The changes of the error e [rad] and of its rate ė [rad/s], and the mismatch δ [rad/s²] in the middle of the
        period in which that torque acts.
    """
    whole = floor(late)
    turned, gained, passed = 0.0, 0.0, 0.0
    for j in range(whole + 1):
        span = period * (late - whole) if j == 0 else period
        acceleration = memory[1] + memory[2] * (passed + 0.5 * span) - memory[3 + min(PAST - 1, whole - j)]
        turned += span * (rate_error + gained + 0.5 * span * acceleration)
        gained += span * acceleration
        passed += span
    return turned, gained, memory[1] + memory[2] * (passed + 0.5 * period)


def remember(memory: Array, w: float) -> None:
    """Keeps what is asked for in the period that begins now [rad/s²]."""
    for j in range(PAST - 1, 0, -1):
        memory[3 + j] = memory[2 + j]
    memory[3] = w


def samples_since(before: float, late: float) -> int:
    """Periods between the last sample and this one, from the lateness of both: 0 where no new one came."""
    return max(0, min(PAST, int(1 + floor(before - late + 0.5))))


def start(memory: Any, surface: float) -> None:
    """Begins at the first sample of the surface, with no mismatch known."""
    for j in range(MEMORY):
        memory[j] = 0.0
    memory[0] = surface
