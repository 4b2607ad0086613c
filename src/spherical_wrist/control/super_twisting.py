"""Super-twisting, the second-order sliding mode whose torque is continuous."""

from math import sqrt
from typing import Any, ClassVar

from spherical_wrist.control.contract import Bound, Command, LawState, LawStatus, Signal
from spherical_wrist.control.sliding_mode import equivalent_torque
from spherical_wrist.control.switching import SIGN, SwitchingName, switch
from spherical_wrist.control.torque_limit import LimitAwareLaw, integrated, limit_of
from spherical_wrist.parameters import Positive, PositiveVector, Vector, quantity


class SuperTwisting(LimitAwareLaw):
    """Super-twisting: τ = H (q̈_d + λ ė + k₁ ρ(S) sw(S/φ)) + N + w, ẇ = H k₂ sw(S/φ), with S = λ e + ė.

    ρ(S) = √|S| with ``sign`` (Levant, 1993), and √max(|S|, φ) with a boundary layer φ. H (q̈_d + λ ė) + N is
    the equivalent torque of eq. (24); S [rad/s] is eq. (17) per axis, body frame; w [N·m] is ``integral`` of the state.

    Derivation: with d the torque beyond the nominal model, H ω̇ = τ − N + d, and z = −H⁻¹ (w + d),

        Ṡ = −k₁ |S|^½ sgn S + z,   ż = −k₂ sgn S − H⁻¹ ḋ.

    With ζ = (|S|^½ sgn S, z) this is ζ̇ = |S|^−½ A ζ for ḋ = 0, and A = ½ [[−k₁, 1], [−2 k₂, 0]] is Hurwitz for k₁, k₂
    > 0. V = ζᵀP ζ with AᵀP + P A = −Q then has V̇ = −|S|^−½ ζᵀQ ζ ≤ −γ √V with γ = √λ_min(P) λ_min(Q) / λ_max(P), and
    is zero after 2 √V(0) / γ (Moreno and Osorio, 2012). For |H⁻¹ ḋ| ≤ L per axis, k₂ > L and k₁² > 4 L (k₂ + L) / (k₂
    − L) suffice (Levant, 1993): S and Ṡ vanish in finite time, whatever d itself.

    Sampled: w⁺ = w + T H k₂ sw(S/φ) comes first, and the torque of the same sample contains w⁺.

    Assumptions: nominal inertia and a bounded ḋ; ``sign`` needs to switch arbitrarily fast. Held for a period T, its
    torque chatters with steps of k₂ T and k₁ √|S|: S stays of the order of k₂ T² on ideal hardware, and with delays it
    is a limit cycle. Within a layer the law is linear, S̈ + (k₁/√φ) Ṡ + (k₂/φ) S = −H⁻¹ ḋ, stable and without
    chattering: a constant d still leaves nothing, a slow one S = φ H⁻¹ ḋ / k₂. Outside of it, it is that of Levant.

    Defaults by ``wrist design``, in the layer. ``sign`` cannot meet its constraints: with λ = 100/s, k₁ = 15 and k₂ =
    250 it leaves a few 10⁻⁶ rad, at 5 to 16 times the chattering of plain computed torque. The integral stops at
    ``torque_limit``, and while the whole torque is beyond it.
    """

    status: ClassVar[LawStatus] = "rival"
    has_surface: ClassVar[bool] = True
    tracks_to: ClassVar[Bound] = Bound(3.2e-5, 4.9e-5)

    class State(LawState):
        """Memory of the integral."""

        integral: Vector = quantity(0.0, "N·m", "integral torque w")

    k1: PositiveVector = quantity(63.8, "rad½/(s·s½)", "gain k₁ of the root per axis", searched=(5.0, 200.0))
    k2: PositiveVector = quantity(5752.0, "rad/s³", "gain k₂ of the integral per axis", searched=(500.0, 50000.0))
    slope: Positive = quantity(142.9, "1/s", "slope λ of the sliding surface", searched=(20.0, 500.0))
    switching: SwitchingName = quantity("saturation", "", "switching function")
    phi: PositiveVector = quantity(
        0.4302, "rad/s", "boundary layer φ per axis; sign only reports with it", searched=(0.05, 2.0)
    )

    @property
    def boundary_layer(self) -> tuple[float, float, float]:
        """The boundary layer φ."""
        return self.phi

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        equivalent_torque(signal, parameters.slope, command)
        for i in range(3):
            command.slope[i] = parameters.slope
            command.surface[i] = parameters.slope * signal.error[i] + signal.rate_error[i]
        for i in range(3):
            change = 0.0
            for j in range(3):
                surface, layer = command.surface[j], parameters.phi[j]
                direction = switch(parameters.switching, surface, layer)
                root = sqrt(abs(surface) if parameters.switching == SIGN else max(abs(surface), layer))
                command.torque[i] += signal.H[i, j] * parameters.k1[j] * root * direction
                change += signal.period * signal.H[i, j] * parameters.k2[j] * direction
            limit = limit_of(signal, i, parameters.torque_limit)
            state.integral[i] = integrated(state.integral[i], change, command.torque[i], limit)
            command.torque[i] += state.integral[i]
