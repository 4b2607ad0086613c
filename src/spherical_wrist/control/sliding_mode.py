"""Sliding-mode control, eq. (16)–(25): an equivalent part for the model, a switching part for its errors."""

from collections.abc import Mapping
from typing import Any, ClassVar

from spherical_wrist.control.contract import Bound, Command, LawStatus, Signal
from spherical_wrist.control.sliding_surface import SlidingSurfaceLaw, add_switching
from spherical_wrist.parameters import Positive, inherited


def equivalent_torque(signal: Signal, slope: float, command: Command) -> None:
    """Write Û = H (q̈_d + λ ė) + N, the equivalent part of eq. (24): Ṡ = 0 where the model is the plant."""
    for i in range(3):
        command.torque[i] = signal.N[i]
        for j in range(3):
            command.torque[i] += signal.H[i, j] * (signal.feed_forward[j] + slope * signal.rate_error[j])


class SlidingMode(SlidingSurfaceLaw):
    """Sliding mode, eq. (16)–(25): τ = H (q̈_d + λ ė) + N + K sw(S / φ) with S = λ e + ė.

    S is eq. (17) with n = 2, one component per axis, body frame [rad/s]; H [kg·m²] and N [N·m] are the nominal model's,
    q̈_d is the feed-forward [rad/s²]. The first two terms are the equivalent part Û of eq. (24): the torque that would
    keep S as it is. The last is the switching part, whose sign per axis is that of S_i, eq. (16) and (25). Eq. (24) has
    −K sgn(s) for x̃ = actual − desired; here e = desired − actual, eq. (9), so S has the other sign and the term a plus.

    Against a mismatch torque Δ, which is what the plant needs to keep S less what Û supplies, the plant follows
    H Ṡ = Δ − K sw(S / φ), H being its own inertia. With ``sign`` and K_i > |Δ_i|, S is reached in finite time, eq.
    (18)–(22), as ``paper.lyapunov.reaching`` computes; the layer only within φ. On S = 0 the attitude error obeys
    ė = −λ e without approximation, for the log of SO(3) too, and decays as exp(−λ t): eq. (23) holds in the limit, not
    at once.
    (λ ė in Û is the derivative of λ e to first order in e only; Δ has the rest.)

    Within the boundary layer each axis is a loop of bandwidth β = K/(φ H) around e' = −λ e + S, whose poles are λ and
    β on the nominal plant; a constant torque d leaves e = φ atanh(d/K) / λ for ``tanh``. The defaults have K thrice the
    largest Δ of the default motion with 25 % torque and 50 % mass, β ≈ 420/s on every axis and λ near a quarter of it,
    so that the loop stays damped and within its rate at 1 kHz (β T < 0.9) for plants of 0.5 to 1.5 times the mass.
    """

    status: ClassVar[LawStatus] = "paper"
    exempt: ClassVar[Mapping[str, str]] = {
        "restlessness": "the paper asks for no margin against delays, and at half the mass it has none",
        "delay_margin_s": "the paper asks for no margin against delays, and at half the mass it has little",
        "torque_step": "its slope is as steep as the paper has it, whatever the noise",
        "gain_margin_db": "half the mass doubles the gain of a switching layer",
    }
    tracks_to: ClassVar[Bound] = Bound(9.7e-4, 1.28e-3)

    slope: Positive = inherited(SlidingSurfaceLaw, "slope", 100.0)

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        equivalent_torque(signal, parameters.slope, command)
        for i in range(3):
            add_switching(signal, parameters.K, parameters.switching, parameters.phi, parameters.slope, i, command)
