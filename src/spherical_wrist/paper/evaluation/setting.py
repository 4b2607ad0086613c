"""Choices for everything that the paper does not specify, the same for both of its methods.

The paper gives no inertia, gains, λ, K, membership functions, disturbance shape or trajectory. The wrist is that of the
package, Kp and Kv are the defaults of the laws (critically damped, 20 rad/s), and so are λ, the fuzzy rules and their
scales. The rest is chosen here:

- The trajectory is a sinusoid of the angles α, β, γ, since the paper writes its motor in them, and the error is the RMS
  attitude error once the start has died out.
- The disturbance is a constant torque on every axis: the only shape for which a steady error is well defined.
- The masses are those of the nominal model: the table varies the disturbance alone.
- K is chosen against the size d of the 25 % disturbance, which the variants below are about.
"""

from typing import Any, NamedTuple

REFERENCE = "sinusoid"
DURATION = 6.0
STEADY_FROM = 2.0
LEVELS = (0.0, 0.25)

PLAIN, SLIDING, BASELINE, PROPOSED = (
    "computed_torque",
    "sliding_mode",
    "sliding_computed_torque",
    "fuzzy_sliding_computed_torque",
)
TITLES = {
    PLAIN: "computed torque",
    SLIDING: "sliding mode",
    BASELINE: "sliding-surface computed torque (paper's baseline)",
    PROPOSED: "fuzzy sliding-surface computed torque (proposed)",
}
PRINTED = {(BASELINE, 0.0): 1.0e-4, (PROPOSED, 0.0): 2.0e-4, (BASELINE, 0.25): 0.12, (PROPOSED, 0.25): 2.2e-4}
"""Table 1 of the paper: error [rad], keyed by method and disturbance."""

MAIN, WEAK, UNEQUAL, SMOOTH = "as-written", "weak", "unequal", "layer"

ENOUGH, TOO_LITTLE = 0.01, 0.003
"""Switching gain K [N·m] above and below the size of the 25 % disturbance, about 0.0036 N·m here."""


class Variant(NamedTuple):
    """Choice of switching function and gain, which the paper does not specify.

    Attributes:
        title: title in the table.
        meaning: description in a sentence.
        gains: parameters of the laws that have a switching term, keyed by law.
    """

    title: str
    meaning: str
    gains: dict[str, dict[str, Any]]


def _equal(**gains: Any) -> dict[str, dict[str, Any]]:
    return dict.fromkeys((SLIDING, BASELINE, PROPOSED), gains)


VARIANTS = {
    MAIN: Variant(
        "sign, K > d (as written)",
        "Equations (34)–(35) and (44)–(48) to the letter: sign switching, equal K above the disturbance, only λ tuned.",
        _equal(switching="sign", K=ENOUGH),
    ),
    WEAK: Variant(
        "sign, K < d",
        "The same with equal K below the disturbance.",
        _equal(switching="sign", K=TOO_LITTLE),
    ),
    UNEQUAL: Variant(
        "sign, unequal K",
        "Sign switching with K below the disturbance for the paper's baseline and above it for its proposal.",
        {**_equal(switching="sign", K=ENOUGH), BASELINE: {"switching": "sign", "K": TOO_LITTLE}},
    ),
    SMOOTH: Variant(
        "tanh boundary layer",
        "The package's defaults: tanh switching in a boundary layer φ, equal K well above the disturbance.",
        _equal(),
    ),
}
EQUAL = (MAIN, WEAK, SMOOTH)
"""Variants in which both methods have the same switching gain, so that they differ in the tuning alone."""
SIGN = (MAIN, WEAK)
"""Those of them that switch by the sign."""
