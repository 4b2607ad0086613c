"""L1 adaptive control: an estimate that adapts as fast as samples come, of which a low-pass filter lets through."""

from math import exp
from typing import Any, ClassVar

from spherical_wrist.control.contract import Bound, Command, LawStatus, ModelBasedLaw, Signal
from spherical_wrist.control.linear_feedback import critically_damped
from spherical_wrist.control.past_commands import PastCommands, arrive, asked, project, send
from spherical_wrist.control.torque_limit import largest_mismatch, limited
from spherical_wrist.parameters import Positive, Vector, quantity


class L1Adaptive(ModelBasedLaw):
    """L1 adaptive control: τ = N + H (q̈_d + w), w = ω_m² e + 2 ω_m ė + C(s) σ̂, with C(s) = ω_l / (s + ω_l).

    e [rad], ė [rad/s], body frame, are the errors, H [kg·m²] and N [N·m] the nominal model's, q̈_d [rad/s²] the
    feed-forward. Per axis ë = −w + σ, where σ [rad/s²] is all that the model misses. A predictor of the rate error and
    the adaptation, which is constant from sample to sample, are

        dv̂/dt = −w + σ̂ − a (v̂ − ė),    σ̂ = −Φ⁻¹ exp(−a T) (v̂ − ė),    Φ = ∫ exp(−a t) dt ≈ T over a period,

    Derivation (Hovakimyan and Cao, 2010): this is the law of L1 Adaptive Control Theory that is constant from sample to
    sample. The predictor's error ṽ = v̂ − ė obeys dṽ/dt = −a ṽ + σ̂ − σ. The σ̂ of a sample makes its own share of ṽ
    vanish at the next one, so that ṽ is there −T σ̄, σ̄ being the mean of σ over the period, and σ̂ = exp(−a T) σ̄: the
    adaptation is as fast as the samples allow, and what makes the loop robust is not its gain but the filter C, whose
    bandwidth is traded against the delay margin. With C = 1 the error obeys (s + ω_m)² e = 0.

    What is left is (s + ω_m)² e = (1 − C exp(−a T)) σ: of a slow σ the share s/ω_l + a T. The latter stays for good, as
    the law was published; a is therefore small. The theory asks for ‖G (1 − C)‖ L < 1 in the L1 norm, with
    G = 1/(s + ω_m)² and a σ that changes with e by at most L; it knows neither a torque that is held for a period nor
    a late one, so that here the margins decide.

    Known lateness shifts w against the samples in the predictor, and projects e and ė (``past_commands``). The w of the
    predictor is what the motors can give, so that σ̂ does not wind up; |σ̂| is kept to twice that.

    Assumptions: nominal inertia; bounded σ and dσ/dt. Stability: predictor, filter and feedback are in cascade for a σ
    that does not depend on the error, stable for all positive parameters.

    Defaults by ``wrist design``.
    """

    status: ClassVar[LawStatus] = "rival"
    tracks_to: ClassVar[Bound] = Bound(7.9e-6, 1.3e-5)

    class State(PastCommands):
        """Predictor, estimate and filter, and memory of the commands."""

        rate_error: Vector = quantity(0.0, "rad/s", "rate error of the last sample")
        predicted: Vector = quantity(0.0, "rad/s", "rate error v̂ that was predicted for it")
        estimate: Vector = quantity(0.0, "rad/s²", "estimate σ̂ of what the model misses")
        filtered: Vector = quantity(0.0, "rad/s²", "the same behind the filter C")

    bandwidth: Positive = quantity(124.6, "1/s", "bandwidth ω_m of the desired dynamics", searched=(20.0, 500.0))
    filter_bandwidth: Positive = quantity(828.5, "1/s", "bandwidth ω_l of the filter C", searched=(50.0, 2000.0))
    predictor: Positive = quantity(0.001, "1/s", "rate a at which the predictor forgets", gain=False)

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        running = state.running > 0.5
        late, periods = arrive(signal, state)
        for i in range(3):
            if periods > 0:
                adapt(signal, parameters, state, i, late, periods)
            if not running:
                state.predicted[i] = signal.rate_error[i]
            state.rate_error[i] = signal.rate_error[i]
        w = demand(signal, parameters, state, 0, late), demand(signal, parameters, state, 1, late)
        send(signal, (w[0], w[1], demand(signal, parameters, state, 2, late)), command, state)


def adapt(signal: Signal, parameters: Any, state: Any, axis: int, late: float, periods: int) -> None:
    """Predict a sample that came ``periods`` after the last, adapt σ̂ by what the prediction missed, and filter it."""
    T = signal.period
    forget, p = exp(-parameters.predictor * T), exp(-parameters.filter_bandwidth * T)
    off = forget * (state.predicted[axis] - state.rate_error[axis]) + T * state.estimate[axis]
    for n in range(periods):
        off -= T * asked(state, axis, late + n)
    off = (state.rate_error[axis] + off - signal.rate_error[axis]) / periods  # the mean over samples that were lost
    state.predicted[axis] = signal.rate_error[axis] + off
    state.estimate[axis] = limited(-forget * off / T, largest_mismatch(signal, axis))
    for _ in range(periods):
        state.filtered[axis] += (1.0 - p) * (state.estimate[axis] - state.filtered[axis])


def demand(signal: Signal, parameters: Any, state: Any, axis: int, late: float) -> float:
    """Return w [rad/s²] of one axis, from the sample projected to the time at which it acts."""
    rate, filtered = signal.rate_error[axis], state.filtered[axis]
    turned, gained = project(state, axis, rate, filtered, 0.0, late, signal.period)
    k0, k1 = critically_damped(parameters.bandwidth, signal.period)
    return float(k0 * (signal.error[axis] + turned) + k1 * (rate + gained) + filtered)
