"""Settings of a film."""

from fractions import Fraction
from math import ceil
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError
from spherical_wrist.film.motion import Poses
from spherical_wrist.parameters import NonNegative, Parameters, Positive, quantity

SMALLEST, LARGEST = 64, 8192
"""Limits of the width and height of pictures [px]."""


def _size(given: Any) -> Any:
    """Parse ``"1280x720"``."""
    sides = given.lower().split("x") if isinstance(given, str) else given
    if not isinstance(sides, list | tuple) or len(sides) != 2 or not all(str(side).strip().isdigit() for side in sides):
        raise ValueError("must be WIDTHxHEIGHT in pixels, such as 1280x720")
    wide, high = (int(side) for side in sides)
    if not all(SMALLEST <= side <= LARGEST for side in (wide, high)):
        raise ValueError(f"width and height must be from {SMALLEST} to {LARGEST} pixels")
    return wide, high


class FilmSettings(Parameters):
    """Settings of a film or a picture.

    Raises:
        ParameterError: a value is not valid; in one line.
    """

    size: Annotated[tuple[int, int], BeforeValidator(_size)] = quantity((1280, 720), "px", "width and height")
    speed: Positive = quantity(1.0, "", "simulated time per time of the film: 0.25 is slowed four times")
    fps: Annotated[float, Field(gt=0, le=240)] | None = quantity(
        None, "1/s", "frames per second of the film; by default 30 for MP4, 20 for GIF"
    )
    start: NonNegative | None = quantity(None, "s", "simulated time that the film begins with")
    end: Positive | None = quantity(None, "s", "simulated time that it ends with")
    camera: str | None = quantity(None, "", "name of a camera of the model, or free")
    ghost: bool = quantity(True, "", "show the desired attitude")

    def span(self, motion: Poses) -> tuple[float, float]:
        """Return the first and the last simulated time shown [s].

        Raises:
            ParameterError: the recording does not have them.
        """
        first, last = float(motion.time[0]), motion.end
        begin, end = first if self.start is None else self.start, last if self.end is None else self.end
        for name, given in (("from", begin), ("to", end)):
            if not first - 1e-9 <= given <= last + 1e-9:
                raise ParameterError(f"{name} {given:g} s: the recording is from {first:g} s to {last:g} s")
        if begin >= end:
            raise ParameterError(f"from {begin:g} s to {end:g} s: the end must come after the beginning")
        return begin, end

    def instants(self, motion: Poses, fps: Fraction) -> Array:
        """Return the simulated times of the frames [s], each at the beginning of its frame.

        Raises:
            ParameterError: the recording does not have them.
        """
        begin, end = self.span(motion)
        step = self.speed / float(fps)
        count = max(1, ceil((end - begin) / step - 1e-6))
        return begin + step * np.arange(count, dtype=np.float64)
