"""Rows of a recorded motion: times and attitudes, checked, with the row named that is wrong."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import ParameterError

Array = npt.NDArray[np.float64]

TIMES = ("time", "t", "timestamp")
QUATERNIONS = (("qw", "qx", "qy", "qz"), ("w", "x", "y", "z"))
MATRIX = tuple(f"r{row}{column}" for row in "123" for column in "123")
LAST_ROW = 1_000_000
"""Most rows that are read: a quarter of an hour at 1 kHz, nine hours at 30 Hz."""
FEWEST = 4
SHORTEST = 1e-6
"""Least time between rows [s]."""
TOLERANCE = 0.02
"""Largest error of a quaternion's norm, and of an entry of RᵀR, that is put right instead of refused."""


class Track(NamedTuple):
    """A recorded motion.

    Attributes:
        time: times [s], (n,), increasing from 0.
        attitude: unit quaternions (w, x, y, z), (n, 4), of either sign.
    """

    time: Array
    attitude: Array


class RowError(ParameterError):
    """A recorded motion is not valid; the reader adds the name of the file."""


def columns_of(names: Iterable[str]) -> list[int]:
    """Return the numbers of the columns of time and attitude (4 or 9 of them), by their names in any case.

    Raises:
        RowError: they are not there, or one of them is there twice.
    """
    found = [name.strip().strip("\"'").strip().lower() for name in names]
    time = next((name for name in TIMES if name in found), None)
    attitude = next((group for group in (*QUATERNIONS, MATRIX) if set(group) <= set(found)), None)
    if time is None or attitude is None:
        raise RowError(
            "columns of time [s] (time, t or timestamp) and attitude (qw, qx, qy, qz, or w, x, y, z, or "
            f"r11, r12 … r33) are needed; it has {_listed(found)}"
        )
    wanted = [time, *attitude]
    for name in wanted:
        if found.count(name) > 1:
            raise RowError(f"it has more than one column {name!r}")
    return [found.index(name) for name in wanted]


def track_of(time: Array, values: Array, largest_gap: float) -> Track:
    """Return the motion of rows.

    Args:
        time: times [s], (n,), of any origin.
        values: quaternions (n, 4) or rotation matrices, row by row, (n, 9).
        largest_gap: longest time between rows [s].

    Raises:
        RowError: a row is not a time and a rotation, times do not increase, or the gap between two is too long.
    """
    if len(time) < FEWEST:
        raise RowError(f"at least {FEWEST} rows are needed; it has {len(time)}")
    _refuse(~np.isfinite(time), "has no finite time")
    _refuse(~np.isfinite(values).all(axis=1), "has no finite attitude")
    with np.errstate(over="ignore"):
        steps = np.diff(time)
    _refuse(steps <= 0.0, "is not later than the row before", first=2)
    _refuse(steps < SHORTEST, f"is less than {SHORTEST:g} s later than the row before", first=2)
    _refuse(steps > largest_gap, f"is more than largest_gap = {largest_gap:g} s later than the row before", first=2)
    return Track(time - time[0], _quaternions(values) if values.shape[1] == 4 else _from_matrices(values))


def too_long() -> RowError:
    """Return the complaint about more rows than are read."""
    return RowError(f"it has more than {LAST_ROW} rows; cut it, or keep every so-many-th row")


def _quaternions(values: Array) -> Array:
    wrong = np.abs(values).max(axis=1) > 2.0
    norm = np.linalg.norm(np.where(wrong[:, None], 2.0, values), axis=1)
    _refuse(np.abs(norm - 1.0) > TOLERANCE, f"has a quaternion whose norm is not 1 to within {TOLERANCE:g}")
    return np.asarray(values / norm[:, None])


def _from_matrices(values: Array) -> Array:
    """Return quaternions (n, 4) of the rotations nearest to matrices (n, 9)."""
    from scipy.spatial.transform import Rotation

    fault = f"has a matrix that is not a rotation to within {TOLERANCE:g}"
    _refuse(np.abs(values).max(axis=1) > 2.0, fault)
    matrices = values.reshape(-1, 3, 3)
    far = np.abs(matrices.transpose(0, 2, 1) @ matrices - np.eye(3)).max(axis=(1, 2)) > TOLERANCE
    _refuse(far | (np.linalg.det(matrices) < 0.0), fault)
    return np.asarray(Rotation.from_matrix(matrices).as_quat(scalar_first=True))


def _refuse(wrong: Any, fault: str, first: int = 1) -> None:
    """Complain of the first row that is wrong; ``first`` is the number of the first one."""
    if wrong.any():
        rows = np.flatnonzero(wrong)
        more = f" (and {len(rows) - 1} more)" if len(rows) > 1 else ""
        raise RowError(f"data row {rows[0] + first} {fault}{more}")


def _listed(names: list[str]) -> str:
    named = [repr(name) for name in names if name]
    return ", ".join(named[:12]) + (f" and {len(named) - 12} more" if len(named) > 12 else "") or "none"
