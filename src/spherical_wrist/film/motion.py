"""Motion of a recorded run, interpolated."""

from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from spherical_wrist.arrays import Array
from spherical_wrist.errors import RecordingError
from spherical_wrist.measure.series import Series

FAR = 1e6
"""Largest distance of a tool tip that is shown [m]; runs that diverge have larger ones."""


class Poses(NamedTuple):
    """Poses of a run at the recorded instants.

    Attributes:
        time: recorded instants [s], (n,).
        attitude: actual attitude, unit quaternion (w, x, y, z), body → world, (n, 4).
        desired_attitude: likewise, (n, 4).
        tip: tool tip in the world [m], (n, 3).
        desired_tip: where it would be at the desired attitude [m], (n, 3).
        end: end of the last recorded period [s].
    """

    time: Array
    attitude: Array
    desired_attitude: Array
    tip: Array
    desired_tip: Array
    end: float

    @classmethod
    def of(cls, series: Series) -> Self:
        """Extract the motion, up to the last instant with a pose: a run that diverged has none after it.

        Raises:
            RecordingError: there is no instant with a pose.
        """
        shown = _shown(series)
        count = len(series) if shown.all() else int(np.argmin(shown))
        if not count:
            raise RecordingError("the recording has no instant at which the wrist has a pose: there is nothing to show")
        time = series.time[:count]
        period = float(np.median(np.diff(time))) if count > 1 else 0.0
        rows = series.rows(slice(count))
        end = float(time[-1]) + period
        return cls(time, rows.attitude, rows.desired_attitude, rows.tip, rows.desired_tip, end)

    def attitudes(self, instants: Array) -> Array:
        """Interpolate the actual attitude at instants [s], (m,): quaternions (m, 4), on the shortest arc."""
        return _between(self.time, self.attitude, instants)

    def desired_attitudes(self, instants: Array) -> Array:
        """Interpolate the desired attitude likewise."""
        return _between(self.time, self.desired_attitude, instants)

    def tip_error(self) -> Array:
        """Compute the distance between actual and desired tool tip at the recorded instants [m], (n,)."""
        distance: Array = np.linalg.norm(self.desired_tip - self.tip, axis=1)
        return distance


def _shown(series: Series) -> npt.NDArray[np.bool_]:
    """Find the rows that have a pose; comparisons with NaN are False."""
    shown = np.ones(len(series), dtype=bool)
    for attitude in (series.attitude, series.desired_attitude):
        shown &= np.abs(attitude).max(axis=1, initial=0.0) < 2.0  # before the norm, which could overflow
        shown[shown] &= np.abs(np.linalg.norm(attitude[shown], axis=1) - 1.0) < 0.1
    for tip in (series.tip, series.desired_tip):
        shown &= np.abs(tip).max(axis=1, initial=0.0) < FAR
    return shown


def _between(time: Array, attitude: Array, instants: Array) -> Array:
    after = np.searchsorted(time, instants, side="right").clip(1, max(1, len(time) - 1))
    before, after = after - 1, after.clip(max=len(time) - 1)
    gap = np.where(after > before, time[after] - time[before], 1.0)
    share = ((instants - time[before]) / gap).clip(0.0, 1.0)
    first, last = (Rotation.from_quat(attitude[rows], scalar_first=True) for rows in (before, after))
    turn = Rotation.from_rotvec(share[:, None] * (first.inv() * last).as_rotvec())
    quaternions: Array = (first * turn).as_quat(scalar_first=True)
    return quaternions
