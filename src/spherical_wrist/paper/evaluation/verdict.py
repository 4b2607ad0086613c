"""Verdicts on claims."""

from enum import StrEnum
from typing import NamedTuple


class Verdict(StrEnum):
    """Verdict on a claim."""

    REPRODUCED = "reproduced"
    CONDITIONAL = "reproduced under a condition"
    NOT_REPRODUCED = "not reproduced"


class Finding(NamedTuple):
    """Claim of the paper with its verdict.

    Attributes:
        claim: statement of the paper, in our words.
        source: place in the paper.
        verdict: verdict on it.
        evidence: figures behind the verdict, and the condition if there is one.
    """

    claim: str
    source: str
    verdict: Verdict
    evidence: str


def number(value: float) -> str:
    """Write a number with three significant digits."""
    return f"{value:.3g}" if 0.01 <= abs(value) < 1000.0 or value == 0.0 else f"{value:.2e}"
