"""Sliding mode with a boundary layer whose thickness follows the uncertainty of the moment."""

from math import exp, isfinite
from typing import Any, ClassVar

from spherical_wrist.control.contract import Bound, Command, LawState, LawStatus, ModelBasedLaw, Signal
from spherical_wrist.control.switching import SATURATION, switch
from spherical_wrist.parameters import NonNegative, NonNegativeVector, Positive, PositiveVector, Vector, quantity


class BoundaryLayerSlidingMode(ModelBasedLaw):
    """Sliding mode with a time-varying boundary layer: τ = Û + H β φ sat(S/φ), φ̇ = −β φ + k, each per axis.

    Û = H (q̈_d + λ₁ ė + λ₀ e) + N keeps S where it is on the nominal wrist, as in eq. (24). S [rad/s] is, body frame,

        S = ė + 2ζλ e + λ² ∫ e dt   with integral action, λ₁ = 2ζλ, λ₀ = λ² (for ζ = 1: Slotine and Li, 1991, 7.1),
        S = ė + λ e                 without, λ₁ = λ, λ₀ = 0 (Slotine and Sastry, 1983),

    and k = D + μ |H q̈_d + N| / H_ii [rad/s²] bounds what the model can miss: a disturbance D, and a share μ of the
    model's own torque, μ = 1/m − 1 for a plant of m < 1 times the mass. D is at least a share (``reserve``) of what
    the motors can do, τ_max / H_ii, so that it suits light axes with strong motors too.

    Derivation (Slotine and Li, 1991, Applied Nonlinear Control, section 7.2): with Δ = H⁻¹ d, d the torque beyond the
    nominal model, a torque Û + H k̄ sat(S/φ) gives Ṡ = −Δ − k̄ sat(S/φ). For |Δ| < k the choice k̄ = k − φ̇ makes
    d|S|/dt = φ̇ − k ± |Δ| < φ̇ outside the layer, which therefore attracts however it moves. Within it Ṡ = −(k̄/φ) S −
    Δ; the law of φ above makes k̄ = β φ, and S a first-order filter of Δ with the constant bandwidth β. So the layer
    is balanced: φ → k/β is the precision |S| ≤ φ that is certain at the moment, thin at rest and thick in fast motion.
    Slotine and Li take β = λ, equal filters.

    Assumptions: |Δ| < k, and nominal inertia; k is taken at the measured state for that at the desired one. Stability:
    the layer attracts, and within it the law is linear with the poles −β and those of S = 0: stable for β, λ, ζ > 0. A
    constant Δ leaves |S| = |Δ|/β, and |e| = |S|/λ without integral action; with it, none of either. The integral moves
    only while |S| < φ or where that lowers |S|, so that it cannot wind up. Integral and φ are updated before the torque
    of the same sample.

    Defaults: λ, ζ and β by ``wrist design``; D at least seven times the acceleration by 25 % and 0.3 of what the motors
    can do, and μ = 1, for half the mass, are assumptions on the plant.
    """

    status: ClassVar[LawStatus] = "rival"
    has_surface: ClassVar[bool] = True
    tracks_to: ClassVar[Bound] = Bound(5.6e-5, 8.7e-5)

    class State(LawState):
        """Integral of the error, and the boundary layer of the moment."""

        integral: Vector = quantity(0.0, "rad·s", "∫ e dt of the surface")
        layer: NonNegativeVector = quantity(0.0, "rad/s", "boundary layer φ; 0 before the first step")

    slope: Positive = quantity(85.97, "1/s", "slope λ of the sliding surface", searched=(20.0, 500.0))
    damping_ratio: Positive = quantity(
        0.6351, "", "damping ratio ζ of the surface with integral action", searched=(0.1, 2.0)
    )
    bandwidth: Positive = quantity(145.8, "1/s", "bandwidth β of the boundary layer", searched=(30.0, 1000.0))
    disturbance: PositiveVector = quantity(
        (130.0, 130.0, 210.0), "rad/s²", "bound D on the acceleration by disturbances, per axis", gain=False
    )
    reserve: NonNegative = quantity(0.3, "", "least D, as a share of what the motors can do", gain=False)
    uncertainty: NonNegative = quantity(
        1.0, "", "bound μ on what the model misses, as a share of its own torque", gain=False
    )
    integral: bool = quantity(True, "", "integral action on the surface")

    @property
    def boundary_layer(self) -> tuple[float, float, float]:
        """φ = D/β of the declared D: the thinnest layer there is; strong motors make it wider."""
        x, y, z = self.disturbance
        return (x / self.bandwidth, y / self.bandwidth, z / self.bandwidth)

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        slope, bandwidth = parameters.slope, parameters.bandwidth
        proportional, reset = slope, 0.0
        if parameters.integral:
            proportional, reset = 2.0 * parameters.damping_ratio * slope, slope * slope
        decay = exp(-bandwidth * signal.period)
        for i in range(3):
            command.torque[i] = signal.N[i]
            for j in range(3):
                command.torque[i] += signal.H[i, j] * signal.feed_forward[j]
            least, most = parameters.disturbance[i], signal.torque_limit[i] / signal.H[i, i]
            if isfinite(most):
                least = max(least, parameters.reserve * most)
            bound = least + parameters.uncertainty * abs(command.torque[i]) / signal.H[i, i]
            balanced, layer = bound / bandwidth, state.layer[i]
            state.layer[i] = balanced if layer == 0.0 else balanced + (layer - balanced) * decay
        for j in range(3):
            e, de, layer = signal.error[j], signal.rate_error[j], state.layer[j]
            surface = de + proportional * e + reset * (state.integral[j] + signal.period * e)
            if abs(surface) < layer or surface * e < 0.0:
                state.integral[j] += signal.period * e
            else:
                surface = de + proportional * e + reset * state.integral[j]
            push = bandwidth * layer * switch(SATURATION, surface, layer)
            for i in range(3):
                command.torque[i] += signal.H[i, j] * (proportional * de + reset * e + push)
            command.surface[j] = surface
            command.slope[j] = slope
