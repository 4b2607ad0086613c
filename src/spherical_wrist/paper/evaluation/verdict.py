"""Verdicts on claims: each is tested under several conditions, and the verdict follows from the trials.

The thresholds are stated here once, for all claims.
"""

from enum import StrEnum
from typing import NamedTuple

SAME = 2.0
"""Two figures are *about the same* within this factor: the paper says so of its 0.0001 and 0.0002 rad."""
REDUCED = 0.9
"""A figure is *reduced* if it falls to this fraction or below."""
MUCH = 10.0
"""A figure is *much* larger or smaller beyond this factor."""
VISIBLE = 0.01
"""A deviation is *negligible* below this fraction of the motion: a figure's curves are about as thick."""

THRESHOLDS = (
    f"Two figures are about the same within a factor of {SAME:g}, as the paper says of its 0.0001 and 0.0002 rad; one "
    f"is reduced if it falls by {100.0 * (1.0 - REDUCED):.0f} % or more, and much larger or smaller beyond a factor of "
    f"{MUCH:g}; a deviation is negligible below {100.0 * VISIBLE:g} % of the motion. A claim that holds under all "
    "conditions tested is reproduced; one that holds under some of them is reproduced under a condition."
)
"""The thresholds in words."""


class ClaimVerdict(StrEnum):
    """Verdict on a claim."""

    REPRODUCED = "reproduced"
    CONDITIONAL = "reproduced under a condition"
    NOT_REPRODUCED = "not reproduced"


class ClaimTrial(NamedTuple):
    """Trial of a claim under one condition.

    Attributes:
        condition: condition, such as a variant of the switching.
        holds: True if the claim holds under it.
        figures: figures that decide it.
    """

    condition: str
    holds: bool
    figures: str


class Finding(NamedTuple):
    """Claim of the paper with its trials.

    Attributes:
        claim: statement of the paper, in our words.
        source: place in the paper.
        trials: trials, in the order in which they are shown.
        remark: sentences that explain the figures; may be empty.
    """

    claim: str
    source: str
    trials: tuple[ClaimTrial, ...]
    remark: str = ""

    @property
    def verdict(self) -> ClaimVerdict:
        """Verdict, from the trials alone."""
        held = [trial.holds for trial in self.trials]
        if all(held):
            return ClaimVerdict.REPRODUCED
        return ClaimVerdict.CONDITIONAL if any(held) else ClaimVerdict.NOT_REPRODUCED

    @property
    def evidence(self) -> str:
        """Evidence in one paragraph."""
        words = (f"{'Holds' if trial.holds else 'Fails'}, {trial.condition}: {trial.figures}." for trial in self.trials)
        return " ".join([*words, self.remark]).strip()


def same(value: float, other: float) -> bool:
    """Return True if two positive figures are about the same."""
    return other / SAME <= value <= other * SAME


def times(value: float, other: float) -> str:
    """Write a positive figure as a multiple of another, "25 times", "0.51 times" or "1/87 of", for "… the other"."""
    ratio = value / other
    if ratio < 0.1:
        return f"1/{1.0 / ratio:.0f} of"
    return f"{ratio:.0f} times" if ratio >= 10.0 else f"{ratio:#.2g} times"


def number(value: float) -> str:
    """Write a number with three significant digits."""
    return f"{value:.3g}" if 0.01 <= abs(value) < 1000.0 or value == 0.0 else f"{value:.2e}"
