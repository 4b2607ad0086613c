"""Our law: a sliding surface of fused sensors, an observer at a fuzzy bandwidth, and an input identified on line."""

from collections.abc import Mapping
from math import exp, tanh
from typing import Any, ClassVar

from spherical_wrist.control.contract import Bound, Command, LawStatus, ModelBasedLaw, Signal
from spherical_wrist.control.fused_state import FusedState, fuse
from spherical_wrist.control.input_identification import Identified, drive, identify
from spherical_wrist.control.past_commands import arrive, asked, send
from spherical_wrist.control.surface_observer import Observed, foresee, gains
from spherical_wrist.control.torque_limit import largest_integral, largest_mismatch, limited
from spherical_wrist.parameters import NonNegative, Positive, PositiveVector, Vector, quantity

CLIP = 3.0
"""Innovations beyond so many standard deviations say no more about the noise."""
MEAN_TO_DEVIATION = 1.2533
"""σ / E|x| = √(π/2) of a normal distribution."""
INTEGRAL_SHARE = 0.05
"""Share of what the motors can do that the integral may ask for."""


class FuzzyObserverSliding(ModelBasedLaw):
    """A linear sliding surface of fused sensors, and an observer of the mismatch whose bandwidth fuzzy rules set.

    Precision comes from the observer, chattering from the noise that its bandwidth lets through; so fuzzy rules choose
    that bandwidth. Per axis, in the body frame, with e and ė of ``fused_state``,

        S = λ e + ė,                                                                   the surface,
        w = (λ ė + κ_T φ tanh((S + k_I ∫S dt) / φ) + δ̂ + Q(z) r) / γ̂,
        τ = N + H (q̈_d + w),                                                           the torque,

    where κ_T = (1 − exp(−κ' T)) / T, with which a torque that is held makes S decay from sample to sample as exp(−κ' t)
    does; δ̂ is the mismatch that ``surface_observer`` estimates from S, r its innovation, Q(z) = (q₁ z⁻¹ − q₀) /
    (T (1 − p z⁻¹)²), and γ̂ the gain of the input, which ``input_identification`` estimates with the delay that nobody
    knows of. N, H and q̈_d are those of the middle of the period in which τ acts; S, e and ė are foreseen until its
    beginning, from the w that were asked for. ∫S dt sums the foreseen S, no more than φ of each, before it is used.

    Fuzzy rules. Let a be the largest recent innovation in standard deviations σ̂ of the noise, forgotten at the rate
    ``memory``. Two sets of a add up to one, quiet below ``quiet`` and surprised beyond ``surprising``:

        IF a is quiet THEN the factor is 1,    IF a is surprised THEN the factor is ``surprised``

    (Sugeno, order zero). All poles of the observer and κ' = factor · κ are multiplied by it. Noise alone seldom
    surprises, so that it meets the low bandwidth; a disturbance that would leave an error shows in the innovation a
    period after it began, and meets the high one. σ̂ follows the noise, from 1.25 times the mean size of the
    innovations, and not below ``floor``.

    Why it works. The wrist obeys ë = −γ w + δ, so that S decays like Ṡ = −κ_T φ tanh(…) + (δ − δ̂) − Q(z) r. For a fixed
    factor the loop is linear within the layer φ, and on the nominal plant its poles are those of the surface (λ), of
    reaching (κ', k_I), of the observer and of Q: the innovation that Q is fed by does not depend on the commands there
    (Youla, Jabr and Bongiorno, 1976). Each of the two frozen loops is stable.
    That switching between them, and the identification, leave the loop stable on every plant is *not proven*. In its
    place stand the bounds of the estimates (γ̂ ≥ 0.9, at most 1.5 periods of delay, δ̂ within twice what the motors give)
    and the adversary's set of the tests.

    The gains come from one search (CMA-ES) over a model of one axis, for all of this at once: the errors under
    constant, sinusoidal, square and worst torques at 0.5 to 1.5 of the mass; tip error and chattering on realistic
    hardware; a sensitivity of at most 2.0, or 2.35 with late samples; and the delays that it must bear unknown. That
    search is not part of the package; the tests assert what it promised of the whole wrist. ``wrist design`` searches
    around them by the criterion of all laws. They keep it but for ``exempt``. Gains that keep all of it were found up
    to 1.5 times off, at twice the chattering or three times the error under square waves; none so far within the
    ranges that are declared, 1.25 times.
    """

    status: ClassVar[LawStatus] = "ours"
    has_surface: ClassVar[bool] = True
    tracks_to: ClassVar[Bound] = Bound(2.0e-6, 3.2e-6)
    gains_from: ClassVar[str] = "a search over a model of one axis, outside of the package"
    exempt: ClassVar[Mapping[str, str]] = {
        "restlessness": "at half the mass it oscillates with 1.5 ms of known delay and 1 ms of lag, and is restless "
        "with 0.5 ms that nobody knows of",
    }
    promises: ClassVar[Mapping[str, float]] = {"torque_step": 0.68e-3}
    ablations: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "fusion": {"fusion_fast": 1e6, "fusion_slow": 0.0},
        "gyroscope bias": {"fusion_fast": 9.0, "fusion_slow": 0.0},
        "rules": {"surprised": 1.0},
        "filter": {"filter_first": 0.0, "filter_second": 0.0},
        "integral": {"integral": 0.0},
        "decay of ramp": {"decay": 1.0},
        "learnt gain": {"gain_walk": 0.0, "gain_spread": 0.0},
        "learnt delay": {"delay_walk": 0.0, "delay_spread": 0.0},
    }

    class State(FusedState, Observed, Identified):
        """Fusion, observer, identification, and what the rules and the torque need."""

        integral: Vector = quantity(0.0, "rad", "integral")
        noise: Vector = quantity(0.0, "rad/s", "estimated standard deviation σ̂ of the innovations")
        activity: Vector = quantity(0.0, "", "largest recent innovation a, in σ̂")
        factor: Vector = quantity(1.0, "", "factor of the bandwidths, by the rules")
        filtered: tuple[tuple[float, float], tuple[float, float], tuple[float, float]] = quantity(
            ((0.0, 0.0),) * 3, "rad/s", "innovations behind the poles of Q, the newest first"
        )
        wanted: Vector = quantity(0.0, "rad/s²", "w of the period that begins now, before the limits of the motors")

    slope: Positive = quantity(55, "1/s", "slope λ of the surface", searched=(44.0, 68.8))
    reaching: Positive = quantity(
        301.0, "1/s", "rate κ at which S decays within the layer, where it is quiet", searched=(241.0, 376.0)
    )
    integral: NonNegative = quantity(106.0, "1/s", "gain k_I of the integral of S", searched=(84.8, 132.0))
    integral_limit: NonNegative = quantity(
        0.0, "rad/s", "largest integral part k_I ∫S dt; 0 for that of 5 % of the motors", gain=False
    )
    phi: PositiveVector = quantity(
        3.0, "rad/s", "boundary layer φ per axis; κ φ is the most that is spent on reaching", searched=(2.4, 3.75)
    )
    real_pole: Positive = quantity(1140.0, "1/s", "real pole of the observer", searched=(912.0, 1420.0))
    pair: Positive = quantity(603.0, "1/s", "natural frequency of its pair of poles", searched=(482.0, 754.0))
    damping_ratio: Positive = quantity(0.548, "", "damping ratio of that pair, up to 1", searched=(0.438, 0.685))
    decay: Positive = quantity(
        1310.0, "1/s", "rate a at which the ramp of the mismatch decays", searched=(1050.0, 1640.0)
    )
    filter_first: NonNegative = quantity(0.303, "", "gain q₀ of the filter Q", searched=(0.242, 0.379))
    filter_second: NonNegative = quantity(0.0902, "", "gain q₁ of the filter Q", searched=(0.0722, 0.113))
    filter_pole: Positive = quantity(1600.0, "1/s", "double pole of the filter Q", searched=(1280.0, 2000.0))
    fusion_fast: NonNegative = quantity(
        6.0, "1/s", "first pole of the fusion; beyond 1e5 the attitude is not averaged", searched=(4.8, 7.5)
    )
    fusion_slow: NonNegative = quantity(3.0, "1/s", "second pole of the fusion; 0 for no bias", searched=(2.4, 3.75))
    surprised: Positive = quantity(1.5, "", "factor of the bandwidths where innovations surprise", searched=(1.2, 1.88))
    quiet: Positive = quantity(3.14, "", "largest innovation, in σ̂, that is fully quiet", searched=(2.51, 3.93))
    surprising: Positive = quantity(
        3.42, "", "innovation, in σ̂, beyond which it is fully surprised", searched=(2.74, 4.28)
    )
    memory: Positive = quantity(77.1, "1/s", "rate at which a surprise is forgotten", searched=(61.7, 96.4))
    floor: Positive = quantity(
        1.3e-3, "rad/s", "least standard deviation of the innovations, that of realistic sensors", gain=False
    )
    noise_rate: Positive = quantity(2.0, "1/s", "rate at which the noise is estimated", searched=(1.6, 2.5))
    gain_walk: NonNegative = quantity(
        0.0016, "", "standard deviation of a sample's change of the input's gain", searched=(0.00128, 0.002)
    )
    delay_walk: NonNegative = quantity(
        0.0018, "", "standard deviation of a sample's change of its delay, in periods", searched=(0.00144, 0.00225)
    )
    gain_spread: NonNegative = quantity(
        0.53, "", "standard deviation of the gain at the start", searched=(0.424, 0.663)
    )
    delay_spread: NonNegative = quantity(
        1.7, "", "standard deviation of the delay at the start, in periods", searched=(1.36, 2.12)
    )
    leak: NonNegative = quantity(
        0.39, "1/s", "rate at which the estimates of gain and delay return to 1 and 0", searched=(0.312, 0.488)
    )
    discount: NonNegative = quantity(
        18.8, "", "weight c of a surprise in the variance of the identification", searched=(15.0, 23.5)
    )

    @property
    def boundary_layer(self) -> tuple[float, float, float]:
        """The boundary layer φ."""
        return self.phi

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        period, slope = signal.period, parameters.slope
        running = state.running > 0.5
        late, periods = arrive(signal, state)
        if periods > 0 or not running:
            fuse(signal, state, periods, parameters.fusion_fast, parameters.fusion_slow)
        for i in range(3):
            e, de = state.error[i], state.rate_error[i]
            surface = slope * e + de
            if not running:
                begin(parameters, state, i, surface)
            if periods > 0:
                advance(parameters, state, i, slope * de, periods, late, period)
                correct(signal, parameters, state, i, surface - state.surface[i])
            gain, layer = state.gain[i], parameters.phi[i]
            ahead = foresee(state, i, de, late + state.delay[i], gain, parameters.decay, period)
            reached = slope * (e + ahead.turned) + de + ahead.gained
            if parameters.integral > 0.0:
                most = largest_integral(signal, i, parameters.reaching, parameters.integral_limit, INTEGRAL_SHARE)
                bound = most / parameters.integral
                state.integral[i] = limited(state.integral[i] + periods * period * limited(reached, layer), bound)
            rate = (1.0 - exp(-parameters.reaching * state.factor[i] * period)) / period  # the same decay, at instants
            pull = rate * layer * tanh((reached + parameters.integral * state.integral[i]) / layer)
            past = state.filtered
            extra = (parameters.filter_second * past[i, 1] - parameters.filter_first * past[i, 0]) / period
            state.wanted[i] = (slope * (de + ahead.gained) + pull + ahead.mismatch + extra) / gain
            command.surface[i] = surface
            command.slope[i] = slope
        w = state.wanted
        send(signal, (w[0], w[1], w[2]), command, state)


def begin(parameters: Any, state: Any, axis: int, surface: float) -> None:
    """Start at the first sample of the surface, with no mismatch known."""
    state.surface[axis] = surface
    state.noise[axis] = parameters.floor
    state.covariance[axis, 0] = parameters.gain_spread * parameters.gain_spread
    state.covariance[axis, 2] = parameters.delay_spread * parameters.delay_spread


def advance(
    parameters: Any, state: Any, axis: int, known: float, periods: int, late: float, period: float
) -> None:  # fmt: skip
    """Move observer and identification on to a sample, by the w that acted since the one before.

    Args:
        parameters: of the law.
        state: of the law, written.
        axis: axis.
        known: λ ė at the sample [rad/s²].
        periods: periods since the sample before.
        late: known lateness of the sample, in periods.
        period: T [s].
    """
    rho, behind = exp(-parameters.decay * period), late + state.delay[axis]
    for n in range(periods):
        newer, older = asked(state, axis, behind + periods - 1 - n), asked(state, axis, behind + periods - n)
        drift = state.mismatch[axis] + 0.5 * period * state.growth[axis] + known - state.gain[axis] * newer
        state.surface[axis] += period * drift
        state.mismatch[axis] += period * state.growth[axis]
        state.growth[axis] *= rho
        drive(state, axis, newer, older, rho, period)


def correct(signal: Signal, parameters: Any, state: Any, axis: int, innovation: float) -> None:
    """Correct observer and identification by an innovation [rad/s], at the bandwidth that the rules make of it."""
    period = signal.period
    size, noise = abs(innovation), state.noise[axis]
    noise += parameters.noise_rate * period * (MEAN_TO_DEVIATION * min(size, CLIP * noise) - noise)
    noise = max(noise, parameters.floor)
    activity = max(size / noise, state.activity[axis] * exp(-parameters.memory * period))
    degree = min(1.0, max(0.0, (activity - parameters.quiet) / max(parameters.surprising - parameters.quiet, 1e-9)))
    factor = 1.0 + (parameters.surprised - 1.0) * degree
    state.noise[axis], state.activity[axis], state.factor[axis] = noise, activity, factor
    correction = gains(
        factor * parameters.real_pole, factor * parameters.pair, parameters.damping_ratio, parameters.decay, period
    )
    identify(
        state, axis, innovation, noise, parameters.discount, parameters.gain_walk, parameters.delay_walk,
        parameters.leak * period, correction, period,
    )  # fmt: skip
    state.surface[axis] += correction.surface * innovation
    state.mismatch[axis] += correction.mismatch * innovation / period
    state.growth[axis] += correction.growth * innovation / (period * period)
    limit = largest_mismatch(signal, axis)
    if abs(state.mismatch[axis]) > limit:
        state.mismatch[axis] = limited(state.mismatch[axis], limit)
        state.growth[axis] = 0.0
    pole = exp(-parameters.filter_pole * period)
    newest = pole * (2.0 * state.filtered[axis, 0] - pole * state.filtered[axis, 1]) + innovation
    state.filtered[axis, 1] = state.filtered[axis, 0]
    state.filtered[axis, 0] = newest
