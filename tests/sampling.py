"""The switch of the long tests: a sample of each kind runs by default, all of it with WRIST_THOROUGH=1.

WRIST_THOROUGH=20 runs all of it, with twenty times as many random moments and examples.
"""

import os
from collections.abc import Iterable
from itertools import product
from typing import Any

import pytest

THOROUGH = int(os.environ.get("WRIST_THOROUGH") or 0)
"""0 for a sample; otherwise the multiple of random moments and examples."""

long = pytest.mark.skipif(not THOROUGH, reason="long; WRIST_THOROUGH=1 runs it")
"""Mark of a test of which a shorter one of the same kind always runs."""


SMALLER = {
    "frontier": ["--set", "duration=1"],
    "render": ["--fps", "5"],
    "tune": ["--trials", "2", "--duration", "0.3"],
}
"""Options that make the task of a long command smaller; they replace those of an example in the documentation."""


def count(sample: int, whole: int) -> int:
    """Return how many random moments or examples to try."""
    return whole * THOROUGH or sample


def some(cases: Iterable[Any], step: int) -> list[Any]:
    """Return every ``step``-th case, the first one among them; with WRIST_THOROUGH=1, all."""
    return list(cases)[:: 1 if THOROUGH else step]


def pairs(ones: Iterable[Any], others: Iterable[Any]) -> list[tuple[Any, Any]]:
    """Return pairs in which every one and every other occurs; with WRIST_THOROUGH=1, all pairs."""
    first, second = list(ones), list(others)
    if THOROUGH:
        return list(product(first, second))
    return [(first[k % len(first)], second[k % len(second)]) for k in range(max(len(first), len(second)))]
