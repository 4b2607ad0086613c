"""Linear active disturbance rejection control: an extended state observer, and a bandwidth for each of two loops."""

from math import exp
from typing import Any, ClassVar, Literal

from spherical_wrist.control.contract import Bound, Command, LawStatus, ModelBasedLaw, Signal, choice
from spherical_wrist.control.linear_feedback import critically_damped
from spherical_wrist.control.past_commands import PastCommands, arrive, asked, project, send
from spherical_wrist.control.torque_limit import largest_mismatch, limited
from spherical_wrist.parameters import Positive, Vector, quantity

Output = Literal["rate", "attitude"]
ATTITUDE = choice(Output, "attitude")


class LinearADRC(ModelBasedLaw):
    """Linear ADRC: τ = N + H (q̈_d + w), w = ω_c² e + 2 ω_c ė + z₃, with z₃ from an extended state observer.

    e [rad], ė [rad/s], body frame, are the errors, H [kg·m²] and N [N·m] the nominal model's, q̈_d [rad/s²] the
    feed-forward. Every axis is the plant ë = −w + f, of the known gain 1, whose *total disturbance* f [rad/s²] is all
    that the model misses. Per axis the observer has z₁ [rad], z₂ [rad/s] and z₃ [rad/s²], the estimates of e, ė and f:

        ż₁ = z₂ + β₁ r,   ż₂ = z₃ − w + β₂ r,   ż₃ = β₃ r,

    attitude:  r = e − z₁ and (β₁, β₂, β₃) = (3 ω_o, 3 ω_o², ω_o³),
    rate:      r = ė − z₂ and (β₂, β₃) = (2 ω_o, ω_o²), with e itself for z₁: the reduced observer for a sensed rate.

    Derivation: with f as a state of its own (Han, 2009) the observer's error obeys (s + ω_o)ⁿ, and of the law
    w = ω_c² z₁ + 2 ω_c z₂ + z₃ the tracking error (s + ω_c)² e = −(f − z₃): all gains follow from two bandwidths (Gao,
    2003, "Scaling and bandwidth-parameterization based controller tuning", American Control Conference). A constant f
    leaves nothing, of a slow one z₃ misses n ḟ / ω_o, which leaves n ḟ / (ω_o ω_c²).

    Sampled: both sets of poles are placed at exp(−ω T), the observer's in its current form, which uses a sample for the
    command of the same instant (Miklosovic, Radke and Gao, 2006), the feedback's as ``linear_feedback`` says. Samples
    and torques that are late, by times that are known, reach the observer together, and its state is projected to the
    time at which the torque acts (``past_commands``; Zhao and Gao, 2014, delay the observer's input likewise). The
    command that the observer sees is what the motors can give, which is its anti-windup; z₃ is limited to twice that.

    Assumptions: nominal inertia, f independent of the error. Stability: observer and feedback are then in cascade, and
    stable for all positive bandwidths. A plant m times as heavy has f = (1 − 1/m) w + …, and the margins decide.

    Defaults by ``wrist design``.
    """

    status: ClassVar[LawStatus] = "rival"
    tracks_to: ClassVar[Bound] = Bound(7.9e-6, 1.3e-5)

    class State(PastCommands):
        """State of the observer, and memory of the commands."""

        error: Vector = quantity(0.0, "rad", "estimated error z₁")
        rate_error: Vector = quantity(0.0, "rad/s", "estimated rate error z₂")
        disturbance: Vector = quantity(0.0, "rad/s²", "estimated total disturbance z₃")

    bandwidth: Positive = quantity(116.9, "1/s", "bandwidth ω_c of the feedback", searched=(20.0, 500.0))
    observer_bandwidth: Positive = quantity(1535.0, "1/s", "bandwidth ω_o of the observer", searched=(50.0, 2000.0))
    output: Output = quantity("rate", "", "what the observer is driven by")

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        running = state.running > 0.5
        late, periods = arrive(signal, state)
        for i in range(3):
            if running:
                observe(signal, parameters, state, i, late, periods)
            else:
                state.error[i], state.rate_error[i] = signal.error[i], signal.rate_error[i]
        w = demand(signal, parameters, state, 0, late), demand(signal, parameters, state, 1, late)
        send(signal, (w[0], w[1], demand(signal, parameters, state, 2, late)), command, state)


def observe(signal: Signal, parameters: Any, state: Any, axis: int, late: float, periods: int) -> None:
    """Advance the observer of one axis to a sample that came ``periods`` after the last, and correct it."""
    T = signal.period
    for n in range(periods):
        acceleration = state.disturbance[axis] - asked(state, axis, late + periods - 1 - n)
        state.error[axis] += T * (state.rate_error[axis] + 0.5 * T * acceleration)
        state.rate_error[axis] += T * acceleration
    if periods == 0:
        return
    p = exp(-parameters.observer_bandwidth * T)
    if parameters.output == ATTITUDE:
        r = signal.error[axis] - state.error[axis]
        state.error[axis] += (1.0 - p * p * p) * r
        state.rate_error[axis] += 1.5 * (1.0 - p * p) * (1.0 - p) * r / T
        change = (1.0 - p) * (1.0 - p) * (1.0 - p) * r / (T * T)
    else:
        r = signal.rate_error[axis] - state.rate_error[axis]
        state.error[axis] = signal.error[axis]
        state.rate_error[axis] += (1.0 - p * p) * r
        change = (1.0 - p) * (1.0 - p) * r / T
    most = largest_mismatch(signal, axis)
    state.disturbance[axis] = limited(state.disturbance[axis] + change, most)


def demand(signal: Signal, parameters: Any, state: Any, axis: int, late: float) -> float:
    """Return w [rad/s²] of one axis, from the observer's state projected to the time at which it acts."""
    error, rate, disturbance = state.error[axis], state.rate_error[axis], state.disturbance[axis]
    turned, gained = project(state, axis, rate, disturbance, 0.0, late, signal.period)
    k0, k1 = critically_damped(parameters.bandwidth, signal.period)
    return float(k0 * (error + turned) + k1 * (rate + gained) + disturbance)
