"""Our law: a fuzzy sliding surface with integral action, reached in a boundary layer, and an observer for the rest."""

from math import exp, log1p, tanh
from typing import Any, ClassVar

from spherical_wrist.control.contract import Bound, Command, LawStatus, ModelBasedLaw, Signal
from spherical_wrist.control.fuzzy_sliding_computed_torque import Rules
from spherical_wrist.control.mismatch_observer import Mismatch, foresee, observe, start
from spherical_wrist.control.past_commands import arrive, remember
from spherical_wrist.control.torque_limit import largest_integral, largest_mismatch
from spherical_wrist.fuzzy import sugeno
from spherical_wrist.parameters import NonNegative, Positive, PositiveVector, Vector, quantity

RULES: tuple[tuple[float, float, float], ...] = (
    # rate:  N    Z    P         error:
    (0.5, 0.5, 0.5),  # NB
    (2.0, 2.0, 2.0),  # NM
    (4.0, 4.0, 4.0),  # NS
    (1.0, 1.0, 1.0),  # Z
    (4.0, 4.0, 4.0),  # PS
    (2.0, 2.0, 2.0),  # PM
    (0.5, 0.5, 0.5),  # PB
)
"""At a sensor's noise the slope averages; beyond it, it is steep; further out as steep as K can follow, √(K / |e|)."""

INTEGRAL_SHARE = 0.0015
"""Share of what the motors can do that the integral may ask for: it takes out the gyroscope's bias, and no more."""


def logarithmic(error: float, floor: float, scale: float) -> float:
    """Return sgn(e) ln(1 + |e| / floor) / ln(1 + scale / floor): linear below ``floor``, 1 at ``scale``."""
    size = log1p(abs(error) / floor) / log1p(scale / floor)
    return size if error >= 0.0 else -size


class FuzzyIntegralSliding(ModelBasedLaw):
    """A fuzzy sliding surface with integral action, and an observer of the model mismatch.

    It grows the paper's proposal, eq. (44)–(48), by what its residual error asks for. Per axis, in the body frame,

        S = ė + λ α(e, ė) e + λ_I z,    ż = μ(e) e,                                 the surface,
        w = λ α ė + λ_I μ e + κ_T φ tanh(Ŝ / φ) + δ̂,    τ = N + H (q̈_d + w),       the torque,

    with α from 21 rules, as eq. (46)–(47), on a logarithmic scale of e; μ the degree to which e is zero (the set Z of
    the same scale); and Ŝ and δ̂ the surface and the mismatch that ``mismatch_observer`` estimates from S. Sampled, κ is
    κ_T = (1 − exp(−κ T)) / T, with which a torque that is held makes S decay from sample to sample as exp(−κ t) does.
    N, H and q̈_d are taken for the middle of the period in which τ acts; Ŝ, e and ė are foreseen until its beginning,
    from what was asked for since the sample. The z of a sample sums the errors of the samples before it.

    Why it works. The wrist obeys ë = −w + δ, where δ = H⁻¹ ((H_plant − H) ω̇ + N_plant − N − d) and the like is all that
    the model misses, so that Ṡ = −κ φ tanh(S / φ) + (δ − δ̂), but for the change of α. V = ½ S² falls while
    κ φ |tanh(S / φ)| > |δ − δ̂|: S ends in the layer φ atanh(|δ − δ̂| / κφ) ≈ |δ − δ̂| / κ, whatever δ̂ within its limit
    is, and on S = 0 the error decays, as s² + λ α s + λ_I is stable for all positive coefficients. The paper's law is
    left with all of δ there; the observer leaves 3 δ̈ / ω² of it. A mismatch d sin(Ω t) thus becomes an error of about

        |e| ≈ (3 / κ + 1 / ω) Ω² |d| / (ω² √(λ² + Ω²)),

    without anything that switches: hence no chattering. κ and ω act on S, in which the rate dominates, and not on the
    noisier attitude, which comes in through λ alone. That is why λ is small, and the rules make it large where an error
    is too large to be noise: a return takes half the time that λ alone would take. The integral takes out what a
    constant error b of the rate sensor would leave, e = b / λ; it waits for μ and is bounded: a large error does
    not wind it up.

    Defaults by ``wrist design``. The paper's slope is steepest at zero; this one has the observer there.
    """

    status: ClassVar[LawStatus] = "ours"
    has_surface: ClassVar[bool] = True
    tracks_to: ClassVar[Bound] = Bound(1.4e-6, 2.5e-6)

    class State(Mismatch):
        """Observer, and integral of the surface."""

        integral: Vector = quantity(0.0, "rad·s", "z, the error that the surface integrates")

    slope: Positive = quantity(19.85, "1/s", "slope λ of the surface, times α", searched=(10.0, 200.0))
    integral: Positive = quantity(11.26, "1/s²", "integral gain λ_I of the surface", searched=(10.0, 500.0))
    integral_limit: NonNegative = quantity(
        0.0, "rad/s", "largest integral part λ_I z of the surface; 0 for that of 0.15 % of the motors", gain=False
    )
    reaching: Positive = quantity(216.1, "1/s", "rate κ at which S decays within the layer", searched=(50.0, 1000.0))
    phi: PositiveVector = quantity(
        2.752, "rad/s", "boundary layer φ per axis; κ φ is the most that is spent on reaching", searched=(0.3, 10.0)
    )
    bandwidth: Positive = quantity(429.7, "1/s", "bandwidth ω of the mismatch observer", searched=(50.0, 1000.0))
    mismatch_limit: NonNegative = quantity(
        0.0, "rad/s²", "largest mismatch δ̂ that is believed; 0 for twice what the motors can do", gain=False
    )
    rules: Rules = quantity(RULES, "", "rule weights of α: rows NB … PB of the error, columns N, Z, P of its rate")
    error_floor: Positive = quantity(
        0.003, "rad", "error below which its scale is linear: ten times the noise", gain=False
    )
    error_scale: Positive = quantity(1.0, "rad", "error at which it is fully big (NB, PB)", gain=False)
    rate_scale: PositiveVector = quantity(
        1.0, "rad/s", "rate error at which it is fully negative or positive (N, P)", gain=False
    )

    @property
    def boundary_layer(self) -> tuple[float, float, float]:
        """The boundary layer φ."""
        return self.phi

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        period = signal.period
        running = state.running > 0.5
        late, periods = arrive(signal, state)
        reaching = (1.0 - exp(-parameters.reaching * period)) / period  # the same decay, at the instants
        for i in range(3):
            e, de = signal.error[i], signal.rate_error[i]
            size = logarithmic(e, parameters.error_floor, parameters.error_scale)
            slope = parameters.slope * sugeno(size, de / parameters.rate_scale[i], parameters.rules)
            zero = max(0.0, 1.0 - 3.0 * abs(size))
            pull = parameters.integral * zero
            surface = slope * e + de + parameters.integral * state.integral[i]
            if running:
                known = slope * de + pull * e
                bandwidth, own = parameters.bandwidth, parameters.mismatch_limit
                limit = own if own > 0.0 else largest_mismatch(signal, i)
                observe(state, i, surface, known, periods, late, period, bandwidth, limit)
            else:
                start(state, i, surface)
            turned, gained, mismatch = foresee(state, i, de, late, period)
            reached = state.surface[i] + gained + slope * turned + pull * e * late * period
            layer = parameters.phi[i]
            w = slope * (de + gained) + pull * (e + turned) + reaching * layer * tanh(reached / layer) + mismatch
            remember(state, i, w)
            most = largest_integral(signal, i, parameters.reaching, parameters.integral_limit, INTEGRAL_SHARE)
            bound = most / parameters.integral
            integral = state.integral[i] + periods * period * zero * e
            state.integral[i] = min(bound, max(-bound, integral))
            command.surface[i] = surface
            command.slope[i] = slope
        for i in range(3):
            command.torque[i] = signal.N[i]
            for j in range(3):
                asked = state.past[j, 0]
                command.torque[i] += signal.H[i, j] * (signal.feed_forward[j] + asked)
