"""Difference of two series, channel by channel: the first row that differs, the largest difference and its RMS.

The difference of a row is the Euclidean norm of the difference of its vectors; of attitudes, the angle between them, in
which q and −q are one. Two numbers are the same only where their bits are, but that one not-a-number is like another.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.channels import CHANNELS, Channel
from spherical_wrist.inspection.instants import Common, common_instants
from spherical_wrist.measure.series import Series

Flags = npt.NDArray[np.bool_]


class CommonRow(NamedTuple):
    """A row of two series.

    Attributes:
        time: of the row [s].
        row_a: its number in the first series, from 0.
        row_b: its number in the second.
    """

    time: float
    row_a: int
    row_b: int


@dataclass(frozen=True)
class ArrayDifference:
    """Difference of one channel of two series, over the instants that they have in common.

    Attributes:
        name: of the array.
        unit: of the difference; ``rad`` for attitudes.
        components: numbers per row in either series, 0 where it has no such array. Where they differ, nothing else is
            known.
        first: where the bits differ first; None where they never do.
        beyond: where the difference exceeds the tolerance first.
        largest: largest difference; None where no row has one, because one of two numbers is not finite.
        largest_at: where that is.
        rms: root mean square of the difference over the rows that have one.
        undefined: rows that differ and have no finite difference.
    """

    name: str
    unit: str
    components: tuple[int, int]
    first: CommonRow | None = None
    beyond: CommonRow | None = None
    largest: float | None = None
    largest_at: CommonRow | None = None
    rms: float | None = None
    undefined: int = 0

    @property
    def comparable(self) -> bool:
        """True if both series have the channel, with as many components."""
        return self.components[0] == self.components[1]

    @property
    def same(self) -> bool:
        """True if no row differs by more than the tolerance."""
        return self.comparable and self.beyond is None


@dataclass(frozen=True)
class Difference:
    """Difference of two series.

    Attributes:
        tolerance: largest difference that counts as none, in the unit of every array; 0 asks for the same bits.
        rows: numbers of rows of either series.
        spans: first and last instant of either [s]; None for a series without rows.
        common: instants that both have.
        common_span: first and last of these [s]; None where there is none.
        whole: whether neither series goes on where the other has ended. Of a thinned and a full one neither does.
        arrays: every array that one of them has.
    """

    tolerance: float
    rows: tuple[int, int]
    spans: tuple[tuple[float, float] | None, tuple[float, float] | None]
    common: int
    common_span: tuple[float, float] | None
    whole: bool
    arrays: tuple[ArrayDifference, ...]

    @property
    def same(self) -> bool:
        """True if the series are the same, but for the tolerance and for rows that thinning left out."""
        compared = self.common > 0 or self.rows == (0, 0)
        return self.whole and compared and all(array.same for array in self.arrays)

    @property
    def first(self) -> CommonRow | None:
        """First place where any channel differs by more than the tolerance; None if none does."""
        return min((array.beyond for array in self.arrays if array.beyond is not None), default=None)


def difference(a: Series, b: Series, tolerance: float = 0.0) -> Difference:
    """Compare two series array by array, over the instants that both have.

    Args:
        a: a series.
        b: another one; it may be thinned, or end at another time.
        tolerance: largest difference of a row that counts as none, absolute, in the unit of the array (rad, rad/s,
            N·m, m …); 0 asks for the same bits.
    """
    common = common_instants(a.time, b.time)
    time = a.time[common.rows_a]
    names = [name for name in (*CHANNELS, *a.channels, *b.channels) if name in a.channels or name in b.channels]
    found = [_compare(name, a, b, common, time, tolerance) for name in dict.fromkeys(names)]
    return Difference(
        tolerance=tolerance,
        rows=(len(a), len(b)),
        spans=(_span(a.time), _span(b.time)),
        common=common.instants,
        common_span=_span(time),
        whole=common.whole,
        arrays=tuple(found),
    )


def sizes(channel: Channel, a: Array, b: Array) -> Array:
    """Compute the difference of every row, (n,), in the unit of the channel; infinite if two rows have no finite one.

    Args:
        channel: the channel.
        a: its rows, (n,) or (n, m).
        b: likewise.
    """
    a, b = (rows.reshape(len(rows), -1) for rows in (a, b))
    with np.errstate(all="ignore"):
        if channel.is_attitude:
            side = np.where(np.einsum("ij,ij->i", a, b) < 0.0, -1.0, 1.0)[:, None]
            size = 4.0 * np.arctan2(_norm(a - side * b), _norm(a + side * b))
        else:
            both_missing = np.isnan(a) & np.isnan(b)
            size = _norm(np.where((a == b) | both_missing, 0.0, a - b))
    size[~np.isfinite(size)] = np.inf
    size[~differing(channel, a, b)] = 0.0
    return size


def differing(channel: Channel, a: Array, b: Array) -> Flags:
    """Return True for rows that differ in a bit, (n,); for an attitude, both from q and from −q."""
    a, b = (np.ascontiguousarray(rows.reshape(len(rows), -1)) for rows in (a, b))
    differ = _bits_differ(a, b)
    return differ & _bits_differ(a, -b) if channel.is_attitude and differ.any() else differ


def _bits_differ(a: Array, b: Array) -> Flags:
    differ: Flags = ((a.view(np.uint64) != b.view(np.uint64)) & ~(np.isnan(a) & np.isnan(b))).any(axis=1)
    return differ


def _compare(name: str, left: Series, right: Series, common: Common, time: Array, tolerance: float) -> ArrayDifference:
    channel = (left if name in left.channels else right).channel(name)
    unit, components = channel.difference_unit, (_components(left, name), _components(right, name))
    if components[0] != components[1] or not common.instants:
        return ArrayDifference(name, unit, components)
    a, b = left.channels[name][common.rows_a], right.channels[name][common.rows_b]
    differ = differing(channel, a, b)
    if not differ.any():
        return ArrayDifference(name, unit, components, largest=0.0, rms=0.0)
    size = sizes(channel, a, b)
    beyond = differ & ~(size <= tolerance) if tolerance > 0.0 else differ
    finite = np.isfinite(size)
    shown = size[finite]
    worst = int(np.where(finite, size, -1.0).argmax())
    return ArrayDifference(
        name,
        unit,
        components,
        first=_place(differ, common, time),
        beyond=_place(beyond, common, time),
        largest=float(size[worst]) if len(shown) else None,
        largest_at=_at(worst, common, time) if len(shown) else None,
        rms=float(np.sqrt(np.mean(np.square(shown)))) if len(shown) else None,
        undefined=int(len(size) - len(shown)),
    )


def _place(flags: Flags, common: Common, time: Array) -> CommonRow | None:
    return _at(int(flags.argmax()), common, time) if flags.any() else None


def _at(index: int, common: Common, time: Array) -> CommonRow:
    rows = (index if isinstance(rows, slice) else int(rows[index]) for rows in (common.rows_a, common.rows_b))
    return CommonRow(float(time[index]), *rows)


def _components(series: Series, name: str) -> int:
    array = series.channels.get(name)
    return 0 if array is None else 1 if array.ndim == 1 else array.shape[1]


def _span(time: Array) -> tuple[float, float] | None:
    return (float(time[0]), float(time[-1])) if len(time) else None


def _norm(rows: Array) -> Array:
    norm: Array = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    return norm
