"""The paper's proposal, eq. (44)–(48): the slope of the sliding surface is tuned on line by fuzzy inference."""

from typing import Any

from spherical_wrist.control.computed_torque import computed_torque
from spherical_wrist.control.contract import Array, Command, Signal
from spherical_wrist.control.sliding_computed_torque import SlidingComputedTorque, add_switching
from spherical_wrist.fuzzy import sugeno
from spherical_wrist.parameters import Positive, PositiveVector, quantity

_Row = tuple[Positive, Positive, Positive]

RULES: tuple[tuple[float, float, float], ...] = (
    # rate:  N    Z    P        error:
    (1.0, 1.0, 1.0),  # NB
    (1.5, 2.0, 1.5),  # NM
    (3.0, 4.0, 3.0),  # NS
    (5.0, 6.0, 5.0),  # Z
    (3.0, 4.0, 3.0),  # PS
    (1.5, 2.0, 1.5),  # PM
    (1.0, 1.0, 1.0),  # PB
)


class FuzzySlidingComputedTorque(SlidingComputedTorque):
    """Sliding computed torque with S = λ α(e, ė) e + ė, α > 0 from 21 fuzzy rules, eq. (44)–(48): the paper's proposal.

    The rules make the surface steep near the origin, where the residual error φ atanh(d/K) / (λα) of the boundary
    layer is settled, and shallow far from it, where a steep surface would ask for a faster return than K can drive.
    The rule weights θ are positive, so that α, between the smallest and the largest of them, keeps the surface stable.
    """

    rules: tuple[_Row, _Row, _Row, _Row, _Row, _Row, _Row] = quantity(
        RULES, "", "rule weights θ: rows NB … PB of the error, columns N, Z, P of its rate"
    )
    error_scale: PositiveVector = quantity(0.05, "rad", "error at which it is fully big (NB, PB)")
    rate_scale: PositiveVector = quantity(1.0, "rad/s", "rate error at which it is fully negative or positive (N, P)")

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Array, command: Command) -> None:
        """See the class."""
        computed_torque(signal, parameters.Kp, parameters.Kv, command)
        for i in range(3):
            alpha = sugeno(
                signal.error[i] / parameters.error_scale[i],
                signal.rate_error[i] / parameters.rate_scale[i],
                parameters.rules,
            )
            slope = parameters.slope * alpha
            add_switching(signal, parameters.K, parameters.switching, parameters.phi, slope, i, command)
