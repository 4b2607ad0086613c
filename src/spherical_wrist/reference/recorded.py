"""Recorded motion from a file."""

from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy.typing as npt
from pydantic import AfterValidator

from spherical_wrist.errors import ParameterError
from spherical_wrist.parameters import NonNegative, Positive, quantity
from spherical_wrist.reference.base import Array, Reference
from spherical_wrist.reference.jigsaws import Arm
from spherical_wrist.reference.recorded_curve import After, Curve, Treatment, curve_of
from spherical_wrist.reference.recorded_file import read_recorded
from spherical_wrist.reference.recorded_rows import RowError

JIGSAWS_SMOOTHING = 0.04
"""Smoothing of JIGSAWS files [s] where none is given."""


def _absolute(file: Path) -> Path:
    if file == Path():
        raise ValueError("the path of a file is needed")
    try:
        return file.expanduser().resolve()
    except (OSError, RuntimeError) as error:
        raise ValueError(f"not a path ({error})") from None


class Recorded(Reference):
    """A recorded motion from a file, taken relative to its mean attitude; as a name also recorded:FILE.

    The file is CSV or Parquet with times and quaternions or rotation matrices, or the kinematics text of JIGSAWS (76
    columns at 30 Hz, recognised by itself), of which ``arm`` is taken; see
    :func:`spherical_wrist.reference.recorded_file.read_recorded`. Its first row is at t = 0. Between rows the motion is
    a spline with continuous acceleration, of which rate and acceleration are exact derivatives; see
    :func:`spherical_wrist.reference.recorded_curve.curve_of`. Body axes are those of the recorded body: z counts as the
    tool's.

    After its end, the motion comes to rest within the time ``blend`` and stays there (``hold``): nothing is tracked
    then, so compare laws over the time that was recorded. Or it goes back to its start in that time and begins anew,
    for ever (``repeat``). Before t = 0 likewise.

    Smoothing is a low-pass without lag, 1/(1 + (2π f T)⁴), down to a half at 1/(2π T): 4 Hz for the 0.04 s of JIGSAWS
    files, between the few hertz of voluntary movement and the tremor at 8 to 12 Hz (an assumption). All times are those
    of the recording, which ``speed`` then divides.

    Raises:
        ParameterError: when the motion is asked for and the file is not there, or is not a motion; in one line.
    """

    subject: ClassVar[str] = "file"

    file: Annotated[Path, AfterValidator(_absolute)] | None = quantity(
        None, "", "CSV, Parquet or JIGSAWS kinematics file; must be given"
    )
    arm: Arm = quantity("slave_right", "", "of a JIGSAWS file, the arm")
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
        if self.file is None:
            raise ParameterError("reference recorded: no file: give reference.file, or recorded:FILE for the reference")
        try:
            found = self.file.stat()
        except OSError as error:
            raise ParameterError(
                f"reference file {str(self.file)!r}: {(error.strerror or 'no such file').lower()}"
            ) from None
        motion = _curve(self, self.file, (found.st_mtime_ns, found.st_size)).motion(self.speed * time)
        motion["rate"] *= self.speed
        motion["acceleration"] *= self.speed**2
        return motion


@lru_cache(maxsize=4)
def _curve(recorded: Recorded, file: Path, _stamp: tuple[int, int]) -> Curve:
    """Return the motion of a file, read anew where the file has changed."""
    recording = read_recorded(file, recorded.arm, recorded.largest_gap)
    smoothing = recorded.smoothing
    if smoothing is None:
        smoothing = JIGSAWS_SMOOTHING if recording.jigsaws else 0.0
    treatment = Treatment(recorded.scale, smoothing, recorded.after, recorded.blend)
    try:
        return curve_of(recording.track, treatment)
    except RowError as error:
        raise ParameterError(f"reference file {str(file)!r}: {error}") from None
