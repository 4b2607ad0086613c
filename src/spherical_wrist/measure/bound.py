"""Bounds by which runs are judged, unless a run, a search or a report is given its own."""

BOUND = 0.1
"""Largest acceptable tip error [mm].

Typically required on coronary arteries of 2–3 mm: Bachta et al., IEEE T-RO 27(4), 2011.
"""

ATTITUDE_BOUND = 0.01
"""Largest attitude error [rad] that is not worth a word beside the tip error.

An attitude error about the tool's own axis leaves the tip where it is, but turns what the tool holds: at 0.01 rad, the
point of a curved needle 10 mm from that axis is 0.1 mm away from its place.
"""

SOURCE = "the accuracy that coronary surgery typically needs (Bachta et al., 2011)"
"""Origin of the bound, in words."""


def meaning_of(bound: float) -> str:
    """Return the meaning of a bound [mm] in words: the source of the usual one, or that it was given."""
    return SOURCE if bound == BOUND else f"the bound of this run, in place of the usual {BOUND:g} mm"
