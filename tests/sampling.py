"""The switch of the long tests: a sample of each runs by default, all of it with WRIST_THOROUGH=1.

WRIST_THOROUGH=20 runs all of it, with twenty times as many random moments and examples.
"""

import os

THOROUGH = int(os.environ.get("WRIST_THOROUGH") or 0)
"""0 for a sample; otherwise the multiple of random moments and examples."""


def count(sample: int, whole: int) -> int:
    """Return how many random moments or examples to try."""
    return whole * THOROUGH or sample
