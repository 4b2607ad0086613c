"""Recorded motion from a file."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property, lru_cache
from math import inf
from pathlib import Path
from stat import S_ISCHR, S_ISFIFO, S_ISSOCK
from typing import Annotated, Any, ClassVar, Self

import numpy.typing as npt
from pydantic import AfterValidator, BeforeValidator

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError
from spherical_wrist.package_files import named_file
from spherical_wrist.parameters import NonNegative, Positive, quantity
from spherical_wrist.reference.base import Reference
from spherical_wrist.reference.jigsaws import Arm
from spherical_wrist.reference.recorded_columns import TimeUnit, read_columns
from spherical_wrist.reference.recorded_curve import After, Curve, curve_of, spline_of
from spherical_wrist.reference.recorded_file import Reading, Recording, read_recorded
from spherical_wrist.reference.recorded_flaws import Flaws, flaws_of, summary_of, without_jumps
from spherical_wrist.reference.recorded_rows import RowError, angles_between

SHORT_REST = 0.02
"""Fraction of a run that a motion may rest at its end without a warning."""


def _absolute(file: Path) -> Path:
    if file == Path():
        raise ValueError("the path of a file is needed")
    try:
        return named_file("motion", file).expanduser().resolve()
    except (OSError, RuntimeError) as error:
        raise ValueError(f"not a path ({error})") from None


File = Annotated[Path, AfterValidator(_absolute)]


class Recorded(Reference):
    """A recorded motion from a file, taken relative to its mean attitude; as a name also recorded:FILE.

    The file is a table in text or Parquet with times and quaternions or rotation matrices, a trajectory of TUM, EuRoC
    or KITTI, or the kinematics text of JIGSAWS (76 columns at 30 Hz), of which ``arm`` is taken. These are recognised;
    the columns of others are named in ``columns``, the unit of their times in ``time_unit``. See
    :func:`spherical_wrist.reference.recorded_file.read_recorded`, and ``wrist guide reference``. Its first row is at
    t = 0. Between rows the motion is a spline with continuous acceleration, of which rate and acceleration are exact
    derivatives; see :func:`spherical_wrist.reference.recorded_curve.spline_of`. Body axes are those of the recorded
    body: z counts as the tool's.

    After its end, the motion comes to rest within the time ``blend`` and stays there (``hold``): nothing is tracked
    then, so the steady window ends with the motion. Or it goes back to its start in that time and begins anew, for ever
    (``repeat``). Before t = 0 likewise.

    Smoothing is a low-pass without lag, 1/(1 + (2π f T)⁴), down to a half at 1/(2π T): 4 Hz for the 0.04 s of JIGSAWS
    files, between the few hertz of voluntary movement and the tremor at 8 to 12 Hz (an assumption). All times are those
    of the recording, which ``speed`` then divides.

    A run warns where the peaks of a file belong to its stamps, to noise or to one row, and says which of ``rate``,
    ``smoothing`` and ``jump`` helps; see :func:`spherical_wrist.reference.recorded_flaws.flaws_of`. A relative
    disturbance is sized by the motion with these settings.

    Raises:
        ParameterError: when the motion is asked for and the file is not there, or is not a motion; in one line.
    """

    subject: ClassVar[str] = "file"

    file: File | None = quantity(
        None, "", "table, trajectory or kinematics file, or the name of a motion of the package; must be given"
    )
    arm: Arm = quantity("slave_right", "", "of a JIGSAWS file, the arm")
    columns: Annotated[str | None, BeforeValidator(read_columns)] = quantity(
        None, "", "columns by name or number, as in 'time=stamp, w=q0, x=q1, y=q2, z=q3', where they are not recognised"
    )
    time_unit: TimeUnit | None = quantity(
        None, "", "unit of the times; where none is given, what the file says, or seconds"
    )
    times: File | None = quantity(None, "", "file with a time a row, for files without times such as KITTI's")
    rate: Positive | None = quantity(None, "Hz", "rows in a second, evenly spaced, in place of the times of the file")
    jump: Positive | None = quantity(
        None, "rad", "turns from row to row above it are no motion, and taken out; where none is given, all are motion"
    )
    scale: NonNegative = quantity(1.0, "", "factor of the angles from the mean attitude")
    speed: Positive = quantity(1.0, "", "how many times as fast as it was recorded")
    smoothing: NonNegative | None = quantity(
        None, "s", "time constant T of the low-pass; where none is given, 0.04 for JIGSAWS files and 0 for others"
    )
    largest_gap: Positive = quantity(0.5, "s", "longest time from row to row that is interpolated")
    after: After = quantity("hold", "", "motion after the end")
    blend: Positive = quantity(0.5, "s", "time of coming to rest, or of going back to the start")

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`.Reference.motion`.

        Raises:
            ParameterError: there is no file, or it is not a motion.
        """
        motion = _curve(self._loaded(), self.scale, self.after, self.blend).motion(self.speed * time)
        motion["rate"] *= self.speed
        motion["acceleration"] *= self.speed**2
        return motion

    def end(self) -> float:
        """See :meth:`.Reference.end`.

        Raises:
            ParameterError: there is no file, or it is not a motion.
        """
        return inf if self.after == "repeat" else self.whole()

    def whole(self) -> float:
        """See :meth:`.Reference.whole`.

        Raises:
            ParameterError: there is no file, or it is not a motion.
        """
        return float(self._loaded().recording.track.time[-1]) / self.speed

    def about(self) -> str:
        """See :meth:`.Reference.about`.

        Raises:
            ParameterError: there is no file, or it is not a motion.
        """
        loaded = self._loaded()
        return f"motion {loaded.file.name}: {loaded.summary}"

    def warnings(self, duration: float) -> tuple[str, ...]:
        """See :meth:`.Reference.warnings`.

        Raises:
            ParameterError: there is no file, or it is not a motion.
        """
        loaded, end = self._loaded(), self.end()
        found = [*loaded.recording.notes, *loaded.flaws.warnings]
        if end < (1.0 - SHORT_REST) * duration:
            found.append(
                f"it ends at {end:.4g} s, and the run at {duration:.4g} s: figures are up to the end of the motion; "
                "--duration whole ends the run with it, and reference.after=repeat goes on"
            )
        return tuple(f"motion {loaded.file.name}: {warning}" for warning in found)

    def sizing(self) -> Self:
        """See :meth:`.Reference.sizing`.

        Raises:
            ParameterError: there is no file, or it is not a motion.
        """
        settings = self._loaded().flaws.settings
        return self.replaced(**settings) if settings else self

    def state(self) -> tuple[tuple[int, int], ...]:
        """Return times of change and sizes of the files.

        Raises:
            ParameterError: one is not there.
        """
        stamps = []
        for file in filter(None, (self.file, self.times)):
            try:
                found = file.stat()
            except OSError as error:
                raise ParameterError(
                    f"reference file {str(file)!r}: {(error.strerror or 'no such file').lower()}"
                ) from None
            if S_ISFIFO(found.st_mode) or S_ISCHR(found.st_mode) or S_ISSOCK(found.st_mode):
                raise ParameterError(f"reference file {str(file)!r} is no file that can be read twice: save it as one")
            stamps.append((found.st_mtime_ns, found.st_size))
        return tuple(stamps)

    def _loaded(self) -> "_Loaded":
        return _load(self._file(), self._reading, self.jump, self.smoothing, self.state())

    def _file(self) -> Path:
        if self.file is None:
            raise ParameterError("reference recorded: no file: give reference.file, or recorded:FILE for the reference")
        return self.file

    @property
    def _reading(self) -> Reading:
        return Reading(self.arm, self.columns, self.time_unit, self.rate, self.times, self.largest_gap)


class _Loaded:
    """Motion that has been read, with its description and warnings.

    Attributes:
        file: its file.
        recording: contents of the file, without jumps.
        smoothing: smoothing that it gets [s].
        spline: through its rows.
        stamped: whether its times are those of the file.
    """

    def __init__(self, file: Path, recording: Recording, smoothing: float, *, stamped: bool) -> None:
        self.file, self.recording, self.smoothing, self.stamped = file, recording, smoothing, stamped
        self.spline = spline_of(recording.track, smoothing)

    @cached_property
    def flaws(self) -> Flaws:
        """Flaws that its peaks belong to."""
        try:
            return flaws_of(self.recording, self.spline, self.smoothing, stamped=self.stamped)
        except RowError:  # without a flaw that it seems to have it would be no motion
            return Flaws({}, ())

    @cached_property
    def summary(self) -> str:
        """Description in one line."""
        return summary_of(self.recording, self.spline, self.smoothing)


@lru_cache(maxsize=4)
def _load(
    file: Path, reading: Reading, jump: float | None, smoothing: float | None, _state: tuple[tuple[int, int], ...]
) -> _Loaded:
    """Return the motion of a file, read anew where the file has changed."""
    recording = read_recorded(file, reading)
    smoothing = recording.smoothing if smoothing is None else smoothing
    with _named(file):
        if jump is not None:
            jumps = int((angles_between(recording.track.attitude) > jump).sum())
            said = f"{recording.said}, {jumps} turn{'s' * (jumps != 1)} of more than {jump:g} rad taken out"
            recording = recording._replace(track=without_jumps(recording.track, jump), said=said)
        return _Loaded(file, recording, smoothing, stamped=reading.rate is None and recording.stamped)


@lru_cache(maxsize=4)
def _curve(loaded: _Loaded, scale: float, after: After, blend: float) -> Curve:
    """Return the curve of a motion that has been read."""
    with _named(loaded.file):
        scaled = loaded.spline if scale == 1.0 else spline_of(loaded.recording.track, loaded.smoothing, scale)
        return curve_of(scaled, after, blend)


@contextmanager
def _named(file: Path) -> Iterator[None]:
    """Add the name of a file to complaints about its rows."""
    try:
        yield
    except RowError as error:
        raise ParameterError(f"reference file {str(file)!r}: {error}") from None
