"""Curves as they are drawn: few points that look like all, and the part of an axis that is worth showing."""

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array

BINS = 500
"""Pieces into which a curve of more points is cut: about as many as a panel has pixels."""

_HUGE = 1e12
"""Beyond it nothing is drawn: a run that diverges may say anything."""


def telling_rows(values: Array, bins: int = BINS) -> npt.NDArray[np.intp]:
    """Rows of a curve that draw the same line as all of its rows: of every bin the first, last, smallest and largest.

    So chattering keeps its width however far a curve is reduced (M4 aggregation; Jugel et al., Proc. VLDB 7(10), 2014).

    Args:
        values: the curve, (n,), or several that are drawn from the same rows, (n, m). What is not a number is skipped,
            unless a whole bin is not.
        bins: number of bins; a curve of at most four times as many rows keeps all.

    Returns:
        Ascending rows.
    """
    count = len(values)
    if count <= 4 * bins:
        return np.arange(count)
    width = -(-count // bins)
    whole = count // width * width
    starts = np.arange(0, whole, width)
    found = [starts, starts + width - 1, np.arange(whole, count)]
    for curve in values.reshape(count, -1).T:
        pieces = curve[:whole].reshape(-1, width)
        missing = np.isnan(pieces)
        found.append(starts + np.where(missing, np.inf, pieces).argmin(axis=1))
        found.append(starts + np.where(missing, -np.inf, pieces).argmax(axis=1))
    return np.unique(np.concatenate(found))


def drawable(values: Array) -> Array:
    """Return a copy in which numbers that are not finite, or huge, are not-a-number."""
    return np.where(np.abs(values) < _HUGE, values, np.nan)


def with_gaps(vectors: Array) -> Array:
    """A copy of rotation vectors [rad], (n, 3), with a gap where one jumps by more than π: it passed a half turn."""
    with np.errstate(all="ignore"):
        jumps = np.sqrt(np.square(np.diff(vectors, axis=0)).sum(axis=1)) > np.pi
    kept = vectors.copy()
    kept[1:][jumps] = np.nan
    return kept


def view(values: Array, squeezed: float = 4.0) -> tuple[float, float, bool]:
    """Ends of an axis: all values are inside, unless a few of them would squeeze the rest into a quarter of it.

    Args:
        values: what is drawn; may have what is not a number.
        squeezed: how many times longer than the bulk an axis may be.

    Returns:
        Lower end, upper end, and whether there are values beyond them.
    """
    finite = values[np.isfinite(values)]
    if not len(finite):
        return -1.0, 1.0, False
    whole = float(finite.min()), float(finite.max())
    low, high = (float(end) for end in np.quantile(finite, (0.02, 0.98)))
    cut = whole[1] - whole[0] > squeezed * (high - low) > 0.0
    if cut:
        room = 0.3 * (high - low)
        low, high = max(low - room, whole[0]), min(high + room, whole[1])
    else:
        low, high = whole
    margin = 0.06 * (high - low) or 0.06 * abs(high) or 1.0
    return low - margin, high + margin, cut
