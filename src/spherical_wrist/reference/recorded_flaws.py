"""Flaws of a recorded motion: peaks that belong to the stamps, to one row or to noise, and the settings that help.

A peak of the acceleration is blamed on a flaw only where taking that flaw away makes it several times smaller.
"""

from bisect import bisect_left
from math import sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.reference.curve import motion_of_curve
from spherical_wrist.reference.recorded_curve import relative, spline_of
from spherical_wrist.reference.recorded_file import Recording
from spherical_wrist.reference.recorded_rows import FEWEST, RowError, Track, angles_between

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

BLAME = 2.0
"""Factor by which a peak of the acceleration falls without a flaw that it belongs to."""
EXCERPT = 4000
"""Rows around the peak of the acceleration in which noise is looked for."""
UNEVEN = 1e-3
"""Scatter of the times from row to row, relative to their mean, from which the stamps are looked at."""
LEAST_JUMP = 0.03
"""Least angle [rad] of a jump."""
JUMP_FACTOR = 8.0
"""Least turn of a jump as a multiple of the median turn around it."""
NEIGHBOURS = 4
"""Rows on each side that a jump is compared with."""
MOST_JUMPS = 0.02
"""Largest fraction of the rows that jump; more are the motion."""
LARGEST_SHARE = 0.1
"""Largest fraction of the rows that can be taken out as jumps."""
ORDER = 8
"""Order of the divided differences that noise is estimated from."""
QUIET = 0.15
"""Acceleration of the noise that smoothing leaves, relative to that of the motion (both RMS)."""
TRIALS = 60
"""Smoothings among which one is looked for, in equal ratios."""
LONGEST_SMOOTHING = 0.1
"""Largest smoothing that is tried, as a fraction of the recording."""
FEW_GAPS = 0.05
"""Largest fraction of the rows after a gap of which the usual time from row to row is the median."""
INTERPOLATES = 0.25
"""Smoothing that acts on noise less than interpolation does, as a fraction of the time from row to row."""
PEAK = 3.0
"""Ratio of the largest acceleration of noise to its RMS value, at least."""
SHOWN = 3
"""Rows that are named in a line."""
OVERDONE = 3.0
"""Largest distance that a smoothing may move rows, relative to the noise (both RMS)."""


class Peaks(NamedTuple):
    """Largest rate [rad/s] and acceleration [rad/s²] of a recorded motion, and the time of the latter [s]."""

    rate: float
    acceleration: float
    time: float


class Flaws(NamedTuple):
    """Flaws of a recorded motion.

    Attributes:
        settings: parameters of the reference that help, by name.
        warnings: what is doubtful and which setting helps, one line each.
    """

    settings: dict[str, float]
    warnings: tuple[str, ...]


def without_jumps(track: Track, jump: float) -> Track:
    """Return a motion without turns from row to row above ``jump`` [rad]: what follows is turned back in the world.

    In place of such a turn, the body goes on with a rate between those before and after it.

    Raises:
        RowError: so many turns are above it that they are the motion.
    """
    from scipy.spatial.transform import Rotation

    turns = angles_between(track.attitude)
    if not (turns > jump).any():
        return track
    if (turns > jump).mean() > LARGEST_SHARE:
        out, usual = int((turns > jump).sum()), float(np.median(turns))
        raise RowError(
            f"reference.jump = {jump:g} rad would take out {out} of its {len(turns)} turns from row to row, of "
            f"{usual:.2g} rad in the median: give a larger one"
        )
    turned = Rotation.from_quat(track.attitude, scalar_first=True)
    steps = (turned[:-1].inv() * turned[1:]).as_rotvec()
    jumps = np.linalg.norm(steps, axis=1) > jump
    rates = steps / np.diff(track.time)[:, None]
    where, middle = np.flatnonzero(jumps), 0.5 * (track.time[1:] + track.time[:-1])
    between = [np.interp(middle[jumps], middle[~jumps], rate[~jumps]) for rate in rates.T]
    fixed = np.stack(between, axis=1) * np.diff(track.time)[jumps, None]
    # world-side corrections C, from each jump to the next: C' = C q_k δ q_(k+1)^-1
    corrections = [Rotation.identity()]
    for k, step in zip(where, fixed, strict=True):
        corrections.append(corrections[-1] * turned[k] * Rotation.from_rotvec(step) * turned[k + 1].inv())
    part = np.append(0, np.cumsum(jumps))
    moved = Rotation.concatenate(corrections)[part] * turned
    return track._replace(attitude=np.asarray(moved.as_quat(scalar_first=True)))


def peaks_of(track: Track, spline: "CubicSpline") -> Peaks:
    """Return the peaks of a motion along the spline through it, at its rows and in the middle between them."""
    time = np.sort(np.append(track.time, 0.5 * (track.time[1:] + track.time[:-1])))
    motion = motion_of_curve(spline(time), spline(time, 1), spline(time, 2))
    rate, acceleration = (np.linalg.norm(motion[name], axis=1) for name in ("rate", "acceleration"))
    return Peaks(float(rate.max()), float(acceleration.max()), float(time[acceleration.argmax()]))


def flaws_of(recording: Recording, spline: "CubicSpline", smoothing: float, *, stamped: bool) -> Flaws:
    """Find the causes of the peaks of a motion.

    Args:
        recording: the motion, without jumps above the person's ``jump``.
        spline: through its rows, with that smoothing.
        smoothing: smoothing that it gets [s].
        stamped: whether its times are those of the file.
    """
    track, settings, warnings = recording.track, {}, []
    peaks = peaks_of(track, spline)
    if stamped and (found := _stamps(track, peaks, smoothing)) is not None:
        rate, track = found
        better = peaks_of(track, spline_of(track, smoothing))
        settings["rate"] = rate
        steps = 1e3 * np.diff(recording.track.time)
        warnings.append(
            f"its times are {_figure(steps.min())} to {_figure(steps.max())} ms apart, and peaks of {_peaks(peaks)} "
            f"belong to these stamps: with evenly spaced rows, by reference.rate={rate:g}, they are {_peaks(better)}"
        )
        peaks = better
    jumps, limit = _jumps(track)
    if len(jumps):
        turns = np.degrees(angles_between(track.attitude))
        track = without_jumps(track, limit)
        better = peaks_of(track, spline_of(track, smoothing))
        settings["jump"] = limit
        named = ", ".join(f"data row {recording.track.row[k + 1]} by {turns[k]:.3g}°" for k in jumps[:SHOWN])
        more = f" and {len(jumps) - SHOWN} more" if len(jumps) > SHOWN else ""
        warnings.append(
            f"it jumps from row to row: {named}{more}, where {np.median(turns):.2g}° are usual; if that is no motion, "
            f"reference.jump={limit:g} takes it out, and the peaks fall from {_peaks(peaks)} to {_peaks(better)}"
        )
        peaks = better
    noise = _Noise.of(track, peaks, recording)
    found_smoothing = noise.smoothing(smoothing) if noise is not None else None
    if noise is not None and found_smoothing is not None:
        value, calm = found_smoothing
        settings["smoothing"] = value
        what = f"noise of about {_figure(1e3 * noise.size)} mrad"
        if noise.decimals is not None:
            what = f"rounding to {noise.decimals} decimal{'s' if noise.decimals != 1 else ''}"
        moves = np.degrees(moved_by(noise.track, spline_of(noise.track, value)).max())
        warnings.append(
            f"its peak of {_figure(peaks.acceleration)} rad/s² belongs to {what}: reference.smoothing={value:g} fits, "
            f"moves rows by up to {moves:.2g}°, and leaves {_figure(calm)} rad/s²"
        )
    return Flaws(settings, tuple(warnings))


def _stamps(track: Track, peaks: Peaks, smoothing: float) -> tuple[float, Track] | None:
    """Return the rate [Hz] of even stamps, and the motion with them, if the peaks belong to the stamps."""
    steps = np.diff(track.time)
    if len(steps) < 2 * FEWEST or steps.std() < UNEVEN * steps.mean():
        return None
    number = track.row - track.row[0]
    rate = float(f"{1.0 / np.polyfit(number, track.time, 1)[0]:.4g}")
    even = track._replace(time=number / rate)
    try:
        better = peaks_of(even, spline_of(even, smoothing))
    except RowError:
        return None
    return (rate, even) if peaks.acceleration > BLAME * better.acceleration else None


def _jumps(track: Track) -> tuple[npt.NDArray[np.intp], float]:
    """Return the numbers of the turns from row to row that are jumps, and an angle [rad] that tells them apart."""
    turns = angles_between(track.attitude)
    none = np.zeros(0, np.intp), 0.0
    if len(turns) < 2 * NEIGHBOURS:
        return none
    padded = np.pad(turns, NEIGHBOURS, mode="reflect")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEIGHBOURS + 1)
    usual = np.median(np.delete(around, NEIGHBOURS, axis=1), axis=1)
    found = (turns > LEAST_JUMP) & (turns > JUMP_FACTOR * usual)
    jumps = np.flatnonzero(found)
    if len(jumps) == 0 or len(jumps) > max(1.0, MOST_JUMPS * len(turns)):
        return none
    least, most = float(turns[jumps].min()), float(turns[~found].max())
    if least <= most:
        jumps = jumps[turns[jumps] > most]
        if len(jumps) == 0:
            return none
        least = float(turns[jumps].min())
    limit = float(f"{sqrt(least * max(most, 0.1 * least)):.2g}")
    return jumps, limit if most < limit < least else 0.5 * (least + most)


class _Noise(NamedTuple):
    """Noise of a motion.

    Attributes:
        track: rows around its largest acceleration.
        size: of the angle per axis, RMS [rad].
        density: square of the size times the time over which it is the same [rad²·s].
        decimals: of the file, if they are the reason.
    """

    track: Track
    size: float
    density: float
    decimals: int | None

    @classmethod
    def of(cls, track: Track, peaks: Peaks, recording: Recording) -> "_Noise | None":
        """Estimate the noise around the largest acceleration; None for too few rows."""
        middle = int(np.searchsorted(track.time, peaks.time))
        first = max(0, min(middle - EXCERPT // 2, len(track.time) - EXCERPT))
        piece = slice(first, first + EXCERPT)
        part = Track(track.time[piece] - track.time[first], track.attitude[piece], track.row[piece])
        if len(part.time) < 2 * ORDER:
            return None
        step = float(np.median(np.diff(part.time)))
        size = _scatter(part)
        density, decimals = size**2 * step, None
        if recording.decimals is not None:
            entry = recording.entry * 10.0**-recording.decimals
            slow = entry / max(float(np.sqrt(np.mean((angles_between(part.attitude) / np.diff(part.time)) ** 2))), 1e-9)
            rounding = entry / sqrt(12.0)
            written = rounding**2 * min(max(step, slow), LONGEST_SMOOTHING * float(part.time[-1]))
            if written > 0.5 * density:
                size, density, decimals = max(size, rounding), max(density, written), recording.decimals
        return cls(part, size, density, decimals)

    def acceleration(self, smoothing: float) -> float:
        """Return the RMS acceleration [rad/s²] of white noise behind the low-pass of a smoothing, three axes together.

        With the low-pass 1/(1 + (ω T)⁴) and a density S that is the same at all frequencies it is, per axis,
        S/π ∫ ω⁴/(1 + (ω T)⁴)² dω over all ω > 0, and that integral is π √2 / (16 T⁵).
        """
        return sqrt(3.0 * self.density * sqrt(2.0) / (16.0 * smoothing**5))

    def smoothing(self, given: float) -> tuple[float, float] | None:
        """Return the smoothing that fits, and the peak that it leaves [rad/s²]; None where noise is not the matter."""
        before = peaks_of(self.track, spline_of(self.track, given)).acceleration
        shortest = INTERPOLATES * float(np.diff(self.track.time).min())
        if before <= 0.0 or self.density <= 0.0 or PEAK * self.acceleration(max(given, shortest)) < before / BLAME:
            return None
        # with less, noise alone would have such a peak
        least = (3.0 * self.density * sqrt(2.0) / (16.0 * (QUIET * before) ** 2)) ** 0.2
        trials = np.geomspace(max(least, given), LONGEST_SMOOTHING * float(self.track.time[-1]), TRIALS)
        first = bisect_left(trials, True, key=lambda value: self._is_quiet(float(value)))
        if trials[0] >= trials[-1] or first == len(trials):
            return None
        smoothing = float(f"{trials[first]:.2g}")
        spline = spline_of(self.track, smoothing)
        after = peaks_of(self.track, spline).acceleration
        moved = float(np.sqrt(np.mean(moved_by(self.track, spline) ** 2)))
        helps = smoothing > given and before > BLAME * after and moved < OVERDONE * sqrt(3.0) * self.size
        return (smoothing, after) if helps else None

    def _is_quiet(self, smoothing: float) -> bool:
        """Return True where the noise that a smoothing leaves is small against the motion that it leaves."""
        spline, time = spline_of(self.track, smoothing), self.track.time
        left = motion_of_curve(spline(time), spline(time, 1), spline(time, 2))["acceleration"]
        return self.acceleration(smoothing) <= QUIET * float(np.sqrt(np.mean(np.sum(left**2, axis=1))))


def _scatter(track: Track) -> float:
    """Estimate the RMS noise of the angle per axis [rad] from divided differences, which no smooth motion has."""
    time = track.time / float(np.median(np.diff(track.time)))
    windows = np.lib.stride_tricks.sliding_window_view(time, ORDER + 1)
    apart = windows[:, :, None] - windows[:, None, :] + np.eye(ORDER + 1)
    weights = 1.0 / apart.prod(axis=2)
    weights /= np.linalg.norm(weights, axis=1)[:, None]
    rows = np.lib.stride_tricks.sliding_window_view(relative(track), ORDER + 1, axis=0)
    differences = np.einsum("nj,ncj->nc", weights, rows)
    # a quaternion's three free numbers change by half the angle
    return float(2.0 * sqrt(np.mean(np.sum(differences**2, axis=1)) / 3.0))


def moved_by(track: Track, spline: "CubicSpline") -> Array:
    """Return the angles [rad] between rows and the spline that was fitted to them, (n,)."""
    before, after = relative(track), spline(track.time)
    after = after / np.linalg.norm(after, axis=1)[:, None]
    apart = np.minimum(np.linalg.norm(after - before, axis=1), np.linalg.norm(after + before, axis=1))
    return np.asarray(4.0 * np.arcsin(np.minimum(0.5 * apart, 1.0)))


def summary_of(recording: Recording, spline: "CubicSpline", smoothing: float) -> str:
    """Summarise a file in one line: rows, rate, gaps, peaks, largest step, tilt, and the effect of smoothing."""
    from scipy.spatial.transform import Rotation

    track = recording.track
    steps, turns = np.diff(track.time), np.degrees(angles_between(track.attitude))
    usual, longest, most = float(np.median(steps)), float(steps.max()), int(turns.argmax())
    tool = Rotation.from_quat(relative(track), scalar_first=True).apply([0.0, 0.0, 1.0])
    tilt = np.degrees(np.arctan2(np.hypot(tool[:, 0], tool[:, 1]), tool[:, 2]).max())
    gaps = int((steps > 1.5 * usual).sum())
    gap = f"{gaps} gap{'s' if gaps > 1 else ''} of up to {longest:.3g} s" if gaps else "no gaps"
    rate = f"{1.0 / usual:.4g} Hz"
    if gaps > FEW_GAPS * len(steps):
        rate = f"{len(steps) / track.time[-1]:.4g} Hz in the mean"
    text = (
        f"{recording.said}; {len(track.time)} rows at {rate} over {track.time[-1]:.4g} s, {gap}; peaks of "
        f"{_peaks(peaks_of(track, spline))}; largest step {turns[most]:.2g}° (data row {track.row[most + 1]}), tilt "
        f"up to {tilt:.3g}°"
    )
    if smoothing:
        text += f"; smoothing of {smoothing:g} s moves rows by up to {np.degrees(moved_by(track, spline).max()):.2g}°"
    return text


def _peaks(peaks: Peaks) -> str:
    return f"{_figure(peaks.rate)} rad/s and {_figure(peaks.acceleration)} rad/s²"


def _figure(value: Any) -> str:
    """Return a number with two or three digits, without an exponent where it is not huge."""
    return f"{float(f'{value:.2g}'):,.10g}".replace(",", "") if value < 1e6 else f"{value:.2g}"
