"""References that rest: held in place, or slewed once about a fixed axis."""

from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.parameters import NonNegative, Positive, Vector, quantity
from spherical_wrist.reference.base import Reference, motion_of
from spherical_wrist.reference.minimum_jerk import minimum_jerk


class Hold(Reference):
    """A fixed attitude exp(v)."""

    rotation: Vector = quantity((0.3, 0.2, 0.0), "rad", "rotation vector v of the attitude")

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`.Reference.motion`."""
        still = np.zeros((len(time), 3))
        return motion_of(quaternion_of_vectors(np.tile(self.rotation, (len(time), 1))), still, still)


class Step(Reference):
    """A slew from the identity to exp(v) about the fixed axis of v, in minimum jerk.

    The fraction of the way at s = (t − start) / length, clipped to [0, 1], is 10 s³ − 15 s⁴ + 6 s⁵ (Flash and Hogan,
    1985): rate and acceleration are continuous and vanish at both ends.
    """

    rotation: Vector = quantity((0.4, 0.3, 0.2), "rad", "rotation vector v of the attitude that is reached")
    start: NonNegative = quantity(0.5, "s", "time at which the slew begins")
    length: Positive = quantity(0.5, "s", "time that the slew takes")

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`.Reference.motion`."""
        way, speed, change = minimum_jerk((time - self.start)[:, None] / self.length)
        v = np.array(self.rotation)
        return motion_of(quaternion_of_vectors(way * v), speed / self.length * v, change / self.length**2 * v)


def quaternion_of_vectors(vectors: Array) -> Array:
    """Return quaternions (n, 4) of rotation vectors [rad] (n, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vectors).as_quat(scalar_first=True))
