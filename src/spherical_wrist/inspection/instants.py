"""The instants that two series have in common."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array

Rows = npt.NDArray[np.intp] | slice

_RESOLUTION = 1e-9
"""Times [s] that are nearer than this are one instant; the timeline of a recording has the same resolution."""


class Common(NamedTuple):
    """Rows of two series that belong to the same instants.

    Attributes:
        rows_a: of the first series; a slice where that will do, so that nothing is copied.
        rows_b: of the second.
        instants: how many.
        whole: whether neither series goes on where the other has ended, or begins before it.
    """

    rows_a: Rows
    rows_b: Rows
    instants: int
    whole: bool


def common_instants(a: Array, b: Array) -> Common:
    """Find the common instants of two series.

    Series of which one is thinned, or of which each is in its own way, have few instants in common and are whole all
    the same: a series goes on beyond another one where that one, at its own spacing, would have had a further row.

    Args:
        a: ascending times [s] of a series.
        b: of another one.
    """
    if not (len(a) and len(b)):
        nothing = slice(0, 0)
        return Common(nothing, nothing, 0, len(a) == len(b))
    whole = not (_goes_beyond(a, b) or _goes_beyond(b, a))
    shorter = min(len(a), len(b))
    if (np.abs(a[:shorter] - b[:shorter]) < 0.5 * _RESOLUTION).all():
        first = slice(0, shorter)
        return Common(first, first, shorter, whole)
    _, rows_a, rows_b = np.intersect1d(_ticks(a), _ticks(b), return_indices=True)
    return Common(rows_a, rows_b, len(rows_a), whole)


def _ticks(time: Array) -> npt.NDArray[np.int64]:
    return np.rint(time / _RESOLUTION).astype(np.int64)


def _goes_beyond(time: Array, other: Array) -> bool:
    """Return True if ``time`` has instants so early or late that ``other`` lacks a row there."""
    spacing = [float(times[1] - times[0]) for times in (other, time) if len(times) > 1]
    excess = max(float(other[0] - time[0]), float(time[-1] - other[-1]))
    return excess > max(_RESOLUTION, 0.999 * spacing[0] if spacing else 0.0)
