"""Proposal of the paper, eq. (44)–(48): the slope of the sliding surface is tuned on line by fuzzy inference."""

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import model_validator

from spherical_wrist.control.computed_torque import computed_torque
from spherical_wrist.control.contract import Array, Bound, Command, LawStatus, Signal
from spherical_wrist.control.sliding_computed_torque import SlidingComputedTorque
from spherical_wrist.control.sliding_surface import add_switching
from spherical_wrist.fuzzy import Tuner, sugeno
from spherical_wrist.fuzzy.antecedent import Conjunction
from spherical_wrist.fuzzy.mamdani import Aggregation, Defuzzification
from spherical_wrist.fuzzy.membership import Shape
from spherical_wrist.fuzzy.tuner import InferenceName
from spherical_wrist.parameters import Positive, PositiveVector, quantity

_Row = tuple[Positive, Positive, Positive]
_Tilts = tuple[float, float, float]
# rule weights (7, 3): rows NB … PB of the error, columns N, Z, P of its rate
Rules = tuple[_Row, _Row, _Row, _Row, _Row, _Row, _Row]

RULES: Rules = (
    # rate:  N    Z    P        error:
    (1.0, 1.0, 1.0),  # NB
    (1.5, 2.0, 1.5),  # NM
    (3.0, 4.0, 3.0),  # NS
    (5.0, 6.0, 5.0),  # Z
    (3.0, 4.0, 3.0),  # PS
    (1.5, 2.0, 1.5),  # PM
    (1.0, 1.0, 1.0),  # PB
)


TILTS: tuple[tuple[float, float, float], ...] = (
    # rate:  N     Z     P        error:
    (0.0, 0.0, 0.0),  # NB
    (1.5, 2.2, 1.5),  # NM
    (2.6, 3.0, 2.6),  # NS
    (0.0, 0.0, 0.0),  # Z
    (-2.6, -3.0, -2.6),  # PS
    (-1.5, -2.2, -1.5),  # PM
    (0.0, 0.0, 0.0),  # PB
)
"""About half the slope of RULES from row to row: the first-order surface rounds off the creases of the other."""


MAMDANI, FIRST_ORDER = {"inference": "mamdani"}, {"inference": "sugeno_first_order"}
"""Inferences that use the parameters declared with them."""


class FuzzySlopeLaw(SlidingComputedTorque):
    """A law that tunes its slope by the paper's 7 × 3 rules: their weights and the scales of e and ė."""

    abstract: ClassVar[bool] = True

    rules: Rules = quantity(RULES, "", "rule weights θ: rows NB … PB of the error, columns N, Z, P of its rate")
    error_scale: PositiveVector = quantity(0.05, "rad", "error at which it is fully big (NB, PB)")
    rate_scale: PositiveVector = quantity(1.0, "rad/s", "rate error at which it is fully negative or positive (N, P)")


class FuzzySlidingComputedTorque(FuzzySlopeLaw):
    """Sliding computed torque with S = λ α(e, ė) e + ė, α > 0 from 21 fuzzy rules, eq. (44)–(48): the paper's proposal.

    The rules make the surface steep near the origin, where the residual error φ atanh(d/K) / (λα) of the boundary
    layer is settled, and shallow far from it, where a steep surface would ask for a faster return than K can drive.
    The rule weights θ are positive, so that α, between the smallest and the largest of them, keeps the surface stable.

    α is read from a table by bilinear interpolation. With ``sugeno``, ``triangular`` and ``product`` that table is the
    7 × 3 rules and the interpolation the inference itself; every other inference is tabulated on 193 × 97 points, and
    :attr:`table_error` says how far the table is from it. α is checked to be positive in all of the table.
    """

    status: ClassVar[LawStatus] = "paper"
    exempt: ClassVar[Mapping[str, str]] = {
        "restlessness": "the paper asks for no margin against delays, and at half the mass it has none",
        "delay_margin_s": "the paper asks for no margin against delays, and at half the mass it has little",
        "torque_step": "its slope is as steep as the paper has it, whatever the noise",
        "gain_margin_db": "half the mass doubles the gain of a switching layer",
    }
    tracks_to: ClassVar[Bound] = Bound(5.5e-4, 7.2e-4)

    inference: InferenceName = quantity("sugeno", "", "fuzzy inference of the slope from the rules")
    membership: Shape = quantity("triangular", "", "shape of the fuzzy sets")
    conjunction: Conjunction = quantity("product", "", "AND of a rule's two conditions")
    aggregation: Aggregation = quantity("max_min", "", "of mamdani: how the rules' output sets join", acts_with=MAMDANI)
    defuzzification: Defuzzification = quantity(
        "coa", "", "of mamdani: centre of area, or of gravity", acts_with=MAMDANI
    )
    output_width: Positive = quantity(
        0.5, "", "of mamdani: centre to foot of the output set around a rule weight", acts_with=MAMDANI
    )
    error_tilts: tuple[_Tilts, _Tilts, _Tilts, _Tilts, _Tilts, _Tilts, _Tilts] = quantity(
        TILTS,
        "",
        "of sugeno_first_order: slope of each rule along e/error_scale, about its peak",
        acts_with=FIRST_ORDER,
    )
    rate_tilts: tuple[_Tilts, _Tilts, _Tilts, _Tilts, _Tilts, _Tilts, _Tilts] = quantity(
        ((0.0, 0.0, 0.0),) * 7,
        "",
        "of sugeno_first_order: slope of each rule along ė/rate_scale, about its peak",
        acts_with=FIRST_ORDER,
    )

    @property
    def tuner(self) -> Tuner:
        """Inference of α; ``tuner.system()`` is the rule base with its inference, to evaluate or to draw."""
        return Tuner(*(getattr(self, name) for name in Tuner._fields))

    @property
    def table_error(self) -> float:
        """Largest difference between the α that the law reads from its table and the direct inference."""
        return self.tuner.table_error()

    def derived(self) -> dict[str, Array]:
        """Return the table of α over e and ė, each divided by its scale, from −1 to 1."""
        return {"table": self.tuner.table()}

    @model_validator(mode="after")
    def _keeps_the_slope_positive(self) -> "FuzzySlidingComputedTorque":
        self.tuner.table()
        return self

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        computed_torque(signal, parameters.Kp, parameters.Kv, command)
        for i in range(3):
            alpha = sugeno(
                signal.error[i] / parameters.error_scale[i],
                signal.rate_error[i] / parameters.rate_scale[i],
                parameters.table,
            )
            slope = parameters.slope * alpha
            add_switching(signal, parameters.K, parameters.switching, parameters.phi, slope, i, command)
