"""Incremental nonlinear dynamic inversion: the torque that was given, corrected by the acceleration that it missed."""

from math import cos, cosh, exp, sqrt
from typing import Any, ClassVar

from spherical_wrist.control.contract import Bound, Command, LawStatus, ModelBasedLaw, Signal
from spherical_wrist.control.linear_feedback import critically_damped
from spherical_wrist.control.past_commands import PastCommands, arrive, asked, project, send
from spherical_wrist.control.torque_limit import largest_mismatch, limited
from spherical_wrist.parameters import Positive, Vector, quantity


class INDI(ModelBasedLaw):
    """INDI: τ = τ_f + H (ν − ω̇_f), ν = q̈_d + ω_c² e + 2 ω_c ė, the torque and the acceleration filtered alike.

    e [rad], ė [rad/s], body frame, are the errors, q̈_d [rad/s²] the feed-forward, H [kg·m²] the nominal inertia; τ_f
    [N·m] is the torque that acted and ω̇_f [rad/s²] the acceleration that was measured, both behind the same low-pass

        F(s) = ω_f² / (s² + 2 ζ ω_f s + ω_f²).

    Derivation (Sieberling, Chu and Mulder, 2010; Smeur, Chu and de Croon, 2016): to first order about the state a
    moment ago ω̇ = ω̇₀ + H⁻¹ (τ − τ₀), since what depends on attitude and rate changes little within the filter's lag;
    ω̇ = ν gives the increment. The acceleration is the difference of two rate samples; it and τ pass the same filter,
    and are of the same time, or the increment would be that of another moment. Here the nominal N [N·m] is known, and
    the increment is that of all but N: with w and δ [rad/s²] of ``past_commands``, dė/dt = −w + δ, and w̄ the mean of w
    over the period between two samples,

        w = ω_c² e + 2 ω_c ė + δ_f,    δ_f = F(z) ((ė − ė⁻) / T + w̄).

    Its linear form shows what it is: ė and w in δ_f cancel but for F (δ), so that INDI is a disturbance observer with F
    for its Q-filter and ë + 2 ω_c ė + ω_c² e = (1 − F) δ; a constant δ leaves nothing, a slow one 2 ζ δ̇ / (ω_f ω_c²).

    Sampled: F has the poles exp(s T) of its own and no zeros, and the gain 1 at rest. Lateness that is known shifts τ
    against the samples and projects e and ė (``past_commands``). The torque that is remembered is within the motors'
    limits, so that nothing winds up; |δ_f| is kept to twice what they can do.

    Assumptions: nominal inertia; δ slow against the filter. Stability: F and feedback are in cascade, and stable for
    all positive parameters. On a plant m times as heavy δ depends on w, and the margins decide.

    Defaults by ``wrist design``.
    """

    status: ClassVar[LawStatus] = "rival"
    tracks_to: ClassVar[Bound] = Bound(8.4e-6, 1.3e-5)

    class State(PastCommands):
        """Filter of the missed acceleration, and memory of the commands."""

        rate_error: Vector = quantity(0.0, "rad/s", "rate error of the last sample")
        missed: Vector = quantity(0.0, "rad/s²", "filtered acceleration δ_f that the command missed")
        before: Vector = quantity(0.0, "rad/s²", "the same one period ago")

    bandwidth: Positive = quantity(112.4, "1/s", "bandwidth ω_c of the feedback", searched=(20.0, 500.0))
    filter_bandwidth: Positive = quantity(730.1, "1/s", "bandwidth ω_f of the filter", searched=(50.0, 2000.0))
    damping_ratio: Positive = quantity(0.5404, "", "damping ratio ζ of the filter", searched=(0.4, 2.0))

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        late, periods = arrive(signal, state)
        for i in range(3):
            if periods > 0:
                measure(signal, parameters, state, i, late, periods)
            state.rate_error[i] = signal.rate_error[i]
        w = demand(signal, parameters, state, 0, late), demand(signal, parameters, state, 1, late)
        send(signal, (w[0], w[1], demand(signal, parameters, state, 2, late)), command, state)


def measure(signal: Signal, parameters: Any, state: Any, axis: int, late: float, periods: int) -> None:
    """Filter the acceleration that the command missed since the last sample, ``periods`` ago."""
    missed = (signal.rate_error[axis] - state.rate_error[axis]) / (periods * signal.period)
    for n in range(periods):
        missed += asked(state, axis, late + n) / periods
    first, second = poles(parameters.filter_bandwidth * signal.period, parameters.damping_ratio)
    most = largest_mismatch(signal, axis)
    for _ in range(periods):
        now = first * state.missed[axis] + second * state.before[axis] + (1.0 - first - second) * missed
        state.before[axis] = state.missed[axis]
        state.missed[axis] = limited(now, most)


def poles(angle: float, damping_ratio: float) -> tuple[float, float]:
    """Return the coefficients a, b of y⁺ = a y + b y⁻ with the poles of F, exp(s T).

    Args:
        angle: ω_f T.
        damping_ratio: ζ.
    """
    fast = exp(-damping_ratio * angle)
    inside = 1.0 - damping_ratio * damping_ratio
    swing = cos(angle * sqrt(inside)) if inside > 0.0 else cosh(angle * sqrt(-inside))
    return 2.0 * fast * swing, -fast * fast


def demand(signal: Signal, parameters: Any, state: Any, axis: int, late: float) -> float:
    """Return w [rad/s²] of one axis, from the sample projected to the time at which it acts."""
    rate, missed = signal.rate_error[axis], state.missed[axis]
    turned, gained = project(state, axis, rate, missed, 0.0, late, signal.period)
    k0, k1 = critically_damped(parameters.bandwidth, signal.period)
    return float(k0 * (signal.error[axis] + turned) + k1 * (rate + gained) + missed)
