"""A recorded motion as a smooth curve of quaternions."""

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.reference.curve import motion_of_curve
from spherical_wrist.reference.recorded_rows import RowError, Track

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline, PPoly

WIDEST = 0.5 * np.pi
"""Largest turn from row to row [rad]: beyond it, which way it went is a guess."""
AROUND = 1.9 * np.pi
"""Largest angle from the mean [rad] that can be scaled: at a whole turn its axis is anything."""

After = Literal["hold", "repeat"]


class Curve(NamedTuple):
    """A curve of quaternions, piecewise polynomial.

    Attributes:
        pieces: the curve, from ``first`` to ``last``; its quaternions are not of unit norm.
        first: where it begins [s]; before, it is held, if it does not repeat.
        last: where it ends [s].
        period: time after which it repeats [s]; 0 where it does not.
        sign: −1 where the repetition begins with the negative of the quaternions that it should begin with.
    """

    pieces: "PPoly"
    first: float
    last: float
    period: float = 0.0
    sign: float = 1.0

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """Return the motion at ``time`` [s], (n,), as an array of MOTION."""
        cycle = np.floor(time / self.period) if self.period else np.zeros_like(time)
        since = np.clip(time - cycle * self.period, self.first, self.last)
        motion = motion_of_curve(self.pieces(since), self.pieces(since, 1), self.pieces(since, 2))
        if self.sign < 0.0:
            motion["attitude"][np.mod(cycle, 2.0) == 1.0] *= -1.0
        return motion


def curve_of(spline: "CubicSpline", after: After, blend: float) -> Curve:
    """Return the curve of a recorded motion with its ends, from the spline through its rows.

    Args:
        spline: as :func:`spline_of` returns it.
        after: motion after its end.
        blend: time of coming to rest, or of going back to the start [s].

    Raises:
        RowError: its end turns too fast to be led back.
    """
    ends = motion_of_curve(*(spline(spline.x[[0, -1]], order) for order in range(3)))
    return _held(spline, ends, blend) if after == "hold" else _closed(spline, ends, blend)


def spline_of(track: Track, smoothing: float, scale: float = 1.0) -> "CubicSpline":
    """Return the spline through a recorded motion, relative to its mean attitude.

    Rows become quaternions q₀⁻¹ q, of the sign that does not jump, with the mean q₀ weighted by the time that each row
    stands for. A cubic spline through their four numbers, taken for a direction in R⁴, is an attitude with continuous
    acceleration, and the same whatever frames world and body are measured in. Smoothing fits, for the spline through
    all rows, the one that minimises ∫ |p − q|² + T⁴ |p̈|² dt. ``scale`` multiplies their rotation vectors.

    Args:
        track: the motion.
        smoothing: T of the low-pass [s]; 0 for none.
        scale: factor of the angles from the mean attitude.

    Raises:
        RowError: rows are too far apart to know how it turned between them, or the motion cannot be scaled.
    """
    from scipy.interpolate import CubicSpline

    rows = _smooth(track.time, relative(track), smoothing)
    if scale != 1.0:
        rows = _scaled(track, rows, scale)
    spline = CubicSpline(track.time, rows)
    between = track.time[:-1] + np.outer((0.25, 0.5, 0.75), np.diff(track.time))
    shortest = np.linalg.norm(spline(between), axis=2).min(axis=0)
    if shortest.min() < 0.5:
        k = int(shortest.argmin())
        raise RowError(f"it turns too far between data rows {track.row[k]} and {track.row[k + 1]}")
    return spline


def relative(track: Track) -> Array:
    """Return quaternions from the mean attitude (n, 4), continuous, and mostly on the side of +1.

    Raises:
        RowError: rows are too far apart to know how it turned between them.
    """
    from scipy.spatial.transform import Rotation

    steps = np.diff(track.time)
    weights = 0.5 * (np.append(steps, 0.0) + np.insert(steps, 0, 0.0))
    rotations = Rotation.from_quat(track.attitude, scalar_first=True)
    rows = (rotations.mean(weights=weights).inv() * rotations).as_quat(scalar_first=True)
    follows = np.einsum("ij,ij->i", rows[1:], rows[:-1])
    near = np.abs(follows) >= np.cos(0.5 * WIDEST)
    if not near.all():
        k = int(np.argmin(near))
        raise RowError(
            f"data row {track.row[k + 1]} turns by {2.0 * np.degrees(np.arccos(min(1.0, abs(follows[k])))):.0f}° from "
            f"the row before: more than {np.degrees(WIDEST):.0f}° cannot be interpolated; if it is no motion, "
            "reference.jump=1 takes it out"
        )
    rows[1:] *= np.cumprod(np.sign(follows))[:, None]
    return np.asarray(rows if rows[:, 0].sum() >= 0.0 else -rows)


def _smooth(time: Array, rows: Array, smoothing: float) -> Array:
    if smoothing == 0.0:
        return rows
    if len(time) < 5:
        raise RowError("at least 5 rows are needed for smoothing")
    from scipy.interpolate import make_smoothing_spline

    steps = np.diff(time)
    weights = 0.5 * (np.append(steps, steps[-1]) + np.insert(steps, 0, steps[0]))
    smooth = make_smoothing_spline(time, rows, w=weights, lam=smoothing**4)(time)
    return np.asarray(smooth / np.linalg.norm(smooth, axis=1)[:, None])


def _scaled(track: Track, rows: Array, scale: float) -> Array:
    """Return exp(scale · log q), where the logarithm goes on beyond half a turn."""
    sine = np.linalg.norm(rows[:, 1:], axis=1)
    half = np.arctan2(sine, rows[:, 0])
    if half.max() > 0.5 * AROUND:
        raise RowError(
            f"data row {track.row[half.argmax()]} is {2.0 * np.degrees(half.max()):.0f}° from the mean attitude: only "
            f"motions of up to {np.degrees(AROUND):.0f}° can be scaled; leave scale at 1"
        )
    factor = np.where(sine > 1e-12, np.sin(scale * half) / np.maximum(sine, 1e-12), scale)
    return np.column_stack([np.cos(scale * half), factor[:, None] * rows[:, 1:]])


def _held(spline: "CubicSpline", ends: npt.NDArray[Any], blend: float) -> Curve:
    """Return the curve at rest before and after: both ends are led to rest with an acceleration that falls to zero.

    In the tangent space at an end the curve leaves with rate v and acceleration a, and rests after the time B at
    v B/2 + a B²/12, where the polynomial that meets these six conditions is of fourth degree.
    """
    from scipy.interpolate import BPoly

    last = spline.x[-1]
    still = np.zeros(4)
    (start, v, a), (end, u, b) = (_states(ends[k]) for k in range(2))
    come = BPoly.from_derivatives(
        [-blend, 0.0], [[start - 0.5 * blend * v + blend**2 / 12.0 * a, still, still], [start, v, a]]
    )
    go = BPoly.from_derivatives(
        [last, last + blend], [[end, u, b], [end + 0.5 * blend * u + blend**2 / 12.0 * b, still, still]]
    )
    return Curve(_joined([come, spline, go]), -blend, last + blend)


def _closed(spline: "CubicSpline", ends: npt.NDArray[Any], blend: float) -> Curve:
    """Return the repeated curve: the end leads back to the start with continuous acceleration."""
    from scipy.interpolate import BPoly

    last = spline.x[-1]
    start, end = (np.array(_states(ends[k])) for k in range(2))
    sign = 1.0 if start[0] @ end[0] >= 0.0 else -1.0
    back = BPoly.from_derivatives([last, last + blend], [end, sign * start])
    period = last + blend
    if np.linalg.norm(back(np.linspace(last, period, 201)), axis=1).min() < 0.3:
        raise RowError("its end turns too fast to be led back to its start: give a shorter blend, or after = 'hold'")
    return Curve(_joined([spline, back]), 0.0, period, period, sign)


def _states(end: Any) -> tuple[Array, Array, Array]:
    """Return the quaternion q and, in the space tangent to the unit quaternions there, ½ q ω and ½ q ω̇, each (4,)."""
    w, x, y, z = q = end["attitude"]
    left = 0.5 * np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
    return q, left @ end["rate"], left @ end["acceleration"]


def _joined(parts: list[Any]) -> "PPoly":
    """Join piecewise polynomials, each of which begins where the one before ends, into one of fifth degree."""
    from scipy.interpolate import BPoly, PPoly

    pieces = [PPoly.from_bernstein_basis(part) if isinstance(part, BPoly) else part for part in parts]
    raised = [np.concatenate([np.zeros((6 - len(piece.c), *piece.c.shape[1:])), piece.c]) for piece in pieces]
    edges = [pieces[0].x[:1], *(piece.x[1:] for piece in pieces)]
    return PPoly(np.concatenate(raised, axis=1), np.concatenate(edges))
