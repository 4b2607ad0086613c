"""A needle driven through tissue, again and again."""

from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator

from spherical_wrist.arrays import Array
from spherical_wrist.parameters import NonNegative, Positive, Vector, quantity
from spherical_wrist.reference.base import Reference, motion_of
from spherical_wrist.reference.minimum_jerk import minimum_jerk
from spherical_wrist.reference.slew import quaternion_of_vectors


def _direction(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    if not np.linalg.norm(axis) > 0.0:
        raise ValueError("a direction is needed, not zero")
    return axis


class Suture(Reference):
    """The rotation of a needle drive: turn the needle through the tissue, rest, turn back for the next stitch, rest.

    A curved needle does least harm where it advances along its own circle (Seki et al., 1993), which takes a turn about
    the axis of that circle. With the angle θ from −arc/2 to arc/2 and back, each way in minimum jerk, the attitude is

        q(t) = exp(approach) exp(θ(t) a),  ω = θ̇ a,  ω̇ = θ̈ a,

    with the unit vector a along ``axis`` in the body frame: rate and acceleration are continuous and vanish during the
    rests, and all repeats for ever.

    Needles span 90°, 135°, 180° or 225° of their circle (1/4, 3/8, 1/2 or 5/8). The arc of 100° is what a 3/8 needle
    leaves when it is held and caught again some way from its ends; that, the times, the axis, 27° off the tool, and the
    approach are assumptions. The wrist tilts by up to 80° and spins by 260° (dVRK, large needle driver 400006): an
    ``axis`` along the tool, (0, 0, 1), asks for spin alone.
    """

    arc: NonNegative = quantity(1.75, "rad", "angle that the needle is driven through")
    axis: Annotated[Vector, AfterValidator(_direction)] = quantity(
        (0.5, 0.0, 1.0), "", "axis of the needle's circle, body frame; its length does not matter"
    )
    approach: Vector = quantity((0.3, 0.2, 0.0), "rad", "rotation vector of the attitude halfway through the drive")
    drive: Positive = quantity(2.0, "s", "time of the drive")
    back: Positive = quantity(1.2, "s", "time of turning back")
    pause: NonNegative = quantity(0.6, "s", "rest after the drive, and again after turning back")

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`.Reference.motion`."""
        since = np.mod(time, self.drive + self.back + 2.0 * self.pause)[:, None]
        there = minimum_jerk(since / self.drive)
        way_back = minimum_jerk((since - self.drive - self.pause) / self.back)
        a = np.array(self.axis) / np.linalg.norm(self.axis)
        angle = self.arc * (there.way - way_back.way - 0.5)
        rate = self.arc * (there.speed / self.drive - way_back.speed / self.back)
        acceleration = self.arc * (there.change / self.drive**2 - way_back.change / self.back**2)
        return motion_of(self._turned(angle * a), rate * a, acceleration * a)

    def _turned(self, vectors: Array) -> Array:
        """Return quaternions of exp(approach) exp(v), the factors multiplied out so that their sign never jumps."""
        from scipy.spatial.transform import Rotation

        w, x, y, z = quaternion_of_vectors(vectors).T
        a, b, c, d = Rotation.from_rotvec(self.approach).as_quat(scalar_first=True)
        return np.stack(
            [
                a * w - b * x - c * y - d * z,
                a * x + b * w + c * z - d * y,
                a * y - b * z + c * w + d * x,
                a * z + b * y - c * x + d * w,
            ],
            axis=1,
        )
