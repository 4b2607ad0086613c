"""Adaptive mechanism that the paper's abstract promises: the rule weights θ of eq. (47) are learned on line."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from spherical_wrist.control.computed_torque import computed_torque
from spherical_wrist.control.contract import Array, Bound, Command, LawState, LawStatus, Signal
from spherical_wrist.control.fuzzy_sliding_computed_torque import RULES, FuzzySlopeLaw, Rules
from spherical_wrist.control.sliding_surface import add_switching
from spherical_wrist.errors import ParameterError
from spherical_wrist.fuzzy import fuzzify, sugeno
from spherical_wrist.parameters import Positive, quantity


def adapt(weights: Array, error: float, rate: float, change: float, low: float, high: float) -> None:
    """Add ``change`` ζ(e, ė) to the weights of the rules that fire, and project them onto [low, high].

    Args:
        weights: θ (7, 3), written.
        error: e divided by its scale.
        rate: ė divided by its scale.
        change: change of the weight of a rule that fires fully.
        low: smallest weight.
        high: largest weight.
    """
    i, upper_error = fuzzify(error, 7)
    j, upper_rate = fuzzify(rate, 3)
    for a in range(2):
        for b in range(2):
            strength = (upper_error if a == 1 else 1.0 - upper_error) * (upper_rate if b == 1 else 1.0 - upper_rate)
            weights[i + a, j + b] = min(high, max(low, weights[i + a, j + b] + change * strength))


class AdaptiveFuzzySlidingComputedTorque(FuzzySlopeLaw):
    """The paper's proposal with the rule weights of eq. (47) adapting: θ̇ = γ ζ(e, ė) e (λ e + ė), within bounds.

    Derivation, for one axis inside the boundary layer, where K sw(S / φ) ≈ (K / φ)(λ θᵀζ e + ė). Let θ* be weights with
    which the loop is as wanted, ë + a₁ ė + a₀ e = −H⁻¹ d with a₁ = Kv + K / (H φ), and θ̃ = θ − θ*. Then, with
    x = (e, ė) and c = K λ / (H φ),

        ẋ = A x − b (c θ̃ᵀζ e + H⁻¹ d),   b = (0, 1).

    The transfer function (s + λ) / (s² + a₁ s + a₀) is strictly positive real for 0 < λ < a₁, so by the
    Kalman–Yakubovich–Popov lemma there are P, Q > 0 with AᵀP + P A = −Q and P b = (λ, 1). Along
    V = xᵀP x + (c / γ) θ̃ᵀθ̃,

        V̇ = −xᵀQ x − 2 c θ̃ᵀζ e (λ e + ė) + (2 c / γ) θ̃ᵀθ̇ − 2 (λ e + ė) H⁻¹ d,

    and the law above cancels the two terms in θ̃. Without a disturbance V̇ = −xᵀQ x ≤ 0; with one the weights rise while
    an error persists, and the projection onto [lowest, highest], which cannot increase |θ̃| for θ* within, keeps them
    bounded and α positive. Each axis has weights of its own; they are the law's state, and are recorded. They adapt
    after the torque of a sample, which has those of the samples before.
    """

    status: ClassVar[LawStatus] = "paper"
    exempt: ClassVar[Mapping[str, str]] = {
        "restlessness": "the paper asks for no margin against delays, and at half the mass it has none",
        "delay_margin_s": "the paper asks for no margin against delays, and at half the mass it has little",
        "torque_step": "its slope is as steep as the paper has it, whatever the noise",
        "gain_margin_db": "half the mass doubles the gain of a switching layer",
    }
    tracks_to: ClassVar[Bound] = Bound(3.9e-4, 5.5e-4)

    class State(LawState):
        """Rule weights that adapt."""

        weights: tuple[Rules, Rules, Rules] = quantity((RULES,) * 3, "", "rule weights θ of each axis (3, 7, 3)")

    adaptation: Positive = quantity(2e5, "1/rad²", "adaptation gain γ")
    lowest: Positive = quantity(0.5, "", "smallest rule weight")
    highest: Positive = quantity(12.0, "", "largest rule weight")

    def __init__(self, /, **values: Any) -> None:
        super().__init__(**values)
        weights = np.array(self.rules)
        if not (self.lowest <= weights.min() and weights.max() <= self.highest):
            raise ParameterError(
                f"rules = {weights.min():g} … {weights.max():g}: must lie within lowest = {self.lowest:g} and "
                f"highest = {self.highest:g}, the bounds of their adaptation"
            )

    def initial_state(self) -> dict[str, Any]:
        """Return the rule weights that every axis starts from."""
        return {"weights": (self.rules,) * 3}

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        computed_torque(signal, parameters.Kp, parameters.Kv, command)
        for i in range(3):
            weights = state.weights[i]
            e, de = signal.error[i], signal.rate_error[i]
            error, rate = e / parameters.error_scale[i], de / parameters.rate_scale[i]
            slope = parameters.slope * sugeno(error, rate, weights)
            add_switching(signal, parameters.K, parameters.switching, parameters.phi, slope, i, command)
            change = signal.period * parameters.adaptation * e * (parameters.slope * e + de)
            adapt(weights, error, rate, change, parameters.lowest, parameters.highest)
