"""What becomes of a claim."""

from enum import StrEnum
from typing import NamedTuple


class Verdict(StrEnum):
    """What became of a claim."""

    REPRODUCED = "reproduced"
    CONDITIONAL = "reproduced under a condition"
    NOT_REPRODUCED = "not reproduced"


class Finding(NamedTuple):
    """A claim and what became of it.

    Attributes:
        claim: what the paper says, in our words.
        source: where it says so.
        verdict: what became of it.
        evidence: the figures behind the verdict, and the condition if there is one.
    """

    claim: str
    source: str
    verdict: Verdict
    evidence: str


def number(value: float) -> str:
    """Three significant digits."""
    return f"{value:.3g}" if 0.01 <= abs(value) < 1000.0 or value == 0.0 else f"{value:.2e}"
