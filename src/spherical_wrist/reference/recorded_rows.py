"""Rows of a recorded motion: times and attitudes, checked, with the row named that is wrong."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError

Numbers = npt.NDArray[Any]

LAST_ROW = 1_000_000
"""Most rows that are read: a quarter of an hour at 1 kHz, nine hours at 30 Hz."""
FEWEST = 4
SHORTEST = 1e-6
"""Least time between rows [s]."""
TOLERANCE = 0.02
"""Largest error of a quaternion's norm, and of an entry of RᵀR, that is put right instead of refused."""
SAME = 1e-6
"""Largest angle [rad] between two attitudes that agree."""

PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
"""Units of time, by name, in a second."""
UNIT_NAMES = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
EPOCH = 1e9, 4e9
"""Seconds since 1970 of the years 2001 to 2096, by which the unit of a time stamp is known."""
PLAUSIBLE = 2e-4, 0.5
"""Usual times from row to row [s]."""


class Track(NamedTuple):
    """A recorded motion.

    Attributes:
        time: times [s], (n,), increasing from 0.
        attitude: unit quaternions (w, x, y, z), (n, 4), of either sign.
        row: number of each row among the rows of the file, from 1, (n,).
    """

    time: Array
    attitude: Array
    row: npt.NDArray[np.int64]


class Stamps(NamedTuple):
    """Times of a file.

    Attributes:
        ticks: numbers (n,), integers where they are exact.
        per_unit: ticks in a unit.
        unit: unit of time, a key of ``PER_SECOND``; None where nothing says it.
    """

    ticks: Numbers
    per_unit: float
    unit: str | None

    def seconds(self, unit: str) -> Array:
        """Return the times [s] since the first; differences are taken before anything is rounded."""
        with np.errstate(over="ignore", invalid="ignore"):
            since = self.ticks - self.ticks[:1]
        return np.asarray(since / (self.per_unit * PER_SECOND[unit]), dtype=np.float64)


class RowError(ParameterError):
    """A recorded motion is not valid; the reader adds the name of the file."""


def track_of(
    stamps: Stamps | float, attitude: Array, largest_gap: float, unit: str | None = None
) -> tuple[Track, tuple[str, ...]]:
    """Return the motion of rows, and a sentence on rows that were left out.

    Rows without an attitude (not-a-number, or a quaternion of zeros) are left out, and so is the second of two rows
    with the same time and attitude.

    Args:
        stamps: times of any origin, or the number of rows in a second.
        attitude: unit quaternions (n, 4), not-a-number where a row has none.
        largest_gap: longest time between rows [s].
        unit: unit of the times, whatever the file says.

    Raises:
        RowError: there are too few rows, times do not increase, or the gap between two is too long.
    """
    row = np.arange(1, len(attitude) + 1)
    if isinstance(stamps, Stamps):
        stamped = stamps.unit if unit is None else unit
        time = stamps.seconds(stamped or "s")
        refuse(~np.isfinite(stamps.ticks), "has no finite time", row)
    else:
        time = (row - 1) / stamps
    seen = np.isfinite(attitude).all(axis=1)
    notes = []
    if not seen.all():
        notes.append(f"{_counted(~seen, row)} without an attitude, left out")
        time, attitude, row = time[seen], attitude[seen], row[seen]
    if len(time) < FEWEST:
        raise RowError(f"at least {FEWEST} rows are needed; it has {len(time)}")
    if isinstance(stamps, Stamps):
        twice = np.append(False, np.diff(time) == 0.0)
        if twice.any():
            turn = np.append(0.0, angles_between(attitude))
            refuse(
                twice & (turn > SAME),
                "has the time of the row before and another attitude",
                row,
                ": if rows are evenly spaced, give reference.rate [Hz]",
            )
            notes.append(f"{_counted(twice, row)} with the time and the attitude of the row before, left out")
            time, attitude, row = time[~twice], attitude[~twice], row[~twice]
            if len(time) < FEWEST:
                raise RowError(f"at least {FEWEST} rows are needed; it has {len(time)} of different times")
    with np.errstate(over="ignore"):
        steps = np.append(SHORTEST, np.diff(time))
    if isinstance(stamps, Stamps) and not stamped:
        _check_unit(stamps, steps[1:], largest_gap)
    even = ": sort the rows, or if they are evenly spaced give reference.rate [Hz]"
    refuse(steps <= 0.0, "is not later than the row before", row, even)
    close = f"is less than {SHORTEST:g} s later than the row before"
    refuse(steps < SHORTEST, close, row, ": give another reference.time_unit, or reference.rate [Hz]")
    refuse(steps > largest_gap, f"is more than largest_gap = {largest_gap:g} s later than the row before", row)
    return Track(time - time[0], attitude, row), tuple(notes)


def too_long() -> RowError:
    """Return the complaint about more rows than are read."""
    return RowError(f"it has more than {LAST_ROW} rows; cut it, or keep every so-many-th row")


def angles_between(attitude: Array) -> Array:
    """Return the angles [rad] from row to row, (n − 1,), of unit quaternions (n, 4)."""
    apart = np.minimum(
        np.linalg.norm(attitude[1:] - attitude[:-1], axis=1), np.linalg.norm(attitude[1:] + attitude[:-1], axis=1)
    )
    return np.asarray(4.0 * np.arcsin(np.minimum(0.5 * apart, 1.0)))


def attitudes_of(kind: str, values: Array) -> Array:
    """Return unit quaternions (n, 4) of quaternions (n, 4), matrices (n, 9), or rotation vectors or angles (n, 3).

    Rows with a not-a-number, and quaternions and matrices of zeros, come back as not-a-number.

    Raises:
        RowError: a row is no rotation.
    """
    values = values.copy()
    missing = np.isnan(values).any(axis=1)
    if values.shape[1] > 3:
        missing |= (values == 0.0).all(axis=1)
    refuse(~np.isfinite(values).all(axis=1) & ~missing, "has no finite attitude", np.arange(1, len(values) + 1))
    found = np.full((len(values), 4), np.nan)
    kept, row = values[~missing], np.flatnonzero(~missing) + 1
    if kind == "quaternion":
        found[~missing] = _quaternions(kept, row)
    elif kind == "rotation matrix":
        found[~missing] = _from_matrices(kept, row)
    elif kind.startswith("roll"):
        found[~missing] = _from_angles(kept, row, degrees=kind.endswith("[deg]"))
    else:
        found[~missing] = _from_vectors(kept, row, degrees=kind.endswith("[deg]"))
    return found


def _quaternions(values: Array, row: Numbers) -> Array:
    wrong = np.abs(values).max(axis=1, initial=0.0) > 2.0
    norm = np.linalg.norm(np.where(wrong[:, None], 2.0, values), axis=1)
    refuse(
        np.abs(norm - 1.0) > TOLERANCE,
        f"has a quaternion whose norm is not 1 to within {TOLERANCE:g}",
        row,
        ": other columns are named with reference.columns",
    )
    return np.asarray(values / norm[:, None])


def _from_matrices(values: Array, row: Numbers) -> Array:
    """Return quaternions (n, 4) of the rotations nearest to matrices (n, 9)."""
    from scipy.spatial.transform import Rotation

    fault = f"has a matrix that is not a rotation to within {TOLERANCE:g}"
    refuse(np.abs(values).max(axis=1, initial=0.0) > 2.0, fault, row)
    matrices = values.reshape(-1, 3, 3)
    far = np.abs(matrices.transpose(0, 2, 1) @ matrices - np.eye(3)).max(axis=(1, 2), initial=0.0) > TOLERANCE
    refuse(far | (np.linalg.det(matrices) < 0.0), fault, row)
    return np.asarray(Rotation.from_matrix(matrices).as_quat(scalar_first=True)) if len(matrices) else np.empty((0, 4))


def _from_vectors(values: Array, row: Numbers, *, degrees: bool) -> Array:
    from scipy.spatial.transform import Rotation

    turn = np.abs(values).max(axis=1, initial=0.0)
    if not degrees:
        refuse(turn > 4.0 * np.pi, "has a rotation of two turns and more", row, ": in degrees it is rx_deg=NAME, …")
    refuse(turn > 1e6, "has a rotation of more than a million degrees", row)
    return np.asarray(Rotation.from_rotvec(values, degrees=degrees).as_quat(scalar_first=True))


def _from_angles(values: Array, row: Numbers, *, degrees: bool) -> Array:
    """Return quaternions (n, 4) of roll, pitch and yaw (n, 3): R = Rz(yaw) Ry(pitch) Rx(roll)."""
    from scipy.spatial.transform import Rotation

    turn = np.abs(values).max(axis=1, initial=0.0)
    if not degrees:
        refuse(turn > 4.0 * np.pi, "has an angle of two turns and more", row, ": in degrees it is roll_deg=NAME, …")
    refuse(turn > 1e6, "has an angle of more than a million degrees", row)
    return np.asarray(Rotation.from_euler("xyz", values, degrees=degrees).as_quat(scalar_first=True))


def _check_unit(stamps: Stamps, steps: Array, largest_gap: float) -> None:
    """Complain of numbers that are no seconds: stamps of another unit, or hours from row to row."""
    usual, size = float(np.median(np.abs(steps))), float(np.abs(stamps.ticks).max()) / stamps.per_unit
    if usual <= largest_gap:
        return
    likely = [unit for unit, count in PER_SECOND.items() if EPOCH[0] <= size / count <= EPOCH[1]]
    slow = "" if likely else "; if they are seconds, a longer reference.largest_gap"
    if not likely:
        likely = [unit for unit, count in PER_SECOND.items() if PLAUSIBLE[0] <= usual / count <= PLAUSIBLE[1]]
    if likely and "s" not in likely:
        names, settings = (
            " or ".join(texts)
            for texts in ([UNIT_NAMES[unit] for unit in likely], [f"reference.time_unit={unit}" for unit in likely])
        )
        raise RowError(f"its times look like {names} ({usual:.3g} from row to row): give {settings}{slow}")


def refuse(wrong: Any, fault: str, row: Numbers, advice: str = "") -> None:
    """Complain of the first row that is wrong.

    Raises:
        RowError: a row is wrong.
    """
    if wrong.any():
        rows = row[wrong]
        more = f" (and {len(rows) - 1} more)" if len(rows) > 1 else ""
        raise RowError(f"data row {rows[0]} {fault}{more}{advice}")


def _counted(which: Any, row: Numbers) -> str:
    rows = row[which]
    return f"data row {rows[0]}" if len(rows) == 1 else f"{len(rows)} rows (the first: data row {rows[0]})"
