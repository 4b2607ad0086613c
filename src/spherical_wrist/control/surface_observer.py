"""Observer of the model mismatch from a linear surface, with any poles and a ramp that decays; late samples are known.

Let S = λ e + ė, and let w [rad/s²] be what a law asks for beyond the feed-forward: Ṡ = λ ė + δ − γ w, where δ is all
that the model misses and γ the gain of the input, 1 on the nominal plant. Modelled as δ̇ = g, ġ = −a g, a period T is

    Ŝ⁺ = Ŝ + T (δ̂ + ½ T ĝ + λ ė − γ̂ w),    δ̂⁺ = δ̂ + T ĝ,    ĝ⁺ = ρ ĝ,    ρ = exp(−a T),

and the innovation r = S − Ŝ corrects by l₁ r, l₂ r / T and l₃ r / T². With a → 0 it is the g-h-k filter; the decay
keeps the ramp from overshooting where δ jumps. The gains place the three poles of the error: with q = 1 − p of each
pole p, and s₁, s₂, s₃ the elementary symmetric sums of the three q,

    k₁ = s₁ − σ,    k₂ = (s₂ − k₁ σ − ½ s₃) / (1 − ½ σ),    k₃ = s₃ − σ k₂,    σ = 1 − ρ,
    l₃ = k₃ / ρ,    l₂ = k₂ − l₃,    l₁ = k₁ − l₂ − ½ l₃,

by equating det(z I − A + A L C) with ∏ (z − p), where A is the period above. It is an extended state observer in the
sense of Han (2009), *From PID to active disturbance rejection control*, IEEE Trans. Industrial Electronics 56(3):900.

The w that acted before a sample, and those that are about to act, are those of ``past_commands``. A law that uses the
observer derives its state from :class:`Observed`.
"""

from math import cos, exp, floor, sqrt
from typing import Any, NamedTuple

from spherical_wrist.control.past_commands import PAST, PastCommands
from spherical_wrist.parameters import Vector, quantity


class Observed(PastCommands):
    """State of the observer, per axis."""

    surface: Vector = quantity(0.0, "rad/s", "estimated surface Ŝ")
    mismatch: Vector = quantity(0.0, "rad/s²", "estimated mismatch δ̂")
    growth: Vector = quantity(0.0, "rad/s³", "its rate of change ĝ")


class Gains(NamedTuple):
    """Corrections by the innovation: of Ŝ, of T δ̂ and of T² ĝ."""

    surface: float
    mismatch: float
    growth: float


def gains(real: float, pair: float, damping: float, decay: float, period: float) -> Gains:
    """Return the gains for a real pole, and a pair of natural frequency ``pair`` and damping ratio up to 1.

    Args:
        real: real pole [1/s].
        pair: natural frequency of the pair [1/s].
        damping: damping ratio of the pair.
        decay: a [1/s].
        period: T [s].
    """
    rho = exp(-decay * period)
    radius = exp(-damping * pair * period)
    both = 2.0 * radius * cos(pair * period * sqrt(max(0.0, 1.0 - damping * damping)))
    q, total, product = 1.0 - exp(-real * period), 2.0 - both, 1.0 - both + radius * radius
    s1, s2, s3 = q + total, q * total + product, q * product
    sigma = 1.0 - rho
    k1 = s1 - sigma
    k2 = (s2 - k1 * sigma - 0.5 * s3) / (1.0 - 0.5 * sigma)
    l3 = (s3 - sigma * k2) / rho
    l2 = k2 - l3
    return Gains(k1 - l2 - 0.5 * l3, l2, l3)


class Foreseen(NamedTuple):
    """Changes of the errors until the next torque acts, and the mismatch while it does.

    Attributes:
        turned: change of e [rad].
        gained: change of ė [rad/s].
        mismatch: δ [rad/s²] in the middle of the period.
    """

    turned: float
    gained: float
    mismatch: float


def foresee(
    state: Any, axis: int, rate_error: float, late: float, gain: float, decay: float, period: float
) -> Foreseen:
    """Predict the errors from the sample until the time at which the next torque acts.

    Args:
        state: of the observer.
        axis: axis.
        rate_error: ė at the sample [rad/s].
        late: lateness of the sample, in periods.
        gain: γ̂ of the input.
        decay: a [1/s].
        period: T [s].
    """
    whole = floor(late)
    turned, gained, mismatch, growth = 0.0, 0.0, state.mismatch[axis], state.growth[axis]
    for j in range(whole + 1):
        span = period * (late - whole) if j == 0 else period
        w = gain * state.past[axis, min(PAST - 1, whole - j)]
        acceleration = mismatch + 0.5 * growth * span - w
        turned += span * (rate_error + gained + 0.5 * span * acceleration)
        gained += span * acceleration
        left = exp(-decay * span)
        mismatch += 0.5 * growth * span * (1.0 + left)
        growth *= left
    return Foreseen(turned, gained, mismatch + 0.5 * period * growth)
